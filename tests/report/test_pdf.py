"""The report as PDF, read by poppler; and a browser that does not do what it should."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from browser import CHROMIUM
from command_line import MACHINES, call
from made_how_sure import sure_study
from made_study import planar_study
from system_package import missing
from truepose.errors import RequestError
from truepose.reporting import page, pdf
from truepose.reporting.page_one import PageOne
from truepose.reporting.table import Table

ROWS = 120
POINTS = {"A4": (595.3, 841.9), "Letter": (612.0, 792.0)}


@dataclass
class Printed:
    """A PDF file, and what poppler says of it."""

    file: Path
    info: dict[str, str]
    pages: list[str]


def read(file: Path) -> Printed:
    found = {program: shutil.which(program) or "" for program in ("pdfinfo", "pdftotext")}
    if not all(found.values()):
        missing("poppler is not installed: apt-get install poppler-utils")
    told = subprocess.run(
        [found["pdfinfo"], file], check=True, capture_output=True, text=True
    ).stdout
    text = subprocess.run(
        [found["pdftotext"], "-layout", file, "-"], check=True, capture_output=True, text=True
    ).stdout
    info = dict(re.findall(r"^(.+?): +(.*)$", told, re.M))
    return Printed(file, info, text.split("\f")[:-1])


@pytest.fixture(scope="module", params=["A4", "Letter"])
def printed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Printed:
    if not Path(CHROMIUM).exists():
        missing("chromium is not installed: apt-get install chromium")
    file = tmp_path_factory.mktemp("printed") / "report.pdf"
    table = Table(
        "long",
        "Long",
        ("row", "deviation of the row"),
        tuple((f"row {at} ", "1") for at in range(ROWS)),
    )
    part = page.PartShown("part.ngc", PageOne((), (), (), ()), [], [], [table], "")
    text = page.render(sure_study(planar_study()), "schema = 1\n", part)
    pdf.write(text, file, request.param, CHROMIUM)
    return read(file)


def test_every_page_is_of_the_paper_and_has_its_number(
    printed: Printed, request: pytest.FixtureRequest
) -> None:
    paper = request.node.callspec.params["printed"]
    width, height = map(float, re.findall(r"[\d.]+", printed.info["Page size"])[:2])
    assert (width, height) == pytest.approx(POINTS[paper], abs=1.0)
    count = int(printed.info["Pages"])
    assert count == len(printed.pages)
    for number, text in enumerate(printed.pages, start=1):
        assert f"page {number} of {count}" in text
    assert 9 <= count <= 20


def test_page_one_is_a_page_and_the_others_have_a_running_title(printed: Printed) -> None:
    first, *others = printed.pages
    machine = planar_study().machine.name
    assert machine in first
    assert "NOT met" in first
    assert "Figures" not in first
    title = f"{machine} · positioning error"
    assert title not in first
    assert all(title in text for text in others)


def test_two_figures_stand_on_a_page_and_are_read_there(printed: Printed) -> None:
    counts = [len(re.findall(r"^ *Figure \d+ ", text, re.M)) for text in printed.pages]
    assert counts.count(2) >= 3
    everything = " ".join("".join(printed.pages).split())
    for folded in ("the dashed outline before", "drive.d1.axis.u", "schema = 1"):
        assert folded in everything


def test_it_says_what_it_is_and_not_where_it_was(printed: Printed) -> None:
    assert printed.info["Title"] == f"{planar_study().machine.name} · positioning error"
    content = printed.file.read_bytes()
    assert b"/Lang (en)" in content
    everything = "".join([*printed.pages, *printed.info.values(), content.decode("latin-1")])
    for path in ("file://", "about:blank", str(printed.file.parent)):
        assert path not in everything


def test_a_table_that_is_broken_has_its_head_again(printed: Printed) -> None:
    with_head = [text for text in printed.pages if re.search("deviation of the row", text)]
    rows = [re.findall(r"row (\d+) ", text) for text in with_head]
    assert len(with_head) >= 2
    assert all(rows)
    assert [int(row) for page_rows in rows for row in page_rows] == list(range(ROWS))


def test_the_command_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command line up to the browser, which is another program here."""
    asked: list[tuple[str, str, str]] = []

    def printed(page: str, paper: str, browser: str) -> bytes:
        asked.append((page[:15], paper, browser))
        return b"%PDF"

    monkeypatch.setattr(pdf, "printed", printed)
    monkeypatch.setattr(pdf, "unprotected", lambda: True)
    monkeypatch.setenv(pdf.BROWSER, "/bin/sh")
    machine, file = MACHINES / "planar_two_slider.toml", tmp_path / "planar.pdf"
    outcome = call(capsys, "report", machine, "-o", file, "--paper", "letter")
    assert outcome.code == 0
    assert file.read_bytes() == b"%PDF"
    assert asked == [("<!doctype html>", "Letter", "/bin/sh")]
    assert "as root /bin/sh runs without its sandbox" in outcome.err
    outcome = call(capsys, "report", machine, "-o", tmp_path / "a.html", "--paper", "A4")
    assert outcome.code == 2
    assert "--paper goes with" in outcome.err


def test_no_browser_is_told_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(pdf.BROWSER, str(tmp_path / "none"))
    monkeypatch.setattr(page, "render", None)
    file = tmp_path / "planar.pdf"
    outcome = call(capsys, "report", MACHINES / "planar_two_slider.toml", "-o", file)
    assert outcome.code == 2
    assert "error[no-browser]" in outcome.err
    assert "apt-get install chromium" in outcome.err
    with pytest.raises(RequestError) as caught:
        pdf.installed_browser({pdf.BROWSER: "no-such-browser"})
    assert [problem.code for problem in caught.value.problems] == ["no-browser"]


def script(folder: Path, body: str) -> str:
    file = folder / "browser"
    file.write_text(f"#!/bin/sh\n{body}\n")
    file.chmod(0o755)
    return str(file)


def test_a_browser_that_never_answers_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pdf, "PATIENCE", 1.0)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.setattr("tempfile.tempdir", None)
    (tmp_path / "temporary").mkdir()
    here = tmp_path / "process"
    browser = script(tmp_path, f"echo $$ > {here}; trap '' TERM; exec sleep 1000")
    with pytest.raises(RequestError, match="not done after 1 s"):
        pdf.write("<p>", tmp_path / "page.pdf", browser=browser)
    process = Path("/proc") / here.read_text().strip()
    assert not process.exists()
    assert list((tmp_path / "temporary").iterdir()) == []
    assert not (tmp_path / "page.pdf").exists()


@pytest.mark.parametrize(
    ("body", "how"),
    [
        ("exit 1", "it ended"),
        ("""printf '{"id":1,"error":{"message":"not today"}}\\0' >&4; sleep 1""", "not today"),
    ],
)
def test_what_a_browser_says_is_told(tmp_path: Path, body: str, how: str) -> None:
    with pytest.raises(RequestError, match=how) as caught:
        pdf.printed("<p>", "A4", script(tmp_path, body))
    assert caught.value.problems[0].code == "browser-failed"
