"""The report: one HTML file with everything in it, which opens from disk without any network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from truepose.files.writing import replacing
from truepose.language import grouped, say, say_counted
from truepose.reporting import calibration, how_far, inputs, tables, uncertainty_tables
from truepose.reporting.accuracy import gains, told, where_answered
from truepose.reporting.figures import DrawnFigure, draw
from truepose.reporting.live.part import LivePart
from truepose.reporting.page_one import PageOne, page_one
from truepose.reporting.shell import Contents, page_parts, template
from truepose.reporting.study import Study
from truepose.reporting.table import Table

MACHINE = "machine_drawing"
"""The figure that stands on page one."""


def limits() -> str:
    """What a report does not say."""
    return say(
        "These results hold for the sources found in the machine file and for the poses evaluated, "
        "nothing else. Sources that the file does not name (backlash, joint clearance, wear, "
        "control and measuring errors, bending of frame, platform and guides) are not in them. A "
        "linear maximum is of first order; a witness is one machine, solved exactly; a proven "
        "bound says so, and holds at the poses that it names. Loads and temperatures act on the "
        "nominal machine at the commanded pose."
    )


@dataclass(frozen=True)
class PartShown:
    """A part on a page: its program's name, its page one, whose fault, figures, tables."""

    program: str
    page_one: PageOne
    blame: Sequence[Table]
    figures: Sequence[DrawnFigure]
    tables: Sequence[Table]
    process: str


def render(
    study: Study,
    machine_text: str = "",
    part: PartShown | None = None,
    live: LivePart | str = "",
) -> str:
    """The page as text. `machine_text` is the machine file, shown as it was read.

    `part`: what the machine makes of a program, where one is given. `live`: the live part, or why
    there is none.
    """
    return rendered(study, machine_text, part, live)[0]


def rendered(
    study: Study,
    machine_text: str = "",
    part: PartShown | None = None,
    live: LivePart | str = "",
) -> tuple[str, Contents]:
    """The same, and what stands on it, in its order."""
    results = [tables.ranking(study), tables.highest_absolute(study), tables.highest_percent(study)]
    if study.compensation is not None:
        results.append(tables.compensation(study))
    results += tables.strain(study)
    results += [tables.answers(study.machine, study.accuracy), how_far.table(study)]
    results += uncertainty_tables.tables(study)
    left_out = tables.poses_left_out(study)
    if left_out is not None:
        results.append(left_out)
    drawn = list(draw(study))
    parameters = inputs.parameters(study.machine)
    title = say("{machine} · positioning error", machine=study.machine.name)
    parts = page_parts(title, live if isinstance(live, LivePart) else None)
    text = template("page.html.jinja").render(
        machine=study.machine,
        page_one=page_one(study, None if part is None else part.page_one),
        machine_drawn=next(one for one in drawn if one.name == MACHINE),
        witnesses=[
            say(
                "{name}: the machine that is so far off has {causes}.",
                name=of.name,
                causes=of.witness,
            )
            for of in told(study.machine, study.accuracy)
            if of.witness
        ],
        gains=gains(study.accuracy),
        where_answered=where_answered(study.accuracy) if study.accuracy else "",
        figures=[one for one in drawn if one.name != MACHINE and not _of_calibration(one)],
        calibration=None if study.calibration is None else study.calibration.attrs,
        calibration_figures=[one for one in drawn if _of_calibration(one)],
        calibration_tables=[]
        if study.calibration is None
        else calibration.of_page(study.calibration, study.units),
        results=results,
        warnings=tables.warnings(study),
        oddities=tables.oddities(study),
        inputs=[
            table(study.machine)
            for table in (inputs.machine, inputs.condition, inputs.sources, inputs.deviations)
        ],
        parameters=parameters,
        machine_text=machine_text,
        part=part,
        limits=limits(),
        not_live=live if isinstance(live, str) else "",
        said=_said(study, len(parameters.rows), part),
        hashes=_hashes(study),
        **parts,
    )
    return text, parts["contents"]


def _said(study: Study, parameters: int, part: PartShown | None) -> dict[str, str]:
    """Headings and lines of the page around its content."""
    machine, attrs = study.machine, study.budget.attrs
    calibrated = study.calibration is not None
    meta = [say_counted("{count} pose evaluated", "{count} poses evaluated", study.n_pose)]
    if attrs["poses_left_out"]:
        meta.append(say("{count} left out", count=grouped(attrs["poses_left_out"])))
    meta.append(say_counted("{count} error source", "{count} error sources", len(study.sources)))
    seeded = attrs if study.monte_carlo is None else study.monte_carlo.attrs
    return {
        "kind": say("Calibration and positioning error report")
        if calibrated
        else say("Positioning error report"),
        "meta": " · ".join([*meta, f"truepose {attrs['truepose_version']}"]),
        "summary": say("Summary"),
        "calibration": say("Calibration"),
        "rests": say("What the verdict rests on"),
        "part": "" if part is None else say("The part: {program}", program=part.program),
        "figures": say("Figures"),
        "tables": say("Tables"),
        "inputs": say("Inputs"),
        "parameters": say("Parameters ({count})", count=grouped(parameters)),
        "machine_file": say("Machine file {file}", file=machine.file),
        "limits": say("What this report does not say"),
        "units": say(
            "truepose {version} · seed {seed} · lengths in {length}, errors in {small} and "
            "{angle}, base frame, R = Rz(c) Ry(b) Rx(a)",
            version=attrs["truepose_version"],
            seed=seeded["seed"],
            length=study.units.length.label,
            small=study.units.small_length.label,
            angle=study.units.small_angle.label,
        ),
    }


def _hashes(study: Study) -> list[tuple[str, str]]:
    """Every file that the report is of, and its SHA-256."""
    machine = study.machine
    hashes = [(say("Machine file {file}", file=machine.file), machine.file_hash)]
    if study.calibration is not None:
        attrs = study.calibration.attrs
        name = say("Measurements {file}", file=attrs["measurements"])
        hashes.append((name, attrs["measurements_hash"]))
    return hashes + [
        (say("Data file {file}", file=name), digest) for name, digest in machine.data_files.items()
    ]


def _of_calibration(drawn: DrawnFigure) -> bool:
    """Whether a figure stands with the calibration, before what the machine as filed does."""
    return drawn.needs == "calibration"


def write(study: Study, path: Path, machine_text: str = "", part: PartShown | None = None) -> None:
    """Write the page to `path`, whole or not at all."""
    write_text(render(study, machine_text, part), path)


def write_text(text: str, path: Path) -> None:
    """Write a page that is rendered, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
