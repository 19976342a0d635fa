"""The file that a calibration writes, used with a controller that was not touched.

A machine within its tolerances is measured, calibrated and written by default. What corrects
commands reads that file; the controller goes on with the geometry of the drawing, and the built
machine is where it was asked to be, within what the file states. With the geometry found as the
nominal one the same commands were corrected by nothing.
"""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from made_blunders import drawn, good
from made_measurements import reference_condition
from sweeps import thinned
from truepose.arrays import Floats
from truepose.machine import Machine

ROOT = Path(__file__).parents[2]
FILES = {
    "delta_printer": ROOT / "examples" / "data" / "delta_printer.toml",
    **{
        name: ROOT / "machines" / f"{name}.toml"
        for name in ("planar_two_slider", "linear_delta", "rotary_delta", "hexapod")
    },
}
FAR = {"delta_printer": 200e-6, "planar_two_slider": 100e-6}
"""m: by how much the tool was off, at least, where nothing was corrected: wide tolerances."""

SURE = 3.0
"""Lengths of the standard uncertainty (root of the trace): less than 1 pose in 300 is farther."""

POSES = 12

UNITS = {"mm": 1e-3, "in": 0.0254, "m": 1.0, "deg": np.pi / 180.0, "rad": 1.0}

Commanded = tuple[Floats, Floats]
"""Wanted poses (n, n_commanded), SI, and the poses or joints that the controller is given."""


@dataclass(frozen=True)
class InUse:
    """A built machine, the drawing that its controller has, and the file in both forms.

    `written`: the default. `loaded`: for a controller that has the geometry found, which this one
    has not; files had this form before.
    """

    drawing: Machine
    built: Machine
    written: Machine
    loaded: Machine
    poses: Floats

    def off(self, poses: Floats, joints: Floats) -> Floats:
        """(n,) m: how far the built machine is from `poses` when it is driven to `joints`."""
        wanted = self.drawing.kernel.place(poses)[1]
        start = self.drawing.kernel.pose_of(wanted)
        reached, status = self.built.kernel.forward(joints, start, status=True)
        assert (status <= 1).all()
        there = np.asarray(self.built.kernel.placement_of(reached))
        return np.asarray(np.linalg.norm(there[:, :3] - wanted[:, :3], axis=1))


def in_use(name: str, seed: int, folder: Path) -> InUse:
    drawing = tp.load(FILES[name])
    found = tp.calibrate(drawing, good(drawing, "position", seed=seed, count=40))
    assert found.accepted
    forms = []
    for number, asked in enumerate(({}, {"controller_holds": "calibrated"})):
        path = folder / f"{name}_{number}.toml"
        found.save(path, original=FILES[name], date="2026-01-31", **asked)  # type: ignore[arg-type]
        # What is built is neither warm nor loaded here, as it was when it was measured.
        forms.append(tp.load(path).with_condition(reference_condition(drawing)))
    poses = found.poses[found.usable]
    chosen = poses[np.random.default_rng(seed).permutation(len(poses))[:POSES]]
    return InUse(drawing, drawn(drawing, seed), forms[0], forms[1], chosen)


def by_compensation(use: InUse, file: Machine, folder: Path) -> Commanded:
    """The drawing's joints, and what compensation adds to those of its file."""
    found = tp.compensate(file, use.poses)
    assert found.sizes["pose"] == len(use.poses)
    added = found["joint_corrected"].values - found["joint_nominal"].values
    return use.poses, use.drawing.inverse(use.poses) + added


def by_program(use: InUse, file: Machine, folder: Path) -> Commanded:
    """The ends of the blocks of a corrected program, one for each pose."""
    names = file.commanded
    factors = np.array([1e3 if name in "xyz" else 180.0 / np.pi for name in names])
    source, target = folder / "program.ngc", folder / "corrected.ngc"
    lines = ["G21 G90 G94"]
    for number, pose in enumerate(use.poses * factors):
        words = " ".join(f"{n.upper()}{v:.8f}" for n, v in zip(names, pose, strict=True))
        lines += [f"G1 {words} F1000", f"(wanted {number})"]
    source.write_text("\n".join([*lines, "M2", ""]), encoding="ascii")
    tp.correct_program(file, source, target, digits=8, tolerance=1e-4, force=True)
    state = dict.fromkeys(names, np.nan)
    ends = []
    for line in target.read_text(encoding="ascii").splitlines():
        words = re.findall(r"([A-Z])(-?[\d.]+)", re.sub(r"\(.*?\)", "", line))
        state |= {n.lower(): float(v) for n, v in words if n.lower() in state}
        if "(wanted" in line:
            ends.append([state[n] for n in names])
    return use.poses, use.drawing.inverse(np.array(ends) / factors)


def by_map(use: InUse, file: Machine, folder: Path) -> Commanded:
    """The corners of a pose map that can be commanded, and what the table adds to them."""
    files = tp.export(file, "pose-map", {"count": "2"}).files
    (text,) = (text for name, text in files.items() if name.endswith(".json"))
    table = json.loads(text)
    scale = np.array([UNITS[axis["unit"]] for axis in table["axes"]])
    nodes = [axis["nodes"] for axis in table["axes"]]
    wanted = np.array([row[::-1] for row in itertools.product(*nodes[::-1])]) * scale
    added = np.array([table["corrections"][name] for name in file.commanded], float).T * scale
    ok = np.array([status == "ok" for status in table["status"]])
    assert ok.any()
    return wanted[ok], use.drawing.inverse(wanted[ok] + added[ok])


WAYS = {"compensate": by_compensation, "gcode": by_program, "pose-map": by_map}


@pytest.mark.parametrize("seed", thinned([1, 2, 3]))
@pytest.mark.parametrize("name", FILES)
def test_the_built_machine_is_where_it_is_asked_to_be(name: str, seed: int, tmp_path: Path) -> None:
    use = in_use(name, seed, tmp_path)
    for way, command in WAYS.items():
        poses, joints = command(use, use.written, tmp_path)
        off = use.off(poses, joints)
        known = tp.uncertainty(use.written, poses)
        linear = [axis for axis in known.component.values if axis in "xyz"]
        uncertain = known["standard_uncertainty"].sel(component=linear)
        stated = SURE * np.linalg.norm(uncertain, axis=1)
        assert (off <= stated).all(), (way, float((off / stated).max()))
        # As earlier versions wrote it: nothing is added, and the tool is where it always was.
        poses, joints = command(use, use.loaded, tmp_path)
        before = use.off(poses, use.drawing.inverse(poses))
        np.testing.assert_allclose(use.off(poses, joints), before, rtol=0.0, atol=1e-9)
        assert before.max() > off.max(), way
        if name in FAR:
            assert before.max() > max(FAR[name], 10.0 * float(stated.max())), way
