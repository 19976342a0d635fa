"""What a feature of the part is: a file of this folder, and its line in `REGISTRY`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, Self

from truepose.arrays import Floats
from truepose.workpiece.element import Element
from truepose.workpiece.element import FeatureError as FeatureError

if TYPE_CHECKING:
    from pydantic import BaseModel

Method = Literal["iso", "least-squares"]
"""`evaluate` of a feature: the default operators of the standards, or least squares."""

Rule = Literal["between", "spread", "length"]
"""How a value follows from linear forms, see `Forms`."""


@dataclass(frozen=True)
class Quantity:
    """One number of a feature that the drawing tolerances.

    `name`: within its feature, such as "diameter". `nominal`, `lower`, `upper`: the value asked
    for, and its limits (a form and a zone: 0, and the width of the zone), SI; `lower` or `upper`
    infinite where there is none. `si`: "m" or "rad". `is_form`: at perfect form it is 0 and cannot
    be less, so that a standard uncertainty means nothing. `operator`: how it is evaluated, with the
    standard, such as "two-point size (ISO 14405-1), smallest"; `filter`: "none".
    """

    name: str
    nominal: float
    lower: float
    upper: float
    si: Literal["m", "rad"]
    is_form: bool
    operator: str
    filter: str = "none"


@dataclass(frozen=True, eq=False)
class Forms:
    """Linear forms of the points' errors that a quantity follows, to first order.

    form[k] = base[k] + sum over points i of weights[k, i] . error[i]

    `weights` (K, n, 3) over the points of all elements, those of datums after the feature's own.
    The value lies, but for the second order:
        between   at the smallest, or the largest, form as `side` -1 or +1 says; K 1: it is that one
        spread    at most at `factor` times the largest less the smallest form
        length    at `factor` times the Euclidean length of all forms
    Each of `plus`, forms of rule "spread", says by how much the value may lie elsewhere besides, up
    or down, to first order too: a datum's own form, which moves what touches it. `curvature`, 1/m
    (rad/m^2 of an angle): by what the geometry bends, no more than `curvature` rho^2 is added or
    taken where no point is off by more than rho, and rho is at most `reach`, m; it holds what those
    of `plus` bend. `base` (K,), SI. A shift that all points share
    adds nothing of second order, so that rho may be what is left of errors when any one is taken
    off; where weights sum to nothing, over all points of each form, it changes nothing at all.
    """

    rule: Rule
    weights: Floats
    base: Floats
    curvature: float
    side: int = 1
    factor: float = 1.0
    plus: tuple[Forms, ...] = ()
    reach: float = math.inf


class Feature(Protocol):
    """A feature of one kind, built from its row of the features file (or the program's comment).

    `elements` and `datums` are the parts of the path that it is about.
    """

    kind: ClassVar[str]
    doc: ClassVar[str]
    table: ClassVar[type[BaseModel]]

    name: str
    elements: Sequence[Element]
    datums: Sequence[Element]
    quantities: tuple[Quantity, ...]

    @classmethod
    def build(
        cls,
        name: str,
        row: BaseModel,
        elements: Sequence[Element],
        datums: Mapping[str, Element],
        method: Method,
    ) -> Self:
        """From its checked row; `datums` by name, in the order of the row.

        Raises `FeatureError` where the elements are not what the kind is about:
        points that are no circle, too few of them, datums that form no frame.
        """
        ...

    def values(self, points: Sequence[Floats]) -> Floats:
        """(s, n_quantity) of parts whose tool points are there, SI.

        `points`: (s, n, 3) of each element, then of each datum, m.
        """
        ...

    def forms(self) -> tuple[Forms, ...]:
        """The linear forms of each quantity."""
        ...
