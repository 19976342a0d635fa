"""Pages of benchmark results: a run replaces its own lines, and only these."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import BENCHMARKS
from benchmarks.__main__ import COLUMNS, HEAD, RESULTS
from benchmarks.rows import Row
from benchmarks.tables import Page, Section

HEADINGS = ("measured", "behind it")


def page_of(path: Path) -> Page:
    return Page.read(path, ["# Results"], HEADINGS)


def written(path: Path) -> Path:
    page = page_of(path)
    for name in ("one", "other"):
        section = page.sections.setdefault(name, Section())
        section.replace("1.0", f"3 s; {name}", [(f"a of {name}", "1 x", ""), ("b", "2 x", "c; d")])
    path.write_text(page.text(), "utf-8")
    return path


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path / "results.md")
    page = page_of(path)
    assert page.text() == path.read_text("utf-8")
    assert page.sections["one"].lines == [
        ("a of one", "1.0", "1 x", ""),
        ("b", "1.0", "2 x", "c; d"),
    ]
    assert page.sections["other"].runs == {"1.0": "3 s; other"}


def test_a_run_replaces_the_lines_of_its_section_and_version(tmp_path: Path) -> None:
    path = written(tmp_path / "results.md")
    page = page_of(path)
    before = page_of(path).sections["other"]
    page.sections["one"].replace("1.0", "4 s; again", [("b", "5 x", "")])
    assert page.sections["one"].lines == [("b", "1.0", "5 x", "")]
    assert page.sections["one"].runs == {"1.0": "4 s; again"}
    assert page.sections["other"] == before


def test_lines_of_other_versions_stay_with_their_figure(tmp_path: Path) -> None:
    section = page_of(written(tmp_path / "results.md")).sections["one"]
    section.replace("1.1", "2 s; newer", [("b", "7 x", ""), ("new", "1 x", "")])
    assert [cells[:3] for cells in section.lines] == [
        ("b", "1.1", "7 x"),
        ("b", "1.0", "2 x"),
        ("new", "1.1", "1 x"),
        ("a of one", "1.0", "1 x"),
    ]
    assert list(section.runs) == ["1.1", "1.0"]
    section.replace("1.1", "2 s; once more", [("b", "8 x", "")])
    assert [cells[:3] for cells in section.lines] == [
        ("b", "1.1", "8 x"),
        ("b", "1.0", "2 x"),
        ("a of one", "1.0", "1 x"),
    ]


def test_sections_stand_in_the_order_asked_for(tmp_path: Path) -> None:
    text = page_of(written(tmp_path / "results.md")).text(["third", "other"])
    assert text.index("## other") < text.index("## one")


def test_durations_are_those_of_the_version_or_of_the_newest(tmp_path: Path) -> None:
    page = page_of(written(tmp_path / "results.md"))
    page.sections["one"].replace("1.1", "2 s; newer", [])
    page.sections["other"].runs = {"1.0": "no time told, 5 sources"}
    assert page.seconds(["one", "other", "none"], "1.0") == {"one": 3.0}
    assert page.seconds(["one"], "2.0") == {"one": 2.0}


def test_a_table_of_other_columns_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "results.md")
    with pytest.raises(ValueError, match="4 columns"):
        Page.read(path, [], ("measured",))


def test_a_cell_may_be_empty_and_a_figure_without_a_unit() -> None:
    assert Row("w", 1.0, "", "at most", None, "d").cells() == ("w", "1", "", "", "d")
    assert Row("w", 1.04, "", "at most", 1.1, "").cells() == ("w", "1.04", "at most 1.1", "met", "")
    assert Row("w", 2.0, "x", "at most", 1.1, "").cells()[2:4] == ("at most 1.1 x", "**missed**")


def test_the_committed_results_are_of_benchmarks_that_there_are() -> None:
    page = Page.read(RESULTS, HEAD.splitlines(), COLUMNS)
    names = [benchmark.name for benchmark in BENCHMARKS]
    assert set(page.sections) <= set(names)
    assert page.text(names) == RESULTS.read_text("utf-8")


def test_every_benchmark_is_a_module() -> None:
    folder = RESULTS.parent
    missing = [one.name for one in BENCHMARKS if not (folder / f"{one.name}.py").exists()]
    assert missing == []
