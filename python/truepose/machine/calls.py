"""The types of a machine's kinematic calls, the kernel's own methods, and of a figure of it."""

from __future__ import annotations

from os import PathLike
from typing import Any, Literal, Protocol, overload

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


class Plotted(Protocol):
    """What `Machine.plot` returns: a figure of plotly.js that shows itself in a notebook."""

    @property
    def name(self) -> str:
        """Of the figure, as it was asked for."""

    @property
    def caption(self) -> str:
        """How it is read."""

    @property
    def figure(self) -> dict[str, Any]:
        """Its `data` and `layout`."""

    def write(self, path: str | PathLike[str]) -> None:
        """Write it, FILE.html or FILE.json."""
