"""Random programs, seeded: valid ones, and soups of words of which most are refused."""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random

AXES = "XYZABCUVW"
PLANES = {"G17": (0, 1), "G18": (2, 0), "G19": (1, 2)}
CENTRE = "IJK"
SYSTEMS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")

# No tool is asked for (T, M6, M61): LinuxCNC's Python module crashes where no LinuxCNC runs.
COMMENTS = ("(c)", "( G0 X1 ; Z)", "(MSG, now)", "(DEBUG, #5220)", "()", "(é µ)", "(a\tb/%#[)")
SIDE_WORDS = (
    ("M3", "S1000"),
    ("M4", "S500.5"),
    ("M5",),
    ("M7",),
    ("M8",),
    ("M9",),
    ("M48",),
    ("M49",),
    ("S250",),
    ("M0",),
    ("M1",),
    ("M60",),
    ("G40",),
    ("G49",),
    ("G61",),
    ("G61.1",),
    ("G64",),
    ("G98",),
    ("G99",),
    ("G97",),
    ("M53",),
)
LONELY = (
    "G4 P0.01",
    "G64 P0.05",
    "G64 P.02 Q.01",
    "M62 P1",
    "M63 P2",
    "M64 P0",
    "M65 P3",
    "M66 P0 L0",
    "M67 E1 Q.5",
    "M68 E0 Q2",
    "M50 P1",
    "M51 P0",
    "G96 D2000 S200",
    "G97 S300",
    "M19 R90",
    "(only a comment)",
    "; the rest ( of a line",
    "",
    "  \t",
    "N5",
    "(MSG, one) (two)",
)


@dataclass
class _State:
    """What has to be known to write a valid block; positions in machine coordinates, mm."""

    offsets: dict[str, list[float]]
    at: list[float]
    unit: float = 1.0
    incremental: bool = False
    absolute_centres: bool = False
    plane: str = "G17"
    system: str = "G54"
    motion: str | None = None
    mode: str = "G94"
    feed: bool = False

    def scale(self, axis: int) -> float:
        return 1.0 if 3 <= axis < 6 else self.unit

    def offset(self, axis: int) -> float:
        return self.offsets.get(self.system, [0.0] * 9)[axis]


class Programs:
    """Valid programs of a seed, under the same offsets: system -> nine numbers, mm, degrees."""

    def __init__(self, seed: int, offsets: dict[str, list[float]]) -> None:
        self.random = Random(seed)  # noqa: S311
        self.offsets = offsets

    def program(self) -> str:
        """One program of up to 25 lines."""
        r = self.random
        state = _State(self.offsets, list(self.offsets.get("G54", [0.0] * 9)))
        lines = []
        percent = r.random() < 0.2
        if percent:
            lines.append(r.choice(["%", "% "]))
        state.unit = r.choice([1.0, 25.4])
        others = [word for word in self._modal(state, 0.5) if word not in ("G20", "G21")]
        lines.append(self._shape(["G21" if state.unit == 1.0 else "G20", *others]))
        for _ in range(r.randint(3, 22)):
            lines.append(self._line(state))
        lines.append(
            "%" if percent and r.random() < 0.5 else r.choice(["M2", "M30", "m02", "M 3 0"])
        )
        if r.random() < 0.2:
            lines.append("what stands here ( belongs to nobody")
        end = r.choice(["\n", "\n", "\r\n"])
        return end.join(lines) + r.choice(["", end])

    def _line(self, state: _State) -> str:
        r = self.random
        kind = r.random()
        if kind < 0.12:
            return r.choice(LONELY)
        if kind < 0.2:
            return self._shape(self._modal(state, 1.0))
        if kind < 0.24:
            return self._reference(state)
        words = self._modal(state, 0.08)
        if kind < 0.55 or state.mode == "G95":
            words += self._straight(state, r.choice(["G0", "G1"]))
        else:
            words += self._arc(state, r.choice(["G2", "G3"]))
        if r.random() < 0.15:
            words += self._side(words)
        return self._shape(words)

    def _side(self, words: list[str]) -> list[str]:
        """Words that move nothing and fit the others, the M codes of one group at most."""
        for _ in range(4):
            side = self.random.choice(SIDE_WORDS)
            if side[0][0] == "G" and any(word[:2] == side[0][:2] for word in words):
                continue
            if side[0] in ("G64", "M53") and any(word[0] == "P" for word in words):
                continue
            return list(side)
        return []

    def _modal(self, state: _State, share: float) -> list[str]:
        r = self.random
        words: list[str] = []
        if r.random() > share:
            return words
        if r.random() < 0.3:
            state.unit = r.choice([1.0, 25.4])
            words.append("G21" if state.unit == 1.0 else "G20")
        if r.random() < 0.4:
            state.incremental = r.random() < 0.5
            words.append("G91" if state.incremental else "G90")
        if r.random() < 0.3:
            state.absolute_centres = r.random() < 0.5
            words.append("G90.1" if state.absolute_centres else "G91.1")
        if r.random() < 0.4:
            state.plane = r.choice(list(PLANES))
            words.append(state.plane)
        if r.random() < 0.3:
            state.system = r.choice(SYSTEMS)
            words.append(state.system)
        if r.random() < 0.2:
            state.mode = r.choice(["G93", "G94"])
            words.append(state.mode)
            state.feed = False
        if r.random() < 0.05:
            state.motion = None
            words.append("G80")
        return words

    def _feed(self, state: _State) -> list[str]:
        r = self.random
        if state.mode == "G93" or not state.feed or r.random() < 0.1:
            state.feed = state.mode != "G93"
            return ["F" + self._number(r.uniform(0.5, 2000.0), 2)]
        return []

    def _motion(self, state: _State, code: str) -> list[str]:
        """The motion's word, unless it holds already."""
        r = self.random
        if state.motion == code and r.random() < 0.6:
            return []
        state.motion = code
        plain = {"G0": ["G0", "G00", "G0.0"], "G1": ["G1", "G01"], "G2": ["G2", "G02"]}
        return [r.choice(plain.get(code, ["G3", "G03", "G 3"]))]

    def _word(self, state: _State, axis: int, target: float, machine: bool = False) -> str:
        """The word that takes the axis to about the target; the state goes where it leads."""
        scale = state.scale(axis)
        offset = 0.0 if machine else state.offset(axis)
        origin = state.at[axis] if state.incremental and not machine else offset
        text = self._number((target - origin) / scale, 4 if scale == 1.0 else 5)
        state.at[axis] = _value(text) * scale + origin
        return AXES[axis] + text

    def _straight(self, state: _State, code: str) -> list[str]:
        r = self.random
        machine = not state.incremental and r.random() < 0.06
        words = self._motion(state, code)
        if machine:
            words.append("G53")
        axes = r.sample(range(9), r.choice([1, 1, 2, 2, 3, 3, 5, 9]))
        words += [self._word(state, axis, r.uniform(-150, 150), machine) for axis in axes]
        if code == "G1":
            words += self._feed(state)
        return words

    def _arc(self, state: _State, code: str) -> list[str]:
        r = self.random
        words = self._motion(state, code)
        plane = PLANES[state.plane]
        u, v = (state.at[axis] for axis in plane)
        digits = 4 if state.unit == 1.0 else 5
        others = [axis for axis in range(9) if axis not in plane]
        along = r.sample(others, r.choice([0, 0, 0, 1, 1, 3]))
        if r.random() < 0.35:  # by its radius
            half = r.uniform(0.5, 60.0)
            angle = r.uniform(0, math.tau)
            ends = (u + 2 * half * math.cos(angle), v + 2 * half * math.sin(angle))
            words += [self._word(state, axis, end) for axis, end in zip(plane, ends, strict=True)]
            new = [state.at[axis] for axis in plane]
            half = math.hypot(new[0] - u, new[1] - v) / 2
            radius = half * r.choice([1.0, r.uniform(1.001, 4.0)])
            # Rounded up: a radius must reach.
            radius = math.ceil(radius / state.unit * 10**digits) / 10**digits
            words.append("R" + self._number(r.choice([radius, -radius]), digits))
        else:
            radius, angle = r.uniform(0.5, 60.0), r.uniform(0, math.tau)
            centre = (u + radius * math.cos(angle), v + radius * math.sin(angle))
            texts, places = [], []
            for axis, start, where in zip(plane, (u, v), centre, strict=True):
                origin = state.offset(axis) if state.absolute_centres else start
                text = self._number((where - origin) / state.unit, digits)
                texts.append(CENTRE[axis] + text)
                places.append(_value(text) * state.unit + origin)
            words += texts
            radius = math.hypot(places[0] - u, places[1] - v)
            if r.random() > 0.2:
                angle = r.uniform(0, math.tau)
                ends = (places[0] + radius * math.cos(angle), places[1] + radius * math.sin(angle))
                words += [
                    self._word(state, axis, end) for axis, end in zip(plane, ends, strict=True)
                ]
            # else a full circle
        words += [self._word(state, axis, r.uniform(-80, 80)) for axis in along]
        if r.random() < 0.15:
            words.append(f"P{r.randint(1, 5)}")
        return words + self._feed(state)

    def _reference(self, state: _State) -> str:
        r = self.random
        words = [r.choice(["G28", "G30"])]
        axes = r.sample(range(9), r.choice([0, 1, 2, 3, 9]))
        words += [self._word(state, axis, r.uniform(-100, 100)) for axis in axes]
        for axis in axes or range(9):
            state.at[axis] = 0.0
        return self._shape(words)

    def _number(self, value: float, digits: int) -> str:
        """The number in one of the forms in which numbers are written."""
        r = self.random
        text = f"{value:.{digits}f}"
        form = r.random()
        if form < 0.3:
            text = text.rstrip("0")
        elif form < 0.35 and value > 0:
            text = "+" + text
        if form < 0.1 and text.lstrip("-").startswith("0.") and text[-1] != ".":
            text = text.replace("0.", ".", 1)
        if form > 0.95:
            place = r.randint(0, len(text))
            text = text[:place] + r.choice([" ", "\t"]) + text[place:]
        return text

    def _shape(self, words: list[str]) -> str:
        """The words in one of the ways in which lines are written."""
        r = self.random
        words = list(words)
        r.shuffle(words)
        gap = r.choice([" ", " ", "", "  ", "\t"])
        for _ in range(r.choice([0, 0, 0, 1, 2])):
            words.insert(r.randint(0, len(words)), r.choice(COMMENTS))
        line = gap.join(words)
        if r.random() < 0.3:
            line = line.lower() if r.random() < 0.7 else line.upper()
        if r.random() < 0.3:
            line = f"N{r.randint(0, 99999)}{r.choice(['', ' ', '.5 '])}" + line
        if r.random() < 0.1:
            line += r.choice([" ; G0 X99 (", ";", " "])
        if r.random() < 0.05:
            line = r.choice(["/", " / ", " ", "\t"]) + line
        return line


def _value(text: str) -> float:
    return float(text.replace(" ", "").replace("\t", ""))


_WORDS = r"""
G0 G1 G2 G3 G17 G18 G19 G20 G21 G28 G30 G28.1 G40 G49 G53 G54 G55 G59.3 G61 G64 G80 G90 G91
G90.1 G91.1 G93 G94 G96 G97 G98 G4 G5 G7 G8 G10 G33 G38.2 G41 G43 G52 G73 G76 G81 G92 G92.1
G17.1 G21.5 G-1 G1.05 M0 M1 M2 M3 M5 M7 M9 M30 M48 M50 M62 M66 M68 M70 M99 M31 M3.5 T-1 T1.5
S100 S-1 F100 F0 F-5 F.5 F100 F50 N5 H1 D1 L0 L2 E0 Q1 Q-1 P1 P2 P0 P1.5 P-1 I5 J5 K5 I-5 J0 K0
I0 R5 R-5 R10 R0 R.0001 X1 X10 X-10 X0 Y1 Y10 Y-10 Y0 Z1 Z5 Z0 A1 A90 B-5 C3 U1 V2 W3 X Y Z- X.
X+ X--1 X1.2.3 X1e3 #1=2 X#1 X[1] Xsin[1] O1 ( (a) (a(b) ) ; % / * $0 @5 ^45 ! " , : = x10 y10
g1 g2 i5 j5 X-.5 Y+.5 Z.25 X010.0 N01 (msg,a)
"""
_SOUP = [*_WORDS.split(), "G\t1", "X1\t2"]


def soup(random: Random) -> str:
    """A program of words drawn at random, most often refused by everybody."""
    lines = [random.choice(["G21", "G20", "G21 G0 X0 F10", "G21 G90 G1 F100 X0", "G21 G2 I5 F10"])]
    for _ in range(random.randint(1, 5)):
        count = random.choice([1, 2, 2, 3, 3, 4, 5])
        if random.random() < 0.5:
            head = random.choice(["G0", "G1 F10", "G2", "G3 F20", "G1", "G93 G1", "G91 G2", "G28"])
            lines.append(" ".join([head, *random.choices(_SOUP, k=count)]))
        else:
            lines.append(random.choice(["", " "]).join(random.choices(_SOUP, k=count)))
    return "\n".join([*lines, "M2", ""])


def mutated(random: Random, text: str) -> str:
    """The program with one to three small things changed, still accepted more often than not."""
    for _ in range(random.randint(1, 3)):
        place = random.randrange(len(text))
        kind = random.random()
        if kind < 0.25:
            text = text[:place] + text[place + 1 :]
        elif kind < 0.5:
            text = text[:place] + random.choice("0123456789.-+ GMXYZIJKRPFABN()/;%") + text[place:]
        elif kind < 0.65:
            text = text[:place] + random.choice("0123456789.-GXYIJR") + text[place + 1 :]
        elif kind < 0.8:
            text = text[:place] + " " + random.choice(_SOUP) + " " + text[place:]
        else:
            lines = text.split("\n")
            one, other = random.randrange(len(lines)), random.randrange(len(lines))
            if kind < 0.9:
                lines[one], lines[other] = lines[other], lines[one]
            else:
                del lines[one]
            text = "\n".join(lines)
        text = text or "\n"
    return text
