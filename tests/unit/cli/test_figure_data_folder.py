"""`truepose report --figure-data`: what is drawn on the page as files, all of it or none."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from command_line import MACHINES, call

PLANAR = MACHINES / "planar_two_slider.toml"
FEW = ("--set", "workspace.grid.x=[300, 300, 1]")


def contents(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def test_every_figure_and_table_has_its_number_and_the_files_of_before_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, html = tmp_path / "data", tmp_path / "page.html"
    folder.mkdir()
    for name in ("figure-90-ranking.csv", "table-3-x.csv", ".figure-2-distri.0123abcd.csv"):
        (folder / name).write_text("of before")
    outcome = call(capsys, "report", PLANAR, *FEW, "-o", html, "--figure-data", folder)
    assert outcome.code == 0, outcome.err
    assert f"wrote {folder}" in outcome.err
    written, text = contents(folder), html.read_text(encoding="utf-8")
    shown = re.findall(r'id="title-(?:table-)?([^"]+)"><span class="count">(\w+) (\d+)<', text)
    wanted = {f"{kind.lower()}-{number}-{name}.csv" for name, kind, number in shown}
    assert set(written) == wanted
    assert all(len(one.splitlines()) > 1 for one in written.values())
    # How many machines keep what is asked: the figure says what the command does.
    (share,) = re.findall(r"At its worst pose (\S+ %) of all machines keep", text)
    assert f"Before compensation {share} of all machines keep" in " ".join(outcome.out.split())
    # What is shown in the table stands in its file.
    (ranking,) = (
        one for name, one in written.items() if re.fullmatch(r"table-\d+-ranking.csv", name)
    )
    for cell in ranking.split("\n")[1].split(","):
        assert f">{cell}<" in text


def test_a_folder_with_other_files_is_left_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    html = tmp_path.with_name("page.html")
    outcome = call(capsys, "report", PLANAR, *FEW, "-o", html, "--figure-data", tmp_path)
    assert (outcome.code, outcome.codes) == (2, ["output-exists"])
    assert "mine.txt" in outcome.err
    assert contents(tmp_path) == {"mine.txt": "mine"}
    assert not html.exists()


def test_where_a_file_cannot_be_written_none_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, html = tmp_path / "data", tmp_path / "page.html"
    (folder / "table-1-ranking.csv").mkdir(parents=True)
    outcome = call(capsys, "report", PLANAR, *FEW, "-o", html, "--figure-data", folder)
    assert (outcome.code, outcome.codes) == (2, ["output-not-writable"])
    assert [path.name for path in folder.iterdir()] == ["table-1-ranking.csv"]
    assert not html.exists()
