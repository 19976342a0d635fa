"""Where the machine was at every row: commands or joints -> joints and placements, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.instruments import REGISTRY, Instrument
from truepose.calibration.measurements.columns import TO, MeasurementRows, Report
from truepose.errors import Fault
from truepose.files.data_file import MOST_PROBLEMS
from truepose.machine import Machine
from truepose.runs.poses import faults_text

SAME = 1e-9
"""Two poses are one where no joint differs by more than this share of the largest."""


@dataclass(frozen=True, eq=False)
class CommandedPoses:
    """Joints (n_row, n_joint) and placements (n_row, 7) of the nominal machine.

    At its home where a row needs no pose. The `other_` ones: of the second pose; the first again
    where a row has one, None where no row has two.
    """

    joints: Floats
    placements: Floats
    other_joints: Floats | None
    other_placements: Floats | None


def commanded_poses(
    machine: Machine, instruments: Sequence[Instrument], rows: MeasurementRows, report: Report
) -> CommandedPoses:
    """The poses of all rows, NaN where something was reported."""
    poses = _poses_needed(instruments, rows)
    joints = np.full((rows.n_row, len(machine.joints)), math.nan)
    placements = np.full((rows.n_row, 7), math.nan)
    at_home = poses == 0
    if at_home.any():
        joints[at_home], placements[at_home] = at_rest(machine)
    table = _Poses(machine, rows, report, "", rows.commands, rows.joints)
    if table.given:
        table.refuse_unwanted(at_home, "what this row measures does not depend on a pose")
        table.place(~at_home, joints, placements)
    two = poses == 2
    other = _Poses(machine, rows, report, TO, rows.to_commands, rows.to_joints)
    if other.given:
        other.refuse_unwanted(~two, "what this row measures is not between two poses")
    if not two.any():
        return CommandedPoses(joints, placements, None, None)
    to_joints, to_placements = joints.copy(), placements.copy()
    if other.given:
        to_joints[two], to_placements[two] = math.nan, math.nan
        other.place(two, to_joints, to_placements)
        _refuse_one_pose(rows, two, joints, to_joints, report)
    return CommandedPoses(joints, placements, to_joints, to_placements)


def at_rest(machine: Machine) -> tuple[Floats, Floats]:
    """Joints (n_joint,) and placement (7,) of the home pose of the nominal machine."""
    home = machine.home[[machine.dof.index(freedom) for freedom in machine.commanded]]
    joints, placements, _ = machine.kernel.place(home[np.newaxis])
    return joints[0], placements[0]


def _poses_needed(instruments: Sequence[Instrument], rows: MeasurementRows) -> Indices:
    """(n_row,) at how many poses each row's instrument reads; one where that is not known."""
    needed = np.array([REGISTRY[instrument.kind].poses for instrument in instruments], np.intp)
    known = rows.instrument >= 0
    poses = np.ones(rows.n_row, np.intp)
    poses[known] = needed[rows.instrument[known]]
    return poses


def _refuse_one_pose(
    rows: MeasurementRows, two: Flags, joints: Floats, others: Floats, report: Report
) -> None:
    """Distances between a pose and itself, which are nothing to be measured."""
    apart = np.abs(others - joints).max(axis=1)
    size = SAME * np.abs(joints[np.isfinite(joints)]).max(initial=0.0)
    for row in np.flatnonzero(two & (apart <= size)).tolist():
        report(
            Fault(
                "not-positive",
                "the two poses of this row are one",
                found="the same pose twice",
                expected="two poses at a distance from each other",
            ),
            row=row,
        )


@dataclass
class _Poses:
    """The first or, with the beginning "to.", the second poses of rows."""

    machine: Machine
    rows: MeasurementRows
    report: Report
    beginning: str
    commands: Floats | None
    joints: Floats | None

    @property
    def given(self) -> bool:
        """Whether there are columns of them."""
        return self.commands is not None or self.joints is not None

    @property
    def columns(self) -> list[str]:
        """Their columns, by name."""
        if self.commands is None:
            return [f"{self.beginning}joint.{name}" for name in self.machine.joints]
        return [f"{self.beginning}command.{name}" for name in self.machine.commanded]

    def refuse_unwanted(self, without: Flags, message: str) -> None:
        """Poses in rows that have none."""
        table = self.joints if self.commands is None else self.commands
        assert table is not None
        for at, column in enumerate(self.columns):
            for row in np.flatnonzero(~np.isnan(table[:, at]) & without).tolist():
                self.report(
                    Fault(
                        "unwanted-value",
                        message,
                        found=self.report.shown(column, row),
                        expected="an empty cell",
                    ),
                    row=row,
                    column=column,
                )

    def place(self, wanted: Flags, joints: Floats, placements: Floats) -> None:
        """Into the arrays, where they are `wanted` (n_row,) and the machine can be there."""
        if self.commands is not None:
            self._place_commands(self.commands, wanted, joints, placements)
        if self.joints is not None:
            self._place_joints(self.joints, wanted, joints, placements)

    def _readable(self, table: Floats, wanted: Flags) -> Flags:
        """(n_row,) where a pose is whole; a blank cell of one that is wanted is refused."""
        good = np.asarray(np.isfinite(table).all(axis=1) & wanted, np.bool_)
        known = self.rows.instrument >= 0
        for at, column in enumerate(self.columns):
            spoilt = self.rows.spoilt(column)
            good &= ~spoilt
            blank = np.isnan(table[:, at]) & ~spoilt & known & wanted
            for row in np.flatnonzero(blank).tolist():
                self.report(
                    Fault("empty-cell", "the cell is empty", found="nothing", expected="a number"),
                    row=row,
                    column=column,
                )
        return good

    def _place_commands(
        self, commands: Floats, wanted: Flags, joints: Floats, placements: Floats
    ) -> None:
        machine = self.machine
        usable = np.flatnonzero(self._readable(commands, wanted))
        joints[usable], placements[usable], status = machine.kernel.place(commands[usable])
        failed = np.flatnonzero(status)
        for number, (row, code) in enumerate(zip(usable[failed], status[failed], strict=True)):
            name = why = STATUS[code]
            if number < MOST_PROBLEMS:  # the others are only counted
                faults = machine.kernel.explain(commands[row])
                why = f"{name}: {faults_text(machine, faults)}" if faults else name
            self.report(
                Fault(
                    "commanded-out-of-reach",
                    "the machine cannot be commanded to this pose",
                    found=why,
                    expected="a pose within the travel of every drive",
                    hint="is it a pose of this machine, in the unit of the header?",
                ),
                row=int(row),
            )

    def _place_joints(
        self, given: Floats, wanted: Flags, joints: Floats, placements: Floats
    ) -> None:
        machine = self.machine
        good = self._readable(given, wanted)
        usable = np.flatnonzero(good & self._within_travel(given, good))
        joints[usable] = given[usable]
        poses, status = machine.kernel.forward(given[usable], status=True)
        solved = status == 0
        placements[usable[solved]] = machine.kernel.placement_of(poses[solved])
        for row, code in zip(usable[~solved].tolist(), status[~solved].tolist(), strict=True):
            self.report(
                Fault(
                    "commanded-out-of-reach",
                    "the machine has no pose at these joints",
                    found=STATUS[code],
                    expected="joints at which the platform can be",
                    hint="are they joints of this machine, in the unit of the header?",
                ),
                row=row,
            )

    def _within_travel(self, given: Floats, good: Flags) -> Flags:
        within = np.ones(self.rows.n_row, np.bool_)
        for joint, drive in enumerate(self.machine.drives):
            first, last = drive.travel
            value = given[:, joint]
            slack = 1e-9 * (last - first) if math.isfinite(last - first) else 0.0
            outside = good & ((value < first - slack) | (value > last + slack))
            within &= ~outside
            unit = self.machine.file_units[drive.coordinate]
            ends = [f"{float(unit.to_file(end)):.10g}" for end in (first, last)]
            for row in np.flatnonzero(outside).tolist():
                column = self.columns[joint]
                self.report(
                    Fault(
                        "commanded-out-of-reach",
                        "the joint is out of its travel",
                        found=self.report.shown(column, row),
                        expected=f"a joint from {ends[0]} to {ends[1]} {unit.label}",
                    ),
                    row=row,
                    column=column,
                )
        return within
