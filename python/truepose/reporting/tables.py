"""The tables of the command line and of the report: the same text in both.

In the units for people (`truepose.files.shown_units`), percentages of the commanded coordinate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.language import grouped, marked, say
from truepose.reporting.accuracy import told
from truepose.reporting.display import (
    column,
    decimals_for,
    is_position,
    number,
    pose_text,
    where_highest,
)
from truepose.reporting.result_words import ends, word
from truepose.reporting.study import Study, warnings_of
from truepose.reporting.table import Table, largest_cells, with_not_included
from truepose.runs.poses import reason_text

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine
    from truepose.verdict.answer import Answer

MOST_LISTED = 20
"""Rows of a list of poses shown to people; files for programs hold them all."""


def ranking(study: Study) -> Table:
    """The sources by rank: what each alone can do at most, its share and the verdict."""
    order = study.by_rank
    parts = [str(name) for name in study.budget["quantity"].values]
    header = [say("source"), say("verdict"), say("rank")]
    columns: list[Sequence[str]] = [
        [study.sources[index] for index in order],
        [word(str(study.values("verdict")[index])) for index in order],
        [str(int(study.values("rank")[index])) for index in order],
    ]
    for part, name in enumerate(parts):
        unit = study.units.error(name)
        header += [
            say("highest {quantity}, {unit}", quantity=word(name), unit=unit.label),
            say("rms {quantity}, {unit}", quantity=word(name), unit=unit.label),
        ]
        columns += [
            column(study.values(kind)[order, part] * unit.per_si) for kind in ("highest", "rms")
        ]
    header.append(say("share, %"))
    columns.append(column(study.values("share")[order] * 100, 1))
    first, unit = order[0], study.units.error(parts[0])
    highest = study.values("highest")[order]
    table = Table(
        "ranking",
        say("The sources compared"),
        tuple(header),
        tuple(zip(*columns, strict=True)),
        words=2,
        says=say(
            "{source} can do most: {size}, {share} % of all sources' worst cases added up.",
            source=study.sources[first],
            size=f"{columns[3][0]} {unit.label}",
            share=columns[-1][0],
        ),
        largest=frozenset((row, 3 + 2 * at) for row, at in largest_cells(highest, 0)),
        note=say(
            "Highest: the worst case of this source alone (linear maximum), at its worst pose."
        ),
    )
    return with_not_included(table, str(study.budget.attrs["not_included"]))


def highest_absolute(study: Study) -> Table:
    """Highest absolute error over the poses, per source and component (table 5, in form).

    The rows of all sources together are not in that table of the paper.
    """
    highest = study.shown(_highest(study, "highest", "overall_highest"))
    cells = [column(values) for values in highest.T]
    labels = _end_labels(study)
    alike = study.positions or study.rotations
    row, nth = np.unravel_index(int(np.nanargmax(highest[:, alike])), (len(labels), len(alike)))
    at = alike[nth]
    return Table(
        "highest_absolute",
        say("Highest absolute error"),
        (say("source"), *(f"{name}, {study.units.error(name).label}" for name in study.components)),
        tuple(zip(labels, *cells, strict=True)),
        says=say(
            "The largest is {size} {unit} in {component}, of “{row}”.",
            component=study.components[at],
            row=labels[row],
            size=cells[at][row],
            unit=study.units.error(study.components[at]).label,
        ),
        largest=largest_cells(highest, 1),
        note=say(
            "Over all poses, per axis of the base frame, exact. All at lower, all at upper ends: "
            "lengths and offsets all at that end of their tolerance bands, the rest as known; "
            "the worst case of a source is in the ranking."
        ),
    )


def highest_percent(study: Study) -> Table:
    """Highest error as a percentage of the coordinate, per source (table 6, in form)."""
    highest = _highest(study, "highest_percent", "overall_highest_percent")
    shown = [index for index in study.positions if np.isfinite(highest[:, index]).any()]
    cells = [column(highest[:, index], 4) for index in shown]
    labels = _end_labels(study)
    says = ""
    if shown:
        row, at = np.unravel_index(int(np.nanargmax(highest[:, shown])), (len(labels), len(shown)))
        says = say(
            "The largest is {percent} % of {component}, of “{row}”.",
            percent=cells[at][row],
            component=study.components[shown[at]],
            row=labels[row],
        )
    return Table(
        "highest_percent",
        say("Highest error as a percentage of the coordinate"),
        (say("source"), *(f"{study.components[index]}, %" for index in shown)),
        tuple(zip(labels, *cells, strict=True)),
        says=says,
        largest=largest_cells(highest[:, shown], 1),
        note=say("Of the commanded coordinate at the same pose, where that is not near zero."),
    )


def compensation(study: Study) -> Table:
    """Highest absolute error per component and of the position, before and after."""
    components = study.components
    lower, upper = ends()
    rows: list[tuple[str, Floats, Floats | None]] = [
        (say("before, {ends}", ends=lower), study.values("overall_error_lower"), None),
        (say("before, known error"), study.values("overall_error"), None),
        (say("before, {ends}", ends=upper), study.values("overall_error_upper"), None),
        (say("before, worst case"), study.overall_worst, study.largest),
        (say("after, {ends}", ends=lower), study.compensated("residual_lower"), None),
        (say("after, known error"), study.compensated("residual_middle"), None),
        (say("after, {ends}", ends=upper), study.compensated("residual_upper"), None),
        (say("after, worst case"), study.compensated("bound"), study.remaining_largest),
    ]
    units, names = study.units, (*components, *(["position"] if study.positions else []))
    highest = np.stack(
        [
            np.append(
                np.nanmax(np.abs(errors), axis=0),
                [np.nanmax(study.position_norm(errors) if size is None else size)]
                if study.positions
                else [],
            )
            for _, errors, size in rows
        ]
    )
    # The middle is at rounding level; the decimals of the other rows show it as zero.
    cells = [column(values, decimals_for(values)) for values in units.errors(highest, names).T]
    return Table(
        "compensation",
        say("Before and after compensation"),
        (
            say("highest over all poses"),
            *(f"{word(name)}, {units.error(name).label}" for name in names),
        ),
        tuple(zip([name for name, _, _ in rows], *cells, strict=True)),
        says=say(
            "The worst case of {quantity} goes from {before} to {after} {unit}.",
            quantity=word(names[-1]),
            before=cells[-1][3],
            after=cells[-1][7],
            unit=units.error(names[-1]).label,
        ),
        note=say(
            "After: the corrected command driven through the actual machine. Known error: of all "
            "that is known. All at lower, all at upper ends: lengths and offsets all at that end "
            "of their tolerance bands. Worst case: of each component by itself, and of the "
            "position what one machine can do (linear maximum); both to first order."
        ),
    )


MOMENTS = 9
"""Moments of an error over time shown to people, evenly spaced."""


def over_time(machine: Machine, result: xr.Dataset) -> Table:
    """The error at the first of the poses, at some moments of the temperature log and the worst."""
    units = machine.shown
    times, error = result["time"].values, result["error"].values[:, 0]
    components = [str(name) for name in result["component"].values]
    size = np.linalg.norm(error[:, [is_position(name) for name in components]], axis=1)
    worst = where_highest(size)
    shown = np.unique(np.linspace(0, len(times) - 1, min(MOMENTS, len(times))).astype(int))
    rows = [*shown, worst]
    pose = np.array([result[f"pose_{name}"].values[0] for name in machine.commanded])
    columns = [
        [
            *(number(times[row] / 60.0, 2) for row in shown),
            say("{time} (worst)", time=marked(f"{times[worst] / 60.0:.2f}")),
        ],
        *(
            column(error[rows, index] * units.error(name).per_si)
            for index, name in enumerate(components)
        ),
        column(size[rows] * units.small_length.per_si),
    ]
    return Table(
        "over_time",
        say("Error over time"),
        (
            say("time, min"),
            *(f"{word(name)}, {units.error(name).label}" for name in (*components, "position")),
        ),
        tuple(zip(*columns, strict=True)),
        note=say(
            "From the logged temperatures alone, exact, at {pose}.",
            pose=pose_text(pose, machine.commanded, units),
        ),
    )


def strain(study: Study) -> list[Table]:
    """The tables of the internal forces; none where the machine has none."""
    if study.strain is None:
        return []
    return [internal_forces(study), closure_forces(study)]


def internal_forces(study: Study) -> Table:
    """What each source's misfit makes of force inside the structure, and what clearances take."""
    strained = study.strained
    order = np.argsort(-strained["highest_force_rigid"].values, kind="stable")
    commanded, units = study.machine.commanded, study.units
    small, force_unit = units.small_length, units.force
    poses = np.stack([strained[f"pose_{name}"].values for name in commanded], axis=-1)
    closures, places = [], []
    for source in order:
        force = np.abs(strained["force"].values[:, source])
        if not force.any():
            force = np.abs(strained["force_rigid"].values[:, source])
        pose, closure = divmod(where_highest(force.ravel()), force.shape[1])
        closures.append(str(strained["closure"].values[closure]))
        places.append(pose_text(poses[pose], commanded, units))

    def highest(name: str) -> Floats:
        return np.asarray(np.abs(strained[name].values[:, order]).max(axis=(0, 2)))

    columns = [
        [str(name) for name in strained["source"].values[order]],
        [word(str(verdict)) for verdict in strained["verdict"].values[order]],
        closures,
        places,
        column(highest("force") * force_unit.per_si),
        column(highest("force_rigid") * force_unit.per_si),
        column(strained["remaining"].values[order] * 100, 1),
        column(highest("absorbed") * small.per_si),
        column(highest("strain") * small.per_si),
    ]
    return Table(
        "internal_forces",
        say("Internal forces from each source"),
        (
            say("source"),
            say("verdict"),
            say("closure"),
            say("at"),
            say("highest force, {unit}", unit=force_unit.label),
            say("without clearances, {unit}", unit=force_unit.label),
            say("remains, %"),
            say("absorbed, {unit}", unit=small.label),
            say("strain, {unit}", unit=small.label),
        ),
        tuple(zip(*columns, strict=True)),
        words=4,
        says=say(
            "{source} loads the machine most: {force} {unit} in {closure}; without clearances "
            "{rigid} {unit}.",
            source=columns[0][0],
            force=columns[4][0],
            unit=force_unit.label,
            closure=columns[2][0],
            rigid=columns[5][0],
        ),
        largest=largest_cells(
            np.stack([highest(name) for name in ("force", "force_rigid")], axis=-1), 4
        ),
        note=say(
            "Each source alone and without load, where it loads a closure most. Fits: no force "
            "even without clearances. Absorbed: the clearances take all of it; partly: some of "
            "it; strains: next to nothing."
        ),
    )


def closure_forces(study: Study) -> Table:
    """What each closure carries with all sources at their shifts and all loads."""
    strained = study.strained
    small, unit = study.units.small_length, study.units.force
    force = strained["overall_force"].values * unit.per_si
    absorbed, strain = (
        np.abs(strained[f"overall_{name}"].values).max(axis=0) * small.per_si
        for name in ("absorbed", "strain")
    )
    most = np.abs(force).max(axis=0)
    worst = where_highest(most)
    return Table(
        "closure_forces",
        say("Forces in the closures"),
        (
            say("closure"),
            say("lowest, {unit}", unit=unit.label),
            say("highest, {unit}", unit=unit.label),
            say("absorbed, {unit}", unit=small.label),
            say("strain, {unit}", unit=small.label),
        ),
        tuple(
            zip(
                [str(name) for name in strained["closure"].values],
                column(force.min(axis=0), decimals_for(force)),
                column(force.max(axis=0), decimals_for(force)),
                column(absorbed),
                column(strain),
                strict=True,
            )
        ),
        says=say(
            "{closure} carries most: {force} {unit}.",
            closure=str(strained["closure"].values[worst]),
            force=number(float(most[worst]), decimals_for(force)),
            unit=unit.label,
        ),
        largest=largest_cells(np.stack([force.min(axis=0), force.max(axis=0)], axis=-1), 1),
        note=say(
            "Over all poses: all sources at their shifts, under all loads. Tension is positive."
        ),
    )


def answers(machine: Machine, answered: Sequence[Answer]) -> Table:
    """What the machine can do against the accuracy asked: the three known numbers of each."""
    shares = {answer.coverage.probability for answer in answered if answer.coverage is not None}
    rows = [
        (
            line.name,
            line.word,
            *(
                line.text(one.value, side)
                for one, side in (
                    (line.answer.witness, 0),
                    (line.answer.linear, 0),
                    (line.answer.bound, 1),
                )
            ),
            line.asked,
            line.at(line.told),
        )
        for line in told(machine, answered)
    ]
    names = (say("witness"), say("linear maximum"), say("proven bound"))
    note = say(
        "Witness: the largest error found of one machine inside the bands, solved exactly. Linear "
        "maximum: of all of them, to first order. Proven bound: no machine inside the bands "
        "exceeds it."
    )
    if shares:
        quantile = say("{share} % quantile", share=marked(f"{100.0 * shares.pop():.6g}"))
        names = (say("confidence, lower end"), quantile, say("confidence, upper end"))
        note = say(
            "At a coverage: the quantile of the error's length at the worst pose, and the ends of "
            "its confidence interval of 99 %."
        )
    return Table(
        "answers",
        say("Against the accuracy asked"),
        ("", say("answer"), *names, say("asked"), say("at")),
        tuple(rows),
        words=2,
        says=_how_many_met(answered),
        note=note,
    )


def _how_many_met(answered: Sequence[Answer]) -> str:
    judged = [answer.met for answer in answered if answer.met is not None]
    if not judged:
        return say("No accuracy is asked.")
    return say("{met} of {judged} are met.", met=sum(judged), judged=len(judged))


def warnings(study: Study) -> Table | None:
    """What the budget warns of; None where nothing."""
    sentences = [warning["sentence"] for warning in warnings_of(study.budget)]
    rows = [(f"{text[:1].upper()}{text[1:]}.",) for text in sentences]
    return Table("warnings", say("Warnings"), ("",), tuple(rows)) if rows else None


def oddities(study: Study) -> Table | None:
    """What looks odd about the machine; None where nothing does."""
    sentences = [oddity.sentence for oddity in study.oddities]
    rows = [(f"{text[:1].upper()}{text[1:]}.",) for text in sentences]
    return Table("oddities", say("What looks odd"), ("",), tuple(rows)) if rows else None


def poses_left_out(study: Study) -> Table | None:
    """Poses that cannot be used and why, the first of them; None where all can be used."""
    count = len(study.left_out)
    if count == 0:
        return None
    rows = [
        (pose_text(pose, study.machine.commanded, study.units), reason_text(status))
        for pose, status in zip(
            study.left_out[:MOST_LISTED], study.left_out_statuses[:MOST_LISTED], strict=True
        )
    ]
    more = (
        " " + say("The first {count} are listed.", count=MOST_LISTED) if count > MOST_LISTED else ""
    )
    return Table(
        "left_out",
        say(
            "Poses left out: {count} of {every}",
            count=grouped(count),
            every=grouped(count + study.n_pose),
        ),
        (say("pose"), say("status")),
        tuple(rows),
        words=2,
        note=say("No result includes them.") + more,
    )


def _end_labels(study: Study) -> list[str]:
    """Rows of the paper's tables: both ends of a source with a band, one row otherwise."""
    lower, upper = ends()
    labels = []
    for source, band in zip(study.sources, study.has_band, strict=True):
        labels += [f"{source}, {lower}", f"{source}, {upper}"] if band else [source]
    return [*labels, say("overall, {ends}", ends=lower), say("overall, {ends}", ends=upper)]


def _highest(study: Study, of_source: str, overall: str) -> Floats:
    """(row, component) the values for `_end_labels`, SI or percent."""
    lower, upper = study.values(f"{of_source}_lower"), study.values(f"{of_source}_upper")
    rows: list[Floats] = []
    for index, band in enumerate(study.has_band):
        rows += [lower[index], upper[index]] if band else [upper[index]]
    rows += [study.values(f"{overall}_lower"), study.values(f"{overall}_upper")]
    return np.stack(rows)
