"""Pages of results: sections of lines that stay, of which a run replaces its own.

A section has a heading, a line for each version that says where and how long it ran, and a table
with a line for each figure and version. A run replaces what the page says of the same section and
version, and of the same figures there; lines of other versions stay below the newest, so that a
later slowdown is seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

VERSION = "version"


@dataclass
class Section:
    """What a page says of one benchmark."""

    runs: dict[str, str] = field(default_factory=dict)
    """Where and how long each version ran."""
    lines: list[tuple[str, ...]] = field(default_factory=list)
    """Cells of the table: first the figure, then the version."""

    def replace(self, version: str, run: str, lines: Iterable[Sequence[str]]) -> None:
        """Put the lines of a run of one version in the place of those of that version before.

        A figure's versions stand together, the newest run first; a figure that the run no longer
        has stays with its other versions, after the rest.
        """
        new: list[tuple[str, ...]] = [(cells[0], version, *cells[1:]) for cells in lines]
        others = [cells for cells in self.lines if cells[1] != version]
        self.lines = []
        for cells in new:
            self.lines += [cells, *(other for other in others if other[0] == cells[0])]
        figures = {cells[0] for cells in new}
        self.lines += [other for other in others if other[0] not in figures]
        self.runs = {version: run} | {
            old: said for old, said in self.runs.items() if old != version
        }

    def update(self, version: str, run: str, lines: Iterable[Sequence[str]]) -> None:
        """Put lines of one version in the place of those of the same figures and version.

        All others stay, as of a section of which only a part ran.
        """
        own = {cells[0]: (cells[0], *cells[2:]) for cells in self.lines if cells[1] == version}
        own |= {cells[0]: tuple(cells) for cells in lines}
        self.replace(version, run, own.values())


@dataclass
class Page:
    """A file of results."""

    head: list[str]
    columns: Sequence[str]
    """Headings of the table after figure and version."""
    sections: dict[str, Section] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path, head: list[str], columns: Sequence[str]) -> Page:
        """The page as it stands, with a head of now; one without sections where no file is.

        Raises `ValueError` where a table has another number of columns.
        """
        page = cls(head, columns)
        if not path.exists():
            return page
        section = Section()
        for line in path.read_text("utf-8").splitlines():
            if line.startswith("## "):
                section = page.sections.setdefault(line.removeprefix("## "), Section())
            elif page.sections and line.startswith("* "):
                version, _, run = line.removeprefix("* ").partition(": ")
                section.runs[version] = run
            elif page.sections and line.startswith("| ") and not page.is_heading(line):
                cells = tuple(cell.strip() for cell in line.strip("|").split(" | "))
                if len(cells) != 2 + len(columns):
                    raise ValueError(f"{path}: {len(cells)} columns in: {line}")
                section.lines.append(cells)
        return page

    def is_heading(self, line: str) -> bool:
        """Whether a line of a table is its heading."""
        return line.startswith(f"| what | {VERSION} |")

    def text(self, order: Iterable[str] = ()) -> str:
        """The whole file; sections in the order given, others after them as they stood."""
        names = dict.fromkeys([name for name in order if name in self.sections])
        names |= dict.fromkeys(self.sections)
        return "\n".join([*self.head, *(line for name in names for line in self._of(name))]) + "\n"

    def _of(self, name: str) -> Iterator[str]:
        section = self.sections[name]
        yield ""
        yield f"## {name}"
        yield ""
        for version, run in section.runs.items():
            yield f"* {version}: {run}"
        yield ""
        columns = ("what", VERSION, *self.columns)
        yield f"| {' | '.join(columns)} |"
        yield f"|{'---|' * len(columns)}"
        for cells in section.lines:
            yield f"| {' | '.join(cells)} |"

    def seconds(self, names: Iterable[str], version: str) -> Mapping[str, float]:
        """How long each section ran: that version where there is one, else the newest."""
        said = {}
        for name in names:
            runs = self.sections[name].runs if name in self.sections else {}
            run = runs.get(version, next(iter(runs.values()), ""))
            number, _, rest = run.partition(" s")
            if rest.startswith(";"):
                said[name] = float(number)
        return said
