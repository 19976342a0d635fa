"""The exported module in the real LinuxCNC: homed, driven by MDI and a program, heated, and fooled.

One run a machine, of some 15 s. Its drives are `limit3` components, which cannot follow a jump, and
the following-error limit is 0.05 mm. Joints are compared with the kernel's, in mm.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from real_linuxcnc import Run, Step, required, run

import truepose as tp
from command_line import MACHINES
from sweeps import thinned
from truepose.controllers._export import options_of
from truepose.controllers.linuxcnc import LinuxCNC

Floats = NDArray[np.float64]

JOINT = 1e-9
"""mm: a joint against the kernel."""
WORLD = 1e-8
"""mm, degrees: LinuxCNC's pose against the one asked for."""
RATE = 1e-3
"""mm of compensation in a cycle of 1 ms, which the export states."""
PRINTED = 1e-6
"""mm: what halsampler prints."""
JUMP = 6e-3
"""mm a cycle, per cycle: three times what the planned 2 m/s^2 of the tool make of a joint at most.

A jump of 25 K that nobody limits makes at least five times that, since LinuxCNC spreads it over
four cycles.
"""
HEAT = 25.0
CLAMP = 0.05
PINS = [f"truepose.{name}" for name in ("fault", "fault-code", "clamped", "failures")]


@dataclass(frozen=True)
class Case:
    """A machine, which temperature pins are heated together to move which one joint, its load."""

    stem: str
    heated: tuple[int, ...]
    joint: int
    load: float = 1.0
    rods: str | None = None

    @cached_property
    def text(self) -> str:
        """The machine file; of the delta, with rods that grow: carbon fibre moves nothing."""
        text = (MACHINES / f"{self.stem}.toml").read_text()
        return text if self.rods is None else text.replace("carbon fibre", self.rods)


CASES = [
    Case("planar_two_slider", (0,), 0),
    Case("hexapod", (2,), 2),
    # Both rods of an arm: one alone tilts the platform, which takes all three carriages to mend.
    Case("linear_delta", (2, 3), 1, 0.1, "aluminium"),
]


class Study:
    """One machine: the plan of its run, and what the kernel says should come of it."""

    def __init__(self, case: Case, folder: Path) -> None:
        file = folder / f"{case.stem}.toml"
        file.write_text(case.text)
        self.case = case
        self.machine = machine = tp.load(file)
        # Room for one strut much warmer than the rest, of which the file's condition knows nothing.
        options = options_of(LinuxCNC, machine, ["clamp=1 mm"])
        self.files = LinuxCNC.export(machine, options).files
        self.axes = "".join(name.upper() for name in machine.commanded)
        self.units = np.array([1e-3 if a in "XYZ" else np.pi / 180 for a in self.axes])
        self.n_part = len(machine.struts)
        grid = machine.poses() / self.units
        self.low, self.high = grid.min(axis=0), grid.max(axis=0)
        self.home = machine.home[[machine.dof.index(name) for name in machine.commanded]]
        rng = np.random.default_rng(5)
        shares = rng.uniform(0.1, 0.9, (7, len(self.axes)))
        self.poses = np.round(self.low + shares * (self.high - self.low), 6)
        self.graded = np.round(rng.uniform(15.0, 32.0, self.n_part), 3)
        self.graded[list(case.heated)] = self.graded[case.heated[0]]
        self.signals = {
            number: f"t{case.heated[0] if number in case.heated else number}"
            for number in range(self.n_part)
        }
        """Of each temperature pin: parts that are heated together share a sensor."""
        self.force = {"x": 180.0, "y": -120.0, "z": 90.0}
        self.force = {a: f * case.load for a, f in self.force.items() if a in machine.components}
        self.end = self._programmed()[-1]

    @property
    def cold(self) -> Floats:
        """(n,) degrees Celsius of the reference."""
        return np.full(self.n_part, self.machine.condition.reference_temperature - 273.15)

    @property
    def hot(self) -> Floats:
        """(n,) with the heated struts at HEAT above."""
        hot = self.cold
        hot[list(self.case.heated)] += HEAT
        return hot

    def nominal(self, pose: ArrayLike) -> Floats:
        """(n_joint,) mm, of a pose in mm and degrees."""
        return np.asarray(self.machine.inverse(np.asarray(pose) * self.units)) * 1e3

    def corrected(self, pose: ArrayLike, celsius: Floats, *, loaded: bool = False) -> Floats:
        """(n_joint,) mm, with what is known in that state."""
        machine = self.machine
        kelvin = {s.part: t + 273.15 for s, t in zip(machine.struts, celsius, strict=True)}
        reference = machine.condition.reference_temperature
        force = [self.force.get(axis, 0.0) if loaded else 0.0 for axis in "xyz"]
        condition = machine.condition.replace(
            temperature={"default": reference, **kelvin}, force=force, moment=(0.0, 0.0, 0.0)
        )
        result = tp.compensate(machine, np.asarray(pose) * self.units, condition)
        return np.asarray(result["joint_corrected"].values[0]) * 1e3

    def words(self, pose: Sequence[float]) -> str:
        """`X1.0 Y2.0`."""
        return " ".join(f"{axis}{value:.6f}" for axis, value in zip(self.axes, pose, strict=True))

    def _programmed(self) -> Floats:
        """Corners of the program: a line, half a circle and a line, in the middle of the grid."""
        centre = np.round(0.5 * (self.low + self.high), 6)
        size = round(float(0.2 * (self.high - self.low)[:2].min()), 3)
        corners = np.repeat(centre[np.newaxis], 4, axis=0)
        corners[:, :2] += np.array([[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, -0.7]]) * size
        if "A" in self.axes:
            corners[2, 3:5] += [3.0, -2.0]
        return np.round(corners, 6)

    def program(self) -> str:
        """G0, G1 and G3, of some 4 s."""
        first, second, third, last = self._programmed()
        radius = second[0] - 0.5 * (first[0] + second[0])
        return "\n".join(
            [
                "G21 G90 G17 G64 P0.005",
                f"G0 {self.words(first)}",
                "F3600",
                f"G1 {self.words(second)}",
                f"G3 {self.words(third)} I{-radius:.6f} J0",
                f"G1 {self.words(last)}",
                "M2\n",
            ]
        )

    def steps(self) -> list[Step]:
        """The plan."""
        bad = self.case.heated[0]
        pin, signal = f"truepose.strut-{bad}-temperature", self.signals[bad]
        good = float(self.graded[bad])

        def read(label: str, *, moving: bool = False) -> Step:
            added = [f"truepose.compensation-{n}" for n in range(len(self.machine.joints))]
            return {"do": "read", "label": label, "pins": PINS + added, "moving": moving}

        def temperatures(celsius: Floats) -> list[Step]:
            return [
                {"do": "signal", "name": signal, "value": celsius[int(signal[1:])]}
                for signal in dict.fromkeys(self.signals.values())
            ]

        def sampled(name: str, *steps: Step) -> list[Step]:
            begin: Step = {"do": "sample", "file": f"{name}.trace"}
            return [begin, *steps, {"do": "stop_sampling"}, read(name)]

        def mdi(pose: Sequence[float]) -> Step:
            return {"do": "mdi", "text": f"G0 {self.words(pose)}"}

        def enable(value: int) -> Step:
            return {"do": "set", "name": "truepose.enable", "value": value}

        settle: Step = {"do": "settle"}
        plan: list[Step] = [{"do": "home"}, read("home")]
        for number, pose in enumerate(self.poses[:3]):
            plan += [mdi(pose), read(f"cold {number}")]
        plan += [enable(1), settle, read("enabled")]
        plan += sampled("heat", *temperatures(self.hot), settle)
        plan += temperatures(self.graded)
        plan += [
            {"do": "set", "name": f"truepose.force-{axis}", "value": force}
            for axis, force in self.force.items()
        ]
        plan += [settle]
        for number, pose in enumerate(self.poses[3:6]):
            plan += [mdi(pose), read(f"hot {number}")]
        during: list[Step] = [
            {"after": 600, "do": "signal", "name": signal, "value": "nan"},
            {"after": 800, **read("nan in program", moving=True)},
            {"after": 900, "do": "signal", "name": signal, "value": good},
            {"after": 1100, **read("good in program", moving=True)},
            {"after": 1200, "do": "signal", "name": signal, "value": 850.0},
            {"after": 1400, **read("850 in program", moving=True)},
            {"after": 1500, "do": "signal", "name": signal, "value": good},
            {"after": 1800, "do": "unlink", "pin": pin},
            {"after": 2000, **read("unlinked in program", moving=True)},
        ]
        program: Step = {"do": "program", "file": "part.ngc", "during": during}
        plan += sampled("program", program)
        plan += [{"do": "link", "signal": signal, "pin": pin}, settle, read("linked")]
        for value in ("nan", 850.0):
            plan += [
                {"do": "signal", "name": signal, "value": value},
                {"do": "wait", "cycles": 400},
            ]
            plan += [read(f"{value} at rest")]
            plan += [{"do": "signal", "name": signal, "value": good}, settle]
        plan += sampled("disable", enable(0), settle)
        plan += sampled("enable", enable(1), settle)
        plan += [{"do": "set", "name": "truepose.clamp", "value": CLAMP}, settle, read("clamped")]
        plan += [{"do": "set", "name": "truepose.clamp", "value": 1.0}, settle, read("unclamped")]
        plan += [{"do": "joint_mode"}, *temperatures(self.hot), settle, read("in joint mode")]
        plan += [{"do": "world_mode"}, read("in world mode again")]
        # Last, since it ends with the machine off: the same heat without the limit.
        plan += [*temperatures(self.cold), settle, read("before the jump")]
        plan += [{"do": "set", "name": "truepose.rate-limit", "value": 1e9}]
        plan += [*temperatures(self.hot), {"do": "until_off", "cycles": 500}, read("jump")]
        return plan

    def nets(self) -> str:
        """Connections as the user makes them, with signals in place of sensors."""
        struts = {
            f"truepose.strut-{number}-temperature": signal
            for number, signal in self.signals.items()
        }
        hal = next(text for name, text in self.files.items() if name.endswith(".hal"))
        # Other parts stay at the reference: each has a signal that nothing writes.
        listed = re.findall(r"=> (truepose\.\S+-temperature)", hal)
        others = {pin: f"other{at}" for at, pin in enumerate(listed) if pin not in struts}
        return "".join(f"net {signal} {pin}\n" for pin, signal in (struts | others).items())


@pytest.fixture(scope="module", params=thinned(CASES), ids=lambda case: case.stem)
def done(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> object:
    """The study and its run; three seconds of it are waiting for things to settle."""
    required()
    study = Study(request.param, tmp_path_factory.mktemp("machine"))
    folder = tmp_path_factory.mktemp("run")
    return study, run(
        folder,
        study.files,
        study.steps(),
        axes=study.axes,
        joints=len(study.machine.joints),
        programs={"part.ngc": study.program()},
        hal=study.nets(),
    )


Done = tuple[Study, Run]


def same(reading: dict[str, list[float]], joints: Floats) -> None:
    assert np.abs(np.array(reading["joints"]) - joints).max() < JOINT
    assert np.abs(np.array(reading["feedback"]) - joints).max() < JOINT


def steady(run: Run, before: str, after: str) -> None:
    """Nothing tripped, and the machine is where it was."""
    same(run[after], np.array(run[before]["joints"]))
    assert run[after]["on"]


def test_home(done: Done) -> None:
    study, run = done
    same(run["home"], study.nominal(study.home / study.units))
    assert np.abs(run["home"]["world"] - study.home / study.units).max() < WORLD
    assert run["home"]["kinematics"] == 4  # both ways


def test_nominal_kinematics(done: Done) -> None:
    study, run = done
    for number, pose in enumerate(study.poses[:3]):
        reading = run[f"cold {number}"]
        same(reading, study.nominal(pose))
        assert np.abs(reading["world"] - pose).max() < WORLD
        assert not reading["pins"]["truepose.fault"]


def test_nothing_fails_once_homed(done: Done) -> None:
    """Before that LinuxCNC asks for the pose of joints that are all zero."""
    _, run = done
    assert run["home"]["pins"]["truepose.failures"] == run["jump"]["pins"]["truepose.failures"]


def test_a_heated_strut_moves_its_joint_only(done: Done) -> None:
    study, run = done
    pose = study.poses[2]
    same(run["enabled"], study.corrected(pose, study.cold))
    same(run["heat"], study.corrected(pose, study.hot))
    moved = np.array(run["heat"]["joints"]) - run["enabled"]["joints"]
    assert abs(moved[study.case.joint]) > 0.1
    assert np.abs(np.delete(moved, study.case.joint)).max() < JOINT
    assert np.abs(run["heat"]["world"] - pose).max() < WORLD


@pytest.mark.parametrize("trace", ["heat", "disable", "enable"])
def test_compensation_moves_at_the_rate_limit(done: Done, trace: str) -> None:
    study, run = done
    joints = run.traces[trace][:, : len(study.machine.joints)]
    steps = np.abs(np.diff(joints, axis=0)).max()
    # LinuxCNC's interpolation between cycles overshoots no ramp; at the limit it is one.
    assert 0.9 * RATE < steps < RATE + 2.0 * PRINTED
    assert run[trace]["on"]
    assert not run[trace]["errors"]


def test_without_the_limit_the_drives_do_not_follow(done: Done) -> None:
    study, run = done
    assert run["before the jump"]["on"]
    assert not run["before the jump"]["errors"]
    assert not run["jump"]["on"]
    assert f"joint {study.case.joint} following error" in " ".join(run["jump"]["errors"])


def test_hot_and_loaded(done: Done) -> None:
    study, run = done
    for number, pose in enumerate(study.poses[3:6]):
        reading = run[f"hot {number}"]
        same(reading, study.corrected(pose, study.graded, loaded=True))
        assert np.abs(reading["world"] - pose).max() < WORLD


def test_a_program_with_failing_sensors(done: Done) -> None:
    study, run = done
    for label, fault in (
        ("nan in program", 1),
        ("good in program", 0),
        ("850 in program", 1),
        ("unlinked in program", 1),
    ):
        assert run[label]["pins"]["truepose.fault"] == fault, label
        assert run[label]["pins"]["truepose.fault-code"] == fault, label
    assert run["still running"]
    # The pin is still unlinked, and its last good value still counts.
    same(run["program"], study.corrected(study.end, study.graded, loaded=True))
    assert np.abs(run["program"]["world"] - study.end).max() < WORLD
    steady(run, "program", "linked")
    assert not run["linked"]["pins"]["truepose.fault"]


def test_no_jump_in_a_program_with_failing_sensors(done: Done) -> None:
    study, run = done
    trace = run.traces["program"]
    joints = trace[:, : len(study.machine.joints)]
    assert len(joints) > 2000
    assert np.ptp(joints, axis=0).min() > 1.0
    assert np.count_nonzero(np.diff(trace[:, -1]) > 0.0) == 3  # the fault came up three times
    assert np.abs(np.diff(joints, 2, axis=0)).max() < JUMP
    assert not run["program"]["errors"]


@pytest.mark.parametrize("value", ["nan", "850.0"])
def test_a_failing_sensor_at_rest_holds(done: Done, value: str) -> None:
    _, run = done
    steady(run, "linked", f"{value} at rest")
    assert run[f"{value} at rest"]["pins"]["truepose.fault"]


def test_disabling_and_enabling(done: Done) -> None:
    study, run = done
    same(run["disable"], study.nominal(study.end))
    same(run["enable"], study.corrected(study.end, study.graded, loaded=True))


def test_heat_in_joint_mode_moves_the_pose_and_no_joint(done: Done) -> None:
    study, run = done
    steady(run, "unclamped", "in joint mode")
    steady(run, "unclamped", "in world mode again")
    world = run["in joint mode"]["world"]
    assert np.abs(np.array(world) - run["unclamped"]["world"]).max() > 0.01
    assert np.abs(np.array(world) - run["in world mode again"]["world"]).max() < WORLD
    joints = study.corrected(world, study.hot, loaded=True)
    assert np.abs(joints - run["in joint mode"]["joints"]).max() < WORLD


def test_the_clamp(done: Done) -> None:
    study, run = done
    nominal = study.nominal(study.end)
    added = study.corrected(study.end, study.graded, loaded=True) - nominal
    assert np.abs(added).max() > 1.2 * CLAMP
    same(run["clamped"], nominal + np.clip(added, -CLAMP, CLAMP))
    assert run["clamped"]["pins"]["truepose.clamped"]
    pins = [run["clamped"]["pins"][f"truepose.compensation-{n}"] for n in range(len(nominal))]
    assert np.abs(pins - np.clip(added, -CLAMP, CLAMP)).max() < JOINT
    same(run["unclamped"], nominal + added)
    assert not run["unclamped"]["pins"]["truepose.clamped"]
