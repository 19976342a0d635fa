"""The types of a machine's kinematic calls, which are the kernel's own methods."""

from __future__ import annotations

from typing import Literal, Protocol, overload

from numpy.typing import ArrayLike

from truepose.arrays import Codes, Floats

WithStatus = tuple[Floats, Codes]


class OfPoses(Protocol):
    """A call of poses (..., n_commanded), SI."""

    @overload
    def __call__(self, poses: ArrayLike, *, status: Literal[False] = False) -> Floats: ...
    @overload
    def __call__(self, poses: ArrayLike, *, status: Literal[True]) -> WithStatus: ...


class OfJoints(Protocol):
    """A call of joints (..., n_joint), SI, from `start`, default home."""

    @overload
    def __call__(
        self, joints: ArrayLike, start: ArrayLike | None = None, *, status: Literal[False] = False
    ) -> Floats: ...
    @overload
    def __call__(
        self, joints: ArrayLike, start: ArrayLike | None = None, *, status: Literal[True]
    ) -> WithStatus: ...


class OfWrenches(Protocol):
    """A call of poses (..., n_commanded) and the wrench (..., 6) at each, SI."""

    @overload
    def __call__(
        self, poses: ArrayLike, wrench: ArrayLike, *, status: Literal[False] = False
    ) -> Floats: ...
    @overload
    def __call__(
        self, poses: ArrayLike, wrench: ArrayLike, *, status: Literal[True]
    ) -> WithStatus: ...
