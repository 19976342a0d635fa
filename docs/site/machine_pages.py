"""The gallery by machine: every machine of the library, its picture and its verdict, computed."""

from __future__ import annotations

from pathlib import Path

import live_pages
from drawing import machine_drawing

import truepose as tp
from truepose.machine.library import LibraryMachine, machines
from truepose.reporting.accuracy import gains, told

ROOT = Path(__file__).resolve().parents[2]
NEWLINE = "\n"
HEAD = """# Every machine and its answer

Every machine file that comes with truepose, with the accuracy that it asks and the answer to it,
before and after compensation. The numbers are computed when this page is made. `truepose init KIND`
writes the file, to be changed into yours; [classes of machines](../machines.md) explains how each
is described.
"""


def section(entry: LibraryMachine, pictures: Path, *, live: bool) -> str:
    """The section of one machine, linked to its live page; its picture goes into `pictures`."""
    machine = tp.load(ROOT / "machines" / f"{entry.kind}.toml")
    (pictures / f"{entry.kind}.svg").write_text(machine_drawing(machine), encoding="utf-8")
    answers = tp.accuracy(machine)
    asked = [shown for shown in told(machine, answers) if shown.answer.asked is not None]
    rows = [f"* **{shown.answer.answer}** {shown.line}" for shown in asked]
    rows += [f"* {sentence}" for sentence in gains(answers)]
    drives = ", ".join(f"{count} {kind}" for kind, count in entry.drives.items())
    picture = f"![{machine.name} at the middle of its workspace](pictures/{entry.kind}.svg)"
    return f"""## {machine.name}

{entry.description}

{picture}{{.machine}}

{NEWLINE.join(rows)}

{live_pages.link(entry.kind, machine.name) if live else ""}

Commanded: {", ".join(machine.commanded)}. Drives: {drives}. Parameters: {len(machine.parameters)}.
Machine file: [{entry.kind}.toml](../../machines/{entry.kind}.toml).
"""


def write(folder: Path) -> None:
    """Write the page and its pictures into the folder of the gallery."""
    pictures = folder / "pictures"
    pictures.mkdir(exist_ok=True)
    live = live_pages.can_be_written()
    text = "\n".join([HEAD, *(section(entry, pictures, live=live) for entry in machines())])
    (folder / "machines.md").write_text(text, encoding="utf-8")
