"""What is asked of the drawn part: rows of a features file, and the same by `measured`.

`QUESTIONS` has every kind of feature, with datums of every kind; those that need a face are not
asked of a machine that moves in a plane.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from part_simulator import measured
from part_simulator.drawn_part import CHAMFER, Bore, DrawnPart, Wall
from part_simulator.measured import Made

Part = Mapping[str, Made]
Measure = Callable[[Part, bool], list[float]]
"""Of a part and whether by least squares: the quantities, in their order, m and rad."""

DATUMS = {"A": "south", "B": "west", "C": "face", "D": "bore", "E": "hole"}
ZONE = "1"
"""mm: no verdict is asked."""


@dataclass(frozen=True)
class Question:
    """A feature of a kind, about elements, seen from datums; `keys` of its row as they are drawn.

    `is_form`: its quantities cannot be less than 0, or are the ends of two-point sizes.
    """

    name: str
    kind: str
    elements: tuple[str, ...]
    datums: str
    keys: Callable[[DrawnPart], Mapping[str, str]]
    measure: Measure
    together: bool = False

    def asks_a_face(self) -> bool:
        """Whether a machine in a plane cannot be asked."""
        return bool({"face", "step", "rib"} & {*self.elements, *(DATUMS[d] for d in self.datums)})

    def row(self, part: DrawnPart, least_squares: bool) -> str:
        """Its TOML."""
        lines = [part.lines[name] for name in self.elements]
        if self.together:
            lines = [f"{lines[0]}-{lines[-1]}"]
        where = f'"{lines[0]}"' if len(lines) == 1 else str(lines).replace("'", '"')
        keys = {"name": f'"{self.name}"', "kind": f'"{self.kind}"', "lines": where}
        if self.datums:
            keys["datums"] = str(list(self.datums)).replace("'", '"')
        if least_squares:
            keys["evaluate"] = '"least-squares"'
        rows = [f"{key} = {value}" for key, value in {**keys, **self.keys(part)}.items()]
        return "\n".join(["[[feature]]", *rows, ""])


def features_file(part: DrawnPart, questions: list[Question], least_squares: bool = False) -> str:
    """The features file that asks them."""
    used = {name for question in questions for name in question.datums}
    head = ["schema = 1", "[units]", 'length = "mm"', 'angle = "deg"', ""]
    datums = [
        f'[[datum]]\nname = "{name}"\nlines = "{part.lines[DATUMS[name]]}"\n'
        for name in sorted(used)
    ]
    return "\n".join([*head, *datums, *(q.row(part, least_squares) for q in questions)])


def _datums(part: Part, names: str) -> list[Made]:
    return [part[DATUMS[name]] for name in names]


def _zone(_: DrawnPart) -> Mapping[str, str]:
    return {"zone": ZONE}


def _size(first: str, second: str) -> Callable[[DrawnPart], Mapping[str, str]]:
    def keys(part: DrawnPart) -> Mapping[str, str]:
        walls = [part.shapes[name] for name in (first, second)]
        assert isinstance(walls[0], Wall)
        assert isinstance(walls[1], Wall)
        width = abs((walls[0].begin - walls[1].begin) @ walls[0].normal)
        return {"nominal": f"{width * 1e3:.9g}", "tolerance": "1"}

    return keys


def _circle(*asked: str) -> Callable[[DrawnPart], Mapping[str, str]]:
    def keys(part: DrawnPart) -> Mapping[str, str]:
        bore = part.shapes["bore"]
        assert isinstance(bore, Bore)
        every = {"diameter": f"{2e3 * bore.radius:.9g}", "tolerance": "1"}
        return {key: every.get(key, ZONE) for key in asked}

    return keys


def _angularity(_: DrawnPart) -> Mapping[str, str]:
    # The chamfer falls from the left of the south wall's direction: what opens is the drawn angle.
    return {"angle": f"{np.degrees(CHAMFER):.14g}", "zone": ZONE, "tolerance": "1"}


def _sizes(first: str, second: str) -> Measure:
    def measure(part: Part, least_squares: bool) -> list[float]:
        if least_squares:
            return [measured.size_of_least_squares(part[first], part[second])]
        return [*measured.sizes(part[first], part[second])]

    return measure


def _bore(datums: str) -> Measure:
    def measure(part: Part, least_squares: bool) -> list[float]:
        own, frame = part["bore"], _datums(part, datums)
        size = [*measured.diameters(own)]
        if least_squares:
            size = [2.0 * measured.circle_of_least_squares(own.points[:, :2])[1]]
        return [
            *size,
            measured.roundness(own, least_squares=least_squares),
            measured.position(own, frame, least_squares=least_squares),
        ]

    return measure


def _one(of: Callable[..., float], name: str, datums: str | None = None) -> Measure:
    def measure(part: Part, least_squares: bool) -> list[float]:
        seen = () if datums is None else (_datums(part, datums),)
        return [of(part[name], *seen, least_squares=least_squares)]

    return measure


def _chamfer(part: Part, least_squares: bool) -> list[float]:
    own, datums = part["chamfer"], _datums(part, "A")
    turned = measured.angle(own, datums, least_squares=least_squares)
    # Driven from right to left it goes down by the angle: a turn to the left opens it further.
    return [
        measured.orientation(own, datums, least_squares=least_squares),
        CHAMFER + turned,
    ]


CONTOUR = ("south", "east", "north", "chamfer", "west")


def _profile(names: tuple[str, ...], datums: str, *, corners: bool = False) -> Measure:
    def measure(part: Part, least_squares: bool) -> list[float]:
        frame = None
        if datums:
            frame = measured.frame_of(_datums(part, datums), least_squares=least_squares)
        made = [part[name] for name in names]
        return [measured.profile(made, frame, corners=corners, least_squares=least_squares)]

    return measure


def _of_one(kind: str, name: str, datums: str, of: Callable[..., float]) -> Question:
    label = f"{kind} of {name}" + (f" to {datums}" if datums else "")
    asked = datums if datums or of is measured.position else None
    return Question(label, kind, (name,), datums, _zone, _one(of, name, asked))


QUESTIONS = (
    Question("width", "size", ("east", "west"), "", _size("east", "west"), _sizes("east", "west")),
    Question(
        "height", "size", ("south", "north"), "", _size("south", "north"), _sizes("south", "north")
    ),
    Question(
        "bore",
        "circle",
        ("bore",),
        "AB",
        _circle("diameter", "tolerance", "roundness", "position"),
        _bore("AB"),
    ),
    Question(
        "bore to a face",
        "circle",
        ("bore",),
        "CAB",
        _circle("diameter", "tolerance", "roundness", "position"),
        _bore("CAB"),
    ),
    _of_one("straightness", "chamfer", "", measured.straightness),
    _of_one("flatness", "face", "", measured.flatness),
    _of_one("flatness", "rib", "", measured.flatness),
    _of_one("parallelism", "north", "A", measured.orientation),
    _of_one("parallelism", "step", "C", measured.orientation),
    _of_one("perpendicularity", "east", "A", measured.orientation),
    _of_one("perpendicularity", "rib", "C", measured.orientation),
    _of_one("perpendicularity", "rib", "CA", measured.orientation),
    Question("chamfer", "angularity", ("chamfer",), "A", _angularity, _chamfer),
    _of_one("position", "hole", "AB", measured.position),
    _of_one("position", "hole", "", measured.position),
    _of_one("position", "east", "DE", measured.position),
    _of_one("position", "east", "CBA", measured.position),
    _of_one("position", "step", "CAB", measured.position),
    Question("contour", "profile", CONTOUR, "", _zone, _profile(CONTOUR, "")),
    Question("contour to AB", "profile", CONTOUR, "AB", _zone, _profile(CONTOUR, "AB")),
    Question("profile of the hole", "profile", ("hole",), "", _zone, _profile(("hole",), "")),
)

CLOSED = Question(
    "closed contour", "profile", CONTOUR, "", _zone, _profile(CONTOUR, "", corners=True), True
)
"""All walls as one element, which shares their lines with no other: asked alone."""


def asked_of(planar: bool) -> list[Question]:
    """Those that a machine can be asked."""
    return [question for question in QUESTIONS if not (planar and question.asks_a_face())]
