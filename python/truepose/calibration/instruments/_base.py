"""What an instrument is, and what a kind of instrument says of itself.

Points are in m, base axes, unless said otherwise; a frame turns a point P of the base frame into
`R^T (P - origin)`, what the instrument reads of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from truepose.calibration.observables import OF_STRUTS, si_unit
from truepose.spatial import Quaternion

Vector = tuple[float, float, float]
End = Literal["base", "platform"]
Freedoms = tuple[bool, bool, bool, bool, bool, bool]

FRAME_FREEDOMS = ("x", "y", "z", "a", "b", "c")
"""Names of what may be unknown of a frame: its origin along, its rotation about, the base axes."""

KNOWN = (False,) * 6

AXES = ("x", "y", "z")
ANGLES = ("a", "b", "c")


@dataclass(frozen=True)
class Frame:
    """The frame that an instrument reads in: it sees a point P of the base frame at R^T (P - o).

    `origin`: o in the base frame, m; `rotation`: of R, frame axes to base axes, a unit quaternion
    w x y z. Where they are `unknown` (6,), origin along x y z and rotation about the base axes
    x y z, these are where the search starts.
    """

    origin: Vector = (0.0, 0.0, 0.0)
    rotation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    unknown: tuple[bool, ...] = KNOWN


@dataclass(frozen=True)
class Instrument:
    """One instrument as the measurements declare it; SI.

    `kind`: a key of `instruments.REGISTRY`. `target`: what it looks at, from the tool point along
    the platform's axes, m; the start of a search where it is unknown; `target_uncertainty`: how
    well it is known, standard, along each of these axes, 0 exactly. With `bias_unknown` an
    unknown constant is added to what it reads, one for each observable; of struts one for each
    strut. `uncertainty`: standard ones by observable, or by SI unit ("m", "rad", "1"), for rows
    that say none. `axis`, `zero`, `end`: of joint-angle sensors, a strut's turn about `axis` from
    the direction `zero`, in the axes of the frame or, at the end "platform", of the platform.
    """

    name: str
    kind: str
    frame: Frame
    target: Vector = (0.0, 0.0, 0.0)
    target_unknown: bool = False
    bias_unknown: bool = False
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    axis: Vector = (0.0, 0.0, 1.0)
    zero: Vector = (1.0, 0.0, 0.0)
    end: str = "base"
    target_uncertainty: Vector = (0.0, 0.0, 0.0)

    def uncertainty_of(self, observable: str) -> float | None:
        """Standard uncertainty of an observable where a row says none, SI; None: not stated."""
        given = self.uncertainty.get(observable)
        if given is not None:
            return given
        return self.uncertainty.get(si_unit(observable))


FrameRule = Callable[[Sequence[str], Sequence[str]], Freedoms]
"""(observables, machine's components) -> what of a frame they say something of."""


@dataclass(frozen=True)
class Kind:
    """A kind of instrument.

    `name`: the word in a file; `doc`: one sentence for people; `by`: how it says where the machine
    is, "by heights alone" (of what it can read, see `phrase`). `reads`: observables that it can
    read, by the column that holds them: {"x": "x"}; a strut's columns are `strut.<name>.length`,
    here `length`. `least`, `most`: how many of them an instrument has, None: all that the platform
    moves in. `fixed`: observables that are 0 in every row, without a column. `optional`: a column
    that may be missing or blank and then is 0. `frame`: which of a frame's freedoms are identified
    where the file says `frame = "unknown"`; None: what it reads has no frame. `has_target`:
    whether what it reads depends on a target point. `poses`: at how many commanded poses each of
    its rows is. `keys`: of `axis`, `zero`, `end` those that it
    takes.
    """

    name: str
    doc: str
    by: str
    reads: Mapping[str, str]
    least: int | None = 1
    most: int | None = None
    fixed: tuple[str, ...] = ()
    optional: bool = False
    frame: FrameRule | None = None
    has_target: bool = True
    poses: int = 1
    keys: tuple[str, ...] = ()
    phrases: Callable[[Sequence[str]], str] | None = None

    @property
    def of_struts(self) -> bool:
        """Whether it reads something of each strut."""
        return any(observable in OF_STRUTS for observable in self.reads.values())

    def phrase(self, observables: Sequence[str]) -> str:
        """How these observables say where the machine is: "by heights alone"."""
        return self.by if self.phrases is None else self.phrases(observables)

    def observed(self, components: Sequence[str]) -> tuple[str, ...]:
        """The observables that an instrument of this kind reads by default.

        All that the platform can change, of a kind that reads some coordinates the last of them:
        the height. `components`: those of x y z rx ry rz that the platform moves in. Those of
        struts are of every strut.
        """
        possible = self.fixed or tuple(dict.fromkeys(self.reads.values()))
        readable = tuple(observable for observable in possible if moved(observable, components))
        return readable if self.most is None else readable[-1:]


def moved(observable: str, components: Sequence[str]) -> bool:
    """Whether a machine that moves in `components` can change an observable at all."""
    if observable in AXES:
        return observable in components
    if observable in ANGLES:
        return rotation_component(observable) in components
    return True


def rotation_component(angle: str) -> str:
    """`rx` of the angle `a`: rotation about that axis."""
    return "r" + AXES[ANGLES.index(angle)]


def of_readings(observables: Sequence[str], components: Sequence[str]) -> Freedoms:
    """What of a frame is seen by coordinates and angles read in it, for frames near the base's.

    The origin along the axes that are read. A rotation where it changes a coordinate that is read
    as the platform moves, as about x the height z where it moves along y; or an angle that is read.
    """
    along = [axis in observables for axis in AXES]
    about = [False] * 3
    for i in range(3):
        for j, k in ((i - 2, i - 1), (i - 1, i - 2)):
            about[i] |= AXES[j] in observables and AXES[k] in components
        about[i] |= ANGLES[i] in observables
    if "rz" in components and ("a" in observables or "b" in observables):
        # Turned about z, the platform shows a tilt of the frame now in one angle, now in the other.
        about[0] = about[1] = True
    return (along[0], along[1], along[2], about[0], about[1], about[2])


def of_origin(observables: Sequence[str], components: Sequence[str]) -> Freedoms:
    """The origin, along the axes in which the platform moves: what distances and contacts see."""
    x, y, z = (axis in components for axis in AXES)
    return (x, y, z, False, False, False)


def of_rotation(observables: Sequence[str], components: Sequence[str]) -> Freedoms:
    """The whole rotation: what directions see."""
    return (False, False, False, True, True, True)


def listed(words: Iterable[str]) -> str:
    """`x, y and z`."""
    every = list(words)
    return " and ".join([", ".join(every[:-1]), every[-1]] if len(every) > 1 else every)
