"""Structures in CalculiX, a finite-element program that shares nothing with truepose.

A `Deck` gathers any number of structures of two-node trusses (T3D2), solids of twenty nodes
(C3D20R), springs to the ground (SPRING1), rigid bodies and linear equations between displacements;
`run` solves them all in one linear static step and reads the displacements from the table that it
prints, seven digits a number. SI throughout.

G. Dhondt, CalculiX CrunchiX user's manual, version 2.20: *SOLID SECTION, *SPRING, *RIGID BODY,
*EQUATION.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from system_package import missing

Vector = NDArray[np.float64]
Term = tuple[int, int, float]
"""Node, direction (1 to 3; of a body's turn: about that axis) and coefficient."""

CCX = shutil.which("ccx") or "/usr/bin/ccx"
AREA = 1e-4
"""m^2 of every truss: what counts is modulus x area = stiffness x length."""
EVERY_WAY = (1, 2, 3)


def required() -> None:
    """Skip the test where CalculiX is missing; in CI, fail."""
    if not Path(CCX).exists():
        missing("ccx is not installed: apt-get install calculix-ccx")


@dataclass(frozen=True)
class Body:
    """A rigid body: the node that moves with its point of reference, and the one that turns."""

    point: int
    turn: int


class Deck:
    """The input of one run. Everything hangs in `gravity`, m/s^2, that has a mass."""

    def __init__(self, *, gravity: ArrayLike = (0.0, 0.0, 0.0), reference: float = 0.0) -> None:
        """`reference`: the temperature, K, at which nothing has expanded yet."""
        self.gravity = np.asarray(gravity, float)
        self.reference = reference
        self._nodes: list[Vector] = []
        self._elements: list[str] = []
        self._number_of_elements = 0
        self._bodies: list[str] = []
        self._held: list[str] = []
        self._equations: list[str] = []
        self._loads: list[str] = []
        self._temperatures: list[str] = []
        self._heavy: list[int] = []
        self._one: int | None = None

    def node(self, at: ArrayLike) -> int:
        """The number of a new node at `at` (3,), m."""
        self._nodes.append(np.asarray(at, float))
        return len(self._nodes)

    def hold(self, node: int, ways: Iterable[int] = EVERY_WAY) -> None:
        """Keep a node from moving in `ways`."""
        self._held += [f"{node}, {way}, {way}" for way in ways]

    def truss(
        self,
        start: int,
        end: int,
        stiffness: float,
        *,
        mass: float = 0.0,
        expansion: float = 0.0,
    ) -> None:
        """A straight element of `stiffness` N/m and `mass` kg; gravity finds half at each end."""
        number = self._next_element()
        length = float(np.linalg.norm(self._nodes[end - 1] - self._nodes[start - 1]))
        self._elements.append(
            f"*ELEMENT, TYPE=T3D2, ELSET=E{number}\n{number}, {start}, {end}\n"
            f"*MATERIAL, NAME=M{number}\n"
            f"*ELASTIC\n{_number(stiffness * length / AREA)}, 0.\n"
            f"*DENSITY\n{_number(mass / (AREA * length))}\n"
            f"*EXPANSION, ZERO={_number(self.reference)}\n{_number(expansion)}\n"
            f"*SOLID SECTION, ELSET=E{number}, MATERIAL=M{number}\n{_number(AREA)}"
        )
        if mass > 0.0:
            self._heavy.append(number)

    def solid(
        self,
        elements: Sequence[Sequence[int]],
        modulus: float,
        poisson: float,
        *,
        density: float = 0.0,
        expansion: float = 0.0,
    ) -> None:
        """One part of elements of twenty nodes each, in the manual's order for C3D20R.

        `modulus` Pa, `density` kg/m^3, `expansion` 1/K.
        """
        rows = []
        for nodes in elements:
            number = self._next_element()
            numbers = [str(each) for each in (number, *nodes)]
            # The program reads at most sixteen numbers from a line.
            rows.append(", ".join(numbers[:11]) + ",\n" + ", ".join(numbers[11:]))
            if density > 0.0:
                self._heavy.append(number)
        name = len(self._elements) + 1
        self._elements.append(
            f"*ELEMENT, TYPE=C3D20R, ELSET=S{name}\n" + "\n".join(rows) + "\n"
            f"*MATERIAL, NAME=S{name}\n"
            f"*ELASTIC\n{_number(modulus)}, {_number(poisson)}\n"
            f"*DENSITY\n{_number(density)}\n"
            f"*EXPANSION, ZERO={_number(self.reference)}\n{_number(expansion)}\n"
            f"*SOLID SECTION, ELSET=S{name}, MATERIAL=S{name}"
        )

    def spring(self, stiffness: float) -> int:
        """A node whose first displacement is held by a spring alone, N/m (or N m/rad).

        It stands for one way in which something gives; `shifted` says what moves with it.
        """
        node, number = self.node([0.0, 0.0, 0.0]), self._next_element()
        self._elements.append(
            f"*ELEMENT, TYPE=SPRING1, ELSET=E{number}\n{number}, {node}\n"
            f"*SPRING, ELSET=E{number}\n1\n{_number(stiffness)}"
        )
        self.hold(node, (2, 3))
        return node

    def one(self) -> int:
        """The node whose first displacement is 1 m, by which others are given theirs."""
        if self._one is None:
            self._one = self.node([0.0, 0.0, 0.0])
            self.hold(self._one, (2, 3))
        return self._one

    def shifted(self, at: ArrayLike, by: Sequence[tuple[int, ArrayLike]], on: int | None) -> int:
        """A node at `at` that moves as node `on` does, or the ground, and besides.

        `by`: the node of a spring, or of `one`, and the displacement (3,) that a unit of its gives.
        """
        moved = self.node(at)
        for way in EVERY_WAY:
            terms = [(spring, 1, -float(np.asarray(shift, float)[way - 1])) for spring, shift in by]
            if on is not None:
                terms.append((on, way, -1.0))
            if any(factor for _, _, factor in terms):
                self.equation([(moved, way, 1.0), *terms])
            else:
                self.hold(moved, (way,))
        return moved

    def heat(self, node: int, temperature: float) -> None:
        """Temperature of a node, K: between the two of an element it varies linearly."""
        self._temperatures.append(f"{node}, {_number(temperature)}")

    def body(self, nodes: Sequence[int], at: ArrayLike) -> Body:
        """A rigid body through `nodes`, with its point of reference at `at` (3,), m."""
        body = Body(self.node(at), self.node(at))
        name = f"B{len(self._bodies) + 1}"
        members = "\n".join(str(node) for node in nodes)
        self._bodies.append(
            f"*NSET, NSET={name}\n{members}\n"
            f"*RIGID BODY, NSET={name}, REF NODE={body.point}, ROT NODE={body.turn}"
        )
        return body

    def equation(self, terms: Sequence[Term]) -> None:
        """sum of coefficient x displacement = 0; the first term becomes the dependent one."""
        kept = [term for term in terms if term[2] != 0.0]
        lines = [f"*EQUATION\n{len(kept)}"]
        lines += [f"{node}, {way}, {_number(factor)}" for node, way, factor in kept]
        self._equations.append("\n".join(lines))

    def load(self, node: int, vector: ArrayLike) -> None:
        """Force (3,), N, on a node, or moment (3,), N m, on a body's turn."""
        self._loads += [
            f"{node}, {way}, {_number(value)}"
            for way, value in zip(EVERY_WAY, np.asarray(vector, float), strict=True)
            if value != 0.0
        ]

    def _next_element(self) -> int:
        self._number_of_elements += 1
        return self._number_of_elements

    def text(self) -> str:
        """The input file."""
        nodes = [
            f"{number}, " + ", ".join(map(_number, at)) for number, at in enumerate(self._nodes, 1)
        ]
        blocks = ["*NODE, NSET=ALL", *nodes, *self._elements]
        if self._heavy:
            blocks += ["*ELSET, ELSET=HEAVY", *map(str, self._heavy)]
        blocks += [*self._bodies, *self._equations, "*BOUNDARY", *self._held]
        blocks += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", f"ALL, {_number(self.reference)}"]
        blocks += ["*STEP", "*STATIC"]
        if self._loads:
            blocks += ["*CLOAD", *self._loads]
        pull = float(np.linalg.norm(self.gravity))
        if self._heavy and pull > 0.0:
            along = ", ".join(map(_number, self.gravity / pull))
            blocks += ["*DLOAD", f"HEAVY, GRAV, {_number(pull)}, {along}"]
        if self._one is not None:
            blocks += ["*BOUNDARY", f"{self._one}, 1, 1, 1."]
        if self._temperatures:
            blocks += ["*TEMPERATURE", *self._temperatures]
        return "\n".join([*blocks, "*NODE PRINT, NSET=ALL", "U", "*END STEP", ""])

    def run(self, folder: Path) -> Vector:
        """(n_node + 1, 3) displacements, m or rad, by node number; row 0 is empty.

        Raises `AssertionError` with what the program said, where it found no solution.
        """
        (folder / "truss.inp").write_text(self.text(), encoding="ascii")
        said = subprocess.run(
            [CCX, "-i", "truss"], cwd=folder, capture_output=True, text=True, check=False
        )
        complaints = [line for line in said.stdout.splitlines() if "*ERROR" in line]
        assert said.returncode == 0, (said.returncode, complaints, said.stdout[-2000:])
        assert not complaints, complaints
        found = np.full((len(self._nodes) + 1, 3), np.nan)
        for line in (folder / "truss.dat").read_text(encoding="ascii").splitlines():
            words = line.split()
            if len(words) == 4 and words[0].isdigit():
                found[int(words[0])] = [float(word) for word in words[1:]]
        assert np.isfinite(found[1:]).all(), "a node is missing from the table"
        return found


def _number(value: float) -> str:
    """At most the twenty characters that the program reads of a field."""
    return f"{value:.12e}"
