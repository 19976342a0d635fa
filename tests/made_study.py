"""Studies made by hand for tests of tables, figures and files: no budget is evaluated.

The machines are stand-ins with closed-form kinematics, the errors are smooth made-up functions of
the pose with the schema of docs/results.md. Numbers mean nothing; shapes, names and units do. What
a stand-in does not say itself a machine of the library with as many drives and struts answers, so
that a new figure may ask its machine whatever it likes.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from truepose.files.shown_units import Shown, ShownUnits
from truepose.machine.workspace import Accuracy
from truepose.reporting.study import Study
from truepose.verdict.answer import AFTER, BEFORE, MET, NOT_MET, UNDECIDED, Answer, Number

Array = NDArray[np.float64]
SOURCES = ("tolerance", "thermal", "elastic")
MADE_UNITS = ShownUnits(small_angle=Shown("µrad", 1e6))
"""Millimetres and degrees, and errors in millionths of SI, which the tests need not convert."""

UNIT_OF = {"x": "m", "y": "m", "z": "m"}


class StandIn(SimpleNamespace):
    """What is said here; for all else what it stands for."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["stands_for"], name)


class PlanarKernel(StandIn):
    """Two vertical guideways at x = 0 and x = 0.6 m, two struts of 0.5 m that meet in the tool."""

    rails = np.array([0.0, 0.6])
    home = np.array([0.3, 0.2])

    def place(self, poses: Array) -> tuple[Array, Array, Array]:
        height = np.sqrt(0.25 - (poses[:, :1] - self.rails) ** 2)
        return poses[:, 1:2] + height, self.placement_of(poses), np.zeros(len(poses), np.uint8)

    def placement_of(self, poses: Array) -> Array:
        placements = np.zeros((len(poses), 7))
        placements[:, :2], placements[:, 3] = poses[:, :2], 1.0
        return placements

    def joint_centres(self, joints: Array, placements: Array) -> Array:
        centres = np.zeros((len(joints), 2, 2, 3))
        centres[:, :, 0, 0], centres[:, :, 0, 1] = self.rails, joints
        centres[:, :, 1] = placements[:, None, :3]
        return centres


class HexapodKernel(StandIn):
    """Six telescopic struts between two circles; turns are left out of the drawing."""

    home = np.array([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])

    def __init__(self, **said: Any) -> None:
        super().__init__(**said)
        turn = np.deg2rad(np.repeat([0, 120, 240], 2) + np.tile([-12, 12], 3))
        other = np.deg2rad(np.repeat([0, 120, 240], 2) + np.tile([-45, 45], 3))
        self.base = 0.4 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        self.platform = 0.15 * np.stack([np.cos(other), np.sin(other), 0 * turn], axis=1)

    def place(self, poses: Array) -> tuple[Array, Array, Array]:
        placements = self.placement_of(poses)
        centres = self.joint_centres(np.zeros((len(poses), 6)), placements)
        lengths = np.linalg.norm(centres[:, :, 1] - centres[:, :, 0], axis=-1)
        return lengths, placements, np.zeros(len(poses), np.uint8)

    def placement_of(self, poses: Array) -> Array:
        placements = np.zeros((len(poses), 7))
        placements[:, :3], placements[:, 3] = poses[:, :3], 1.0
        return placements

    def joint_centres(self, joints: Array, placements: Array) -> Array:
        centres = np.empty((len(joints), 6, 2, 3))
        centres[:, :, 0] = self.base
        centres[:, :, 1] = placements[:, None, :3] + self.platform
        return centres


def _machine(
    name: str, dof: str, kernel: type[StandIn], drives: list[Any], model: str, **others: Any
) -> Any:
    stands_for = tp.load(MACHINES / f"{model}.toml")
    components = [
        component
        for component, freedom in zip(("x", "y", "z", "rx", "ry", "rz"), "xyzabc", strict=True)
        if freedom in dof
    ]
    made_kernel = kernel(stands_for=stands_for.kernel)
    return StandIn(
        stands_for=stands_for,
        name=name,
        description="",
        origin="",
        file=f"{name}.toml",
        file_hash="0123456789abcdef" * 4,
        data_files={"log.csv": "fedcba9876543210" * 4},
        settings={},
        replaced={},
        dof=tuple(dof),
        commanded=tuple(dof),
        components=tuple(components),
        kernel=made_kernel,
        drives=tuple(drives),
        joints=tuple(drive.name for drive in drives),
        struts=tuple(
            SimpleNamespace(name=str(i), drive=drive.name) for i, drive in enumerate(drives, 1)
        ),
        characteristic_length=0.5,
        home=made_kernel.home,
        parameters=("strut.1.base.x", "strut.1.length", "drive.d1.axis.u"),
        nominal=np.array([0.25, 0.5, 0.0]),
        units=("m", "m", "1"),
        condition=SimpleNamespace(
            reference_temperature=293.15,
            default_temperature=308.15,
            part_temperatures={"strut.1": 303.15},
            force=(1200.0, -1500.0, 0.0),
            moment=(0.0, 0.0, 0.0),
            temperature_log=SimpleNamespace(name="log.csv", names=lambda part: part != "tool"),
            time=None,
            gradients={"strut.1": (4.0, 0.0, 0.0), "frame": (0.0, 0.0, -5.0)},
            envelope=SimpleNamespace(force=300.0, normal=(0.0, 0.0, 1.0)),
            acceleration=(0.0, 2.0, 0.0),
            source_keys={},
        ),
        accuracy=Accuracy(5e-4, None, "0.5 mm"),
        shown=MADE_UNITS,
        sources=tuple(
            SimpleNamespace(name=name, doc=f"made-up {name}", acts=lambda condition: False)
            for name in SOURCES
        ),
        **others,
    )


def planar_study(count: int = 5) -> Study:
    """A planar point on a count x count grid."""
    drives = [
        SimpleNamespace(
            name=f"d{i}", kind="slider", coordinate="length", travel=(0.0, 0.9), drawing="line"
        )
        for i in (1, 2)
    ]
    machine = _machine("planar", "xy", PlanarKernel, drives, "planar_two_slider")
    x, y = np.meshgrid(np.linspace(0.2, 0.4, count), np.linspace(0.1, 0.3, count))
    return _study(machine, np.stack([x.ravel(), y.ravel()], axis=1))


def hexapod_study(count: int = 5) -> Study:
    """A spatial body on a count^3 grid of positions, not turned."""
    drives = [
        SimpleNamespace(
            name=f"d{i}", kind="telescopic", coordinate="length", travel=(0.3, 1.0), drawing="none"
        )
        for i in range(1, 7)
    ]
    machine = _machine("hexapod", "xyzabc", HexapodKernel, drives, "hexapod")
    side = np.linspace(-0.1, 0.1, count)
    z, y, x = np.meshgrid(side + 0.6, side, side, indexing="ij")
    poses = np.zeros((count**3, 6))
    poses[:, :3] = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    return _study(machine, poses)


def _study(machine: Any, poses: Array) -> Study:
    components = list(machine.components)
    n_pose, n_component, n_source = len(poses), len(components), len(SOURCES)
    phase = np.arange(n_component)[None, None] + np.arange(n_source)[None, :, None]
    place = (poses / 0.1).sum(axis=1)[:, None, None]
    shift = np.array([0.0, 1.0e-4, 6.0e-5])[None, :, None] * np.cos(0.6 * place + phase)
    half = np.array([3.0e-4, 0.0, 0.0])[None, :, None] * (1.2 + np.sin(0.4 * place + phase))
    worst = np.abs(shift) + half
    coordinate = np.zeros((n_pose, n_component))
    coordinate[:, : min(n_component, poses.shape[1])] = np.abs(poses[:, :n_component])
    with np.errstate(divide="ignore"):
        inverse = np.where(coordinate > 1e-6, 100 / coordinate, np.nan)[:, None]
    quantities = ["position"] + ["orientation"] * (n_component > 3)
    norms = [np.linalg.norm(worst[..., :3], axis=-1), np.linalg.norm(worst[..., 3:], axis=-1)]
    highest = np.stack([norm.max(axis=0) for norm in norms[: len(quantities)]], axis=1)
    per_source = ("pose", "source", "component")
    data: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "error": (per_source, shift, "m"),
        "error_lower": (per_source, shift - half, "m"),
        "error_upper": (per_source, shift + half, "m"),
        "worst": (per_source, worst, "m"),
        "reach": (per_source, worst - np.abs(shift), "m"),
        "largest": (
            ("pose", "source", "quantity"),
            np.stack(norms[: len(quantities)], axis=2),
            "m",
        ),
        "uncertainty": (per_source, half / np.sqrt(3), "m"),
        "percent_lower": (per_source, np.abs(shift - half) * inverse, "%"),
        "percent_upper": (per_source, np.abs(shift + half) * inverse, "%"),
        "highest": (("source", "quantity"), highest, "m"),
        "rms": (("source", "quantity"), highest / 2, "m"),
        "share": (("source",), highest[:, 0] / highest[:, 0].sum(), "1"),
        "rank": (("source",), 1 + np.argsort(np.argsort(-highest[:, 0])), "1"),
        "linear_maximum": (
            ("pose", "quantity"),
            _sizes(np.abs(shift.sum(axis=1)) + half.sum(axis=1)),
            "m",
        ),
        "verdict": (("source",), np.array(["dominant", "relevant", "negligible"]), "1"),
        "joint_nominal": (("pose", "joint"), machine.kernel.place(poses)[0], "m"),
        "force": (("pose", "closure"), machine.kernel.place(poses)[0] * 1e3, "N"),
        "percent_defined": (("pose", "component"), coordinate > 1e-6, "1"),
    }
    with np.errstate(invalid="ignore"):
        for edge, moved in (("", 0.0), ("_lower", -half), ("_upper", half)):
            overall = (shift + moved).sum(axis=1)
            data[f"overall_error{edge}"] = (("pose", "component"), overall, "m")
            if edge:
                percent = np.abs(overall) * inverse[:, 0]
                alone = np.abs(shift + moved)
                data[f"overall_percent{edge}"] = (("pose", "component"), percent, "%")
                for name, values, over in (
                    (f"overall_highest{edge}", np.abs(overall), ("component",)),
                    (f"overall_highest_percent{edge}", percent, ("component",)),
                    (f"highest{edge}", alone, ("source", "component")),
                    (f"highest_percent{edge}", alone * inverse, ("source", "component")),
                ):
                    largest = np.where(np.isnan(values), -1.0, values).max(axis=0)
                    largest[largest < 0] = np.nan
                    data[name] = (over, largest, "%" if "percent" in name else "m")
    coords: dict[str, Any] = {
        "pose": np.arange(n_pose),
        "source": list(SOURCES),
        "component": components,
        "component_units": ("component", [UNIT_OF.get(name, "rad") for name in components]),
        "joint": list(machine.joints),
        "closure": [strut.name for strut in machine.struts],
        "quantity": quantities,
        "left_out_index": ("left_out", np.array([n_pose])),
        "left_out_status": ("left_out", np.array(["unreachable"])),
    }
    for index, name in enumerate(machine.commanded):
        attrs = {"units": UNIT_OF.get(name, "rad"), "long_name": f"commanded {name}"}
        coords[f"pose_{name}"] = ("pose", poses[:, index], attrs)
        coords[f"left_out_{name}"] = ("left_out", np.array([9.0]), attrs)
    attrs = {
        "truepose_version": "0.0.0",
        "machine": machine.name,
        "machine_file": machine.file,
        "machine_hash": machine.file_hash,
        "seed": "none",
        "poses_used": n_pose,
        "poses_left_out": 1,
        "settings": "",
        "not_included": "",
    }
    budget = _dataset(data, coords, attrs)
    remaining: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "joint_corrected": (("pose", "joint"), machine.kernel.place(poses)[0] + 1e-4, "m"),
        "joint_nominal": data["joint_nominal"],
        "residual_lower": (("pose", "component"), -half.sum(axis=1), "m"),
        "residual_upper": (("pose", "component"), half.sum(axis=1), "m"),
        "residual_middle": (("pose", "component"), 0 * half.sum(axis=1), "m"),
        "bound": (("pose", "component"), half.sum(axis=1), "m"),
        "second_order": (("pose", "component"), 1e-3 * half.sum(axis=1), "m"),
        "linear_maximum": (("pose", "quantity"), _sizes(half.sum(axis=1)), "m"),
    }
    kept = {name: coords[name] for name in coords if name != "source"}
    compensation = _dataset(remaining, kept, attrs)
    return Study(
        machine,
        budget,
        compensation,
        (*_answers(machine, budget, BEFORE), *_answers(machine, compensation, AFTER)),
        (*_answers(machine, budget, BEFORE, 0.4), *_answers(machine, compensation, AFTER, 0.4)),
        _over_time(machine, poses),
        _strain(coords, attrs),
    )


def _sizes(errors: Array) -> Array:
    """(n_pose, quantity) a little less than the lengths of vectors of worst components."""
    parts = [errors[:, :3], errors[:, 3:]] if errors.shape[1] > 3 else [errors]
    return np.stack([0.9 * np.linalg.norm(part, axis=1) for part in parts], axis=1)


def _answers(machine: Any, found: xr.Dataset, state: str, share: float = 1.0) -> tuple[Answer, ...]:
    """Answers at the pose of the largest linear maximum: a witness 1 % below, a bound 2 % above."""
    poses = np.stack([found[f"pose_{name}"].values for name in machine.commanded], axis=-1)
    answers = []
    for at, quantity in enumerate(found["quantity"].values):
        sizes = found["linear_maximum"].values[:, at]
        worst = int(sizes.argmax())
        witness, linear, bound = (
            Number(share * factor * float(sizes[worst]), worst, poses[worst])
            for factor in (0.99, 1.0, 1.02)
        )
        asked = machine.accuracy.target if quantity == "position" else None
        answer = None
        if asked is not None:
            answer = (
                NOT_MET if witness.value > asked else MET if bound.value <= asked else UNDECIDED
            )
        answers.append(
            Answer(str(quantity), state, asked, answer, witness, linear, bound, "what is made up")
        )
    return tuple(answers)


def _strain(coords: dict[str, Any], attrs: Any) -> xr.Dataset:
    """Half of every force is left by the clearances: of the first source, nothing."""
    names = ("source", "quantity", "component", "component_units", "joint")
    kept = {name: each for name, each in coords.items() if name not in names}
    sources, closures = list(SOURCES[:2]), len(coords["closure"])
    phase = np.arange(len(coords["pose"]))[:, None, None] + np.arange(closures)
    rigid = np.array([800.0, 300.0])[:, None] * np.cos(0.3 * phase)
    force = np.array([0.5, 0.0])[:, None] * rigid
    each, every = ("pose", "source", "closure"), ("pose", "closure")
    overall = force[:, 0] + 50.0
    data: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "force": (each, force, "N"),
        "force_rigid": (each, rigid, "N"),
        "absorbed": (each, (rigid - force) / 5e7, "m"),
        "strain": (each, force / 5e7, "m"),
        "overall_force": (every, overall, "N"),
        "overall_absorbed": (every, overall / 5e7, "m"),
        "overall_strain": (every, overall / 5e7, "m"),
        "highest_force": (("source",), np.abs(force).max(axis=(0, 2)), "N"),
        "highest_force_rigid": (("source",), np.abs(rigid).max(axis=(0, 2)), "N"),
        "remaining": (("source",), np.array([0.5, 0.0]), "1"),
        "verdict": (("source",), np.array(["partly", "absorbed"]), "1"),
    }
    return _dataset(data, kept | {"source": sources}, attrs)


def _over_time(machine: Any, poses: Array) -> xr.Dataset:
    """A first-order heat-up of 1 h, at the first and the last pose."""
    times = np.arange(0.0, 3601.0, 10.0)
    share = 1.0 - np.exp(-times / 900.0)
    parts = ["strut.1", "strut.2", "frame", "tool"]
    size = 1e-5 * np.arange(1, 2 * len(machine.components) + 1).reshape(2, -1)
    rises = np.array([15.0, 11.0, 11.0, 0.0])
    data = {
        "error": (("time", "pose", "component"), share[:, None, None] * size, "m"),
        "temperature": (("time", "part"), 293.15 + share[:, None] * rises, "K"),
    }
    coords: dict[str, Any] = {"time": times, "part": parts, "component": list(machine.components)}
    for index, name in enumerate(machine.commanded):
        coords[f"pose_{name}"] = ("pose", poses[[0, -1], index])
    return _dataset(data, coords, {})


def _dataset(
    data: dict[str, tuple[tuple[str, ...], Any, str]], coords: dict[str, Any], attrs: Any
) -> xr.Dataset:
    variables = {
        name: (dims, values, {"units": unit, "long_name": name.replace("_", " ")})
        for name, (dims, values, unit) in data.items()
    }
    return xr.Dataset(variables, coords=coords, attrs=attrs)
