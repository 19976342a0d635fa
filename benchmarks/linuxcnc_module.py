"""The exported LinuxCNC module over LinuxCNC's own genhexkins, by their public entry points.

Both are the very libraries that LinuxCNC loads, ours as halcompile makes it from
machines/hexapod.toml, which has genhexkins' own 24 coordinates. Ours compensates every temperature
and a force all the while; genhexkins knows the nominal machine only.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.kinematics_host import (
    NEEDED,
    PACKAGED,
    Host,
    Module,
    available,
    compiled,
    parameters_of,
)
from benchmarks.rows import Row
from benchmarks.timing import require_agreement

FILE = Path(__file__).parents[1] / "machines" / "hexapod.toml"
INCH = 25.4
"""mm: genhexkins' own geometry is in inches, ours in mm."""

ROUNDS = 15
FORWARD_CALLS, INVERSE_CALLS = 4000, 30000

LEVEL, TILTED = (1.0, 2.0, 20.0, 0.0, 0.0, 0.0), (1.0, 2.0, 20.0, 3.0, 4.0, 5.0)
"""Poses, inches and degrees."""
STARTS = {"0.1 in": (0.1, 0.0), "10 in and 2 deg": (10.0, 2.0)}
"""How far the forward solution's start is off, as in a cycle at 2.5 m/s, and as far as can be."""
ASKED = {"a level": 1.0, "a tilted": 2.0}
ASKED_INVERSE = 2.0

Floats = NDArray[np.float64]


def measure() -> list[Row]:
    """Forward at a level and a tilted pose from near and far, and the inverse."""
    if not (available() and (PACKAGED / "genhexkins.so").exists()):
        print(f"linuxcnc_module: left out, {NEEDED} are not installed", file=sys.stderr)
        return []
    with tempfile.TemporaryDirectory() as name:
        return _measure(Path(name))


def _measure(folder: Path) -> list[Row]:
    import truepose as tp
    from truepose.controllers import export

    for file, text in export(tp.load(FILE), "linuxcnc").files.items():
        (folder / file).write_text(text)
    source = next(folder.glob("*.c"))
    host = Host(folder)
    theirs = host.load(PACKAGED / "genhexkins.so", 6)
    ours = host.load(compiled(source), 6, parameters_of(source.read_text()))
    _require_same_joints(ours, theirs)
    _heat_and_load(host)
    rows = []
    for what, pose in (("a level", LEVEL), ("a tilted", TILTED)):
        for off, (far, turned) in STARTS.items():
            rows.append(_forward(ours, theirs, what, pose, off, far, turned))
    rows.append(_inverse(ours, theirs))
    return rows


def _mm(pose: Sequence[float] | Floats) -> list[float]:
    """A pose in inches and degrees, in mm and degrees."""
    return (np.asarray(pose) * [INCH, INCH, INCH, 1.0, 1.0, 1.0]).tolist()


def _require_same_joints(ours: Module, theirs: Module) -> None:
    for pose in (LEVEL, TILTED):
        mine, their = ours.inverse(_mm(pose)), theirs.inverse(pose)
        assert mine is not None
        assert their is not None
        require_agreement(
            "joints of the module and genhexkins", np.array(mine), np.array(their) * INCH
        )


def _heat_and_load(host: Host) -> None:
    """Every temperature and force off its reference, at once, and the compensation on."""
    pins = [name for name in host.names if name.endswith("-temperature")]
    for number, pin in enumerate(pins):
        host.connect(pin)
        host.set(pin, 24.0 + number)
    for axis, force in (("x", 300.0), ("y", 200.0), ("z", -150.0)):
        host.set(f"truepose.force-{axis}", force)
    host.set("truepose.rate-limit", 1e9)
    host.set("truepose.enable", 1.0)
    for _ in range(3):
        host.run("truepose.update")
    compensation = [host.get(f"truepose.compensation-{number}") for number in range(6)]
    if host.get("truepose.fault") or not all(compensation):
        raise RuntimeError("the module does not compensate")


def _forward(
    ours: Module,
    theirs: Module,
    what: str,
    pose: Sequence[float],
    off: str,
    far: float,
    turned: float,
) -> Row:
    start = np.array(pose) + np.r_[np.full(3, far / np.sqrt(3.0)), np.full(3, turned)]
    joints, their_joints = ours.inverse(_mm(pose)), theirs.inverse(pose)
    assert joints is not None
    assert their_joints is not None
    theirs.forward(their_joints, pose)  # it does not look at the start of its first call
    _require_back(ours.forward(joints, _mm(start)), _mm(pose))
    _require_back(theirs.forward(their_joints, start.tolist()), list(pose))
    best = [np.inf, np.inf]
    for _ in range(ROUNDS):
        best[0] = min(best[0], ours.forward_ns(joints, _mm(start), FORWARD_CALLS))
        best[1] = min(best[1], theirs.forward_ns(their_joints, start.tolist(), FORWARD_CALLS))
    return Row(
        f"LinuxCNC module, forward at {what} pose, hot and loaded, over genhexkins; {off} off",
        best[1] / best[0],
        "x",
        "at least",
        ASKED[what],
        f"{best[0]:.0f} ns against {best[1]:.0f} ns",
    )


def _require_back(found: list[float] | None, pose: list[float]) -> None:
    if found is None or np.abs(np.array(found[:6]) - pose).max() > 1e-8:
        raise RuntimeError(f"the forward solution gives {found}, not {pose}")


def _inverse(ours: Module, theirs: Module) -> Row:
    best = [np.inf, np.inf]
    for _ in range(ROUNDS):
        best[0] = min(best[0], ours.inverse_ns(_mm(TILTED), INVERSE_CALLS))
        best[1] = min(best[1], theirs.inverse_ns(TILTED, INVERSE_CALLS))
    return Row(
        "LinuxCNC module, inverse hot and loaded, in genhexkins' nominal ones",
        best[0] / best[1],
        "x",
        "at most",
        ASKED_INVERSE,
        f"{best[0]:.0f} ns against {best[1]:.0f} ns; every temperature, force in three directions",
    )
