"""Random work for a machine in the real LinuxCNC, from a seed: an operator, and bad sensors."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from random import Random

import numpy as np
from numpy.typing import NDArray
from real_linuxcnc import Step

import truepose as tp
from truepose.controllers._export import options_of
from truepose.controllers.linuxcnc import LinuxCNC

Floats = NDArray[np.float64]

COLD, HOT = 8.0, 36.0
"""Degrees Celsius between which parts are."""
PROGRAMS = 6
WRONG = ("nan", "inf", "-inf", 850.0, -60.0)
"""What a broken sensor reads, degrees Celsius."""
FADED = "truepose.faded"


class Subject:
    """A machine, its export, and what stands where while it works. mm, degrees, N."""

    def __init__(self, file: Path) -> None:
        self.machine = machine = tp.load(file)
        self.files = LinuxCNC.export(machine, options_of(LinuxCNC, machine, ["clamp=1 mm"])).files
        self.axes = "".join(name.upper() for name in machine.commanded)
        self.units = np.array([1e-3 if axis in "XYZ" else np.pi / 180 for axis in self.axes])
        grid = machine.poses() / self.units
        self.low, self.high = grid.min(axis=0), grid.max(axis=0)
        columns = [machine.dof.index(name) for name in machine.commanded]
        self.home = machine.home[columns] / self.units
        hal = next(text for name, text in self.files.items() if name.endswith(".hal"))
        found = re.findall(r"=> (truepose\.\S+-temperature)   # (\S+)", hal)
        self.pins = [pin for pin, _ in found]
        self.parts = [part for _, part in found]
        self.forces = re.findall(r"=> (truepose\.force-[xyz])", hal)

    @property
    def nets(self) -> str:
        """A signal in place of each sensor."""
        return "".join(f"net t{number} {pin}\n" for number, pin in enumerate(self.pins))

    def corrected(self, pose: Floats, celsius: Floats, forces: Mapping[str, float]) -> Floats:
        """(n_joint,) mm that the kernel commands."""
        reference = self.machine.condition.reference_temperature
        kelvin = dict(zip(self.parts, (celsius + 273.15).tolist(), strict=True))
        condition = self.machine.condition.replace(
            temperature={"default": reference, **kelvin},
            force=[forces.get(f"truepose.force-{axis}", 0.0) for axis in "xyz"],
            moment=(0.0, 0.0, 0.0),
        )
        result = tp.compensate(self.machine, pose * self.units, condition)
        return np.asarray(result["joint_corrected"].values[0]) * 1e3

    def words(self, pose: Sequence[float] | Floats) -> str:
        """`X1.0 Y2.0`."""
        return " ".join(f"{axis}{value:.6f}" for axis, value in zip(self.axes, pose, strict=True))


class Plan:
    """The steps of a run, and what is to be compared when it is done."""

    def __init__(self, subject: Subject, seed: int, actions: int) -> None:
        self.subject = subject
        self._random = Random(seed)  # noqa: S311
        self._celsius = np.full(len(subject.pins), 20.0)
        self._forces = dict.fromkeys(subject.forces, 0.0)
        self.expected: dict[str, Floats] = {}
        """Joints of readings, by label: mm."""
        self.refusals: list[str] = []
        self.homings: list[str] = []
        self.kinds: list[str] = []
        self.programs = {f"part{number}.ngc": self._program() for number in range(PROGRAMS)}
        self.steps: list[Step] = []
        self.ends: list[int] = []
        """Steps that are done when an action is."""
        makers = {
            self._move: 6, self._run: 3, self._jog_axis: 4, self._jog_joint: 3, self._heat: 6,
            self._load: 3, self._break_sensor: 4, self._unplug: 2, self._break_rate: 1,
            self._toggle: 3, self._clamp: 1, self._home: 3, self._home_compensated: 2,
            self._power: 1, self._check: 3,
        }  # fmt: skip
        for make in self._random.choices(list(makers), list(makers.values()), k=actions):
            self.kinds.append(make.__name__.removeprefix("_"))
            self.steps += make()
            self.ends.append(len(self.steps))

    def begin(self) -> list[Step]:
        """Homed, and enabled where it stands."""
        temperatures = [self._signal(number, 20.0) for number in range(len(self.subject.pins))]
        return [
            {"do": "home"},
            *temperatures,
            self._go(self.subject.home),
            self._read("begin"),
            _set("enable", 1),
        ]

    def end(self) -> list[Step]:
        """Back at home, faded out."""
        return [*self._good(), *self._faded(), self._go(self.subject.home), self._read("end")]

    # ---- pieces ----

    def _uniform(self, low: float, high: float) -> float:
        return round(self._random.uniform(low, high), 6)

    def _cycles(self, low: int, high: int) -> Step:
        return {"do": "wait", "cycles": self._random.randint(low, high)}

    def _pose(self, room: float = 0.05) -> Floats:
        low, high = self.subject.low, self.subject.high
        shares = np.array([self._random.uniform(room, 1.0 - room) for _ in low])
        return np.asarray(np.round(low + shares * (high - low), 6))

    def _go(self, pose: Floats, feed: float | None = None) -> Step:
        words = self.subject.words(pose)
        return {"do": "mdi", "text": f"G0 {words}" if feed is None else f"G1 F{feed:.0f} {words}"}

    def _signal(self, number: int, value: float | str) -> Step:
        return {"do": "signal", "name": f"t{number}", "value": value}

    def _part(self) -> int:
        return self._random.randrange(len(self.subject.pins))

    def _read(self, label: str) -> Step:
        joints = range(len(self.subject.machine.joints))
        pins = [f"joint.{n}.{name}" for n in joints for name in ("motor-offset", "motor-pos-cmd")]
        pins += [f"following{n}.{end}" for n in joints for end in ("min", "max")]
        names = ("failures", "fault-code", "forward-calls", "inverse-calls")
        pins += [f"truepose.{name}" for name in names]
        return {"do": "read", "label": label, "pins": pins}

    def _good(self) -> list[Step]:
        """Whatever was set, as it was exported and enabled."""
        return [_set("enable", 1), _set("fade", 0), _set("clamp", 1.0), _set("rate-limit", 1.0)]

    def _faded(self) -> list[Step]:
        return [_set("fade", 1), {"do": "until_pin", "pin": FADED, "value": True}]

    def _program(self) -> str:
        low, high = self.subject.low, self.subject.high
        size = round(0.2 * float((high - low)[:2].min()), 3)
        lines = ["G21 G90 G17 G64 P0.005", "F4800"]
        for _ in range(3):
            pose = self._pose(0.3)
            start, end = pose.copy(), pose.copy()
            start[0], end[0] = pose[0] - size, pose[0] + size
            lines += [
                f"G1 {self.subject.words(np.round(start, 6))}",
                f"G{self._random.choice((2, 3))} {self.subject.words(np.round(end, 6))} "
                f"I{size:.6f} J0",
                f"G0 {self.subject.words(self._pose())}",
            ]
        return "\n".join([*lines, "M2\n"])

    # ---- what is done ----

    def _move(self) -> list[Step]:
        feed = self._random.choice((None, self._uniform(2000.0, 9000.0)))
        return [self._go(self._pose(), feed)]

    def _run(self) -> list[Step]:
        """A program, while a sensor fails and comes back, and another part warms."""
        broken, other = self._part(), self._part()
        during: list[Step] = [
            {"after": 100, **self._signal(broken, self._random.choice(WRONG))},
            {"after": 300, **self._temperature(other)},
            {"after": 500, **self._signal(broken, float(self._celsius[broken]))},
        ]
        file = f"part{self._random.randrange(PROGRAMS)}.ngc"
        return [{"do": "program", "file": file, "during": during}]

    def _jog_axis(self) -> list[Step]:
        axis = self._random.choice(self.subject.axes)
        fastest = 60.0 if axis in "XYZ" else 10.0
        velocity = self._random.choice((-1.0, 1.0)) * self._uniform(0.05 * fastest, fastest)
        cycles = self._random.randint(50, 600)
        return [{"do": "jog_axis", "axis": axis, "velocity": velocity, "cycles": cycles}]

    def _jog_joint(self) -> list[Step]:
        joint = self._random.randrange(len(self.subject.machine.joints))
        jog: Step = {
            "do": "jog_joint",
            "joint": joint,
            "velocity": self._uniform(1.0, 20.0),
            "distance": self._uniform(-0.5, 0.5),
        }
        return [self._go(self._pose(0.3)), jog]

    def _temperature(self, number: int) -> Step:
        self._celsius[number] = self._uniform(COLD, HOT)
        return self._signal(number, float(self._celsius[number]))

    def _heat(self) -> list[Step]:
        count = self._random.randint(1, len(self.subject.pins))
        parts = self._random.sample(range(len(self.subject.pins)), count)
        return [*(self._temperature(number) for number in parts), self._cycles(1, 400)]

    def _load(self) -> list[Step]:
        for pin in self._forces:
            self._forces[pin] = self._uniform(-150.0, 150.0)
        steps: list[Step] = [
            {"do": "set", "name": pin, "value": force} for pin, force in self._forces.items()
        ]
        return [*steps, self._cycles(1, 200)]

    def _break_sensor(self) -> list[Step]:
        number = self._part()
        return [
            self._signal(number, self._random.choice(WRONG)),
            self._cycles(1, 200),
            self._go(self._pose()),
            self._signal(number, float(self._celsius[number])),
        ]

    def _unplug(self) -> list[Step]:
        number = self._part()
        pin = self.subject.pins[number]
        return [
            {"do": "unlink", "pin": pin},
            self._go(self._pose()),
            # A signal that has no pin takes the value of the first that is linked.
            {"do": "link", "signal": f"t{number}", "pin": pin},
            self._temperature(number),
        ]

    def _break_rate(self) -> list[Step]:
        wrong = self._random.choice(("nan", -1.0, "inf", 0.0))
        return [_set("rate-limit", wrong), *self._heat(), *self._move(), _set("rate-limit", 1.0)]

    def _toggle(self) -> list[Step]:
        """Out and in again, by one way or the other, often before it is out."""
        name, out = self._random.choice((("enable", 0), ("fade", 1)))
        return [_set(name, out), self._cycles(1, 300), *self._move(), _set(name, 1 - out)]

    def _clamp(self) -> list[Step]:
        clamp = self._random.choice((0.0, 0.02, -1.0, "nan"))
        return [_set("clamp", clamp), self._cycles(1, 300), *self._move(), _set("clamp", 1.0)]

    def _home(self) -> list[Step]:
        label = f"homed {len(self.homings)}"
        self.homings.append(label)
        return [
            *self._faded(),
            self._go(self.subject.home),
            {"do": "rehome", "label": f"{label} denied"},
            {"do": "world_mode"},
            self._go(self.subject.home),
            self._read(label),
            _set("fade", 0),
        ]

    def _home_compensated(self) -> list[Step]:
        label = f"refused {len(self.refusals)}"
        self.refusals.append(label)
        self._celsius[0] = HOT
        return [
            *self._good(),
            self._signal(0, HOT),
            self._go(self.subject.home),
            {"do": "settle"},
            {"do": "rehome", "label": label},
            {"do": "world_mode"},
        ]

    def _power(self) -> list[Step]:
        return [{"do": "power", "cycles": self._random.randint(20, 400)}]

    def _check(self) -> list[Step]:
        """At rest the joints are those that the kernel commands."""
        pose, label = self._pose(), f"check {len(self.expected)}"
        self.expected[label] = self.subject.corrected(pose, self._celsius, self._forces)
        return [*self._good(), self._go(pose), {"do": "settle"}, self._read(label)]


def _set(name: str, value: float | str) -> Step:
    return {"do": "set", "name": f"truepose.{name}", "value": value}


def counted(plan: Plan, steps: int) -> Iterator[str]:
    """The kinds of the actions that were done when so many steps were."""
    for end, kind in zip(plan.ends, plan.kinds, strict=True):
        if end <= steps:
            yield kind
