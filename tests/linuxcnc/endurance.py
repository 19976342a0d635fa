"""The real LinuxCNC with an exported module for a stated time, doing random things from a seed.

    PYTHONPATH=tests python tests/linuxcnc/endurance.py --minutes 60 --seed 1

Jogs, programs, homing, temperatures, forces, sensors that fail: `endurance_plan`. No joint may fall
behind (following error), LinuxCNC may say nothing, no zero may drift, and whenever the machine
rests at its temperatures, its joints are those of the kernel. Time is LinuxCNC's, in servo cycles.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from endurance_plan import Plan, Subject, counted
from real_linuxcnc import Run, required, run

MACHINES = Path(__file__).parents[2] / "machines"
ZERO = 1e-9
"""mm that a zero may drift, and a joint may be off the kernel's."""
BEHIND = 1e-3
"""mm that a joint may be behind: a drive follows all that is within its speed and acceleration."""
ACTIONS = 3.0
"""Made for each second: more than are done."""
CYCLES = 1000
"""Servo cycles a second."""
DENIED = "Homing denied by motion.homing-inhibit"


@dataclass(frozen=True)
class Outcome:
    """Figures of a run: mm; the counts are of what was done."""

    minutes: float
    done: Counter[str]
    drift: float
    joint_off: float
    following_error: float
    failures: int

    def __str__(self) -> str:
        kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(self.done.items()))
        return (
            f"{self.minutes:.2f} minutes of servo cycles: {kinds}\n"
            f"zero drift {self.drift:.2g} mm, joints at rest off the kernel's "
            f"{self.joint_off:.2g} mm, largest following error {self.following_error:.2g} mm, "
            f"failed solutions {self.failures}"
        )


def endure(folder: Path, subject: Subject, seed: int, seconds: float) -> Outcome:
    """Run it; `AssertionError` with LinuxCNC's log where it trips."""
    plan = Plan(subject, seed, max(int(ACTIONS * seconds), 20))
    joints = range(len(subject.machine.joints))
    names = ",".join(f"following{n}" for n in joints)
    hal = f"{subject.nets}loadrt minmax names={names}\n" + "".join(
        f"addf following{n} servo-thread\nnet behind{n} joint.{n}.f-error => following{n}.in\n"
        for n in joints
    )
    series = {"do": "series", "steps": plan.steps, "cycles": int(CYCLES * seconds)}
    found = run(
        folder,
        subject.files,
        [*plan.begin(), series, *plan.end()],
        axes=subject.axes,
        joints=len(joints),
        programs=plan.programs,
        hal=hal,
        time_limit=3.0 * seconds + 100.0,
    )
    return _judged(plan, found)


def _judged(plan: Plan, run: Run) -> Outcome:
    joints = range(len(plan.subject.machine.joints))
    readings = run.report["readings"]
    assert run.report["errors"] == [], run.report["errors"]
    steps = readings["series"]["steps"]
    assert steps <= len(plan.steps), f"more than {len(plan.steps)} steps were done: make more"
    for label in plan.refusals:
        assert label not in readings or DENIED in "".join(readings[label]["refused"]), label
    for label in plan.homings:
        denied = f"{label} denied"
        assert denied not in readings or readings[denied]["refused"] == [], readings[denied]

    def pins(label: str, name: str) -> np.ndarray:
        return np.array([readings[label]["pins"][f"joint.{n}.{name}"] for n in joints])

    at_home = [label for label in [*plan.homings, "end"] if label in readings]
    drift = max(
        float(np.abs(pins(label, name) - pins("begin", name)).max())
        for label in at_home
        for name in ("motor-offset", "motor-pos-cmd")
    )
    off = max(
        (
            float(np.abs(np.array(readings[label][where]) - expected).max())
            for label, expected in plan.expected.items()
            if label in readings
            for where in ("joints", "feedback")
        ),
        default=0.0,
    )
    last = readings["end"]["pins"]
    behind = max(abs(last[f"following{n}.{end}"]) for n in joints for end in ("min", "max"))
    failures = last["truepose.failures"] - readings["begin"]["pins"]["truepose.failures"]
    minutes = readings["series"]["cycles"] / (60 * CYCLES)
    return Outcome(minutes, Counter(counted(plan, steps)), drift, off, behind, failures)


def require(outcome: Outcome) -> None:
    """Raises `AssertionError` with the figures."""
    assert outcome.drift < ZERO, f"a zero drifts: {outcome}"
    assert outcome.joint_off < ZERO, f"a joint is off: {outcome}"
    assert outcome.following_error < BEHIND, f"a joint falls behind: {outcome}"
    assert outcome.failures == 0, f"a solution fails: {outcome}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print the figures, and 1 where one is not kept."""
    parser = argparse.ArgumentParser(prog="endurance")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--machine", default="hexapod", help="of machines/, without .toml")
    options = parser.parse_args(arguments)
    required()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        try:
            subject = Subject(MACHINES / f"{options.machine}.toml")
            outcome = endure(Path(folder), subject, options.seed, 60.0 * options.minutes)
            print(outcome, flush=True)
            require(outcome)
        except AssertionError as error:
            print(error, flush=True)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
