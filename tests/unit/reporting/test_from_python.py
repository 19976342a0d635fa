"""`tp.check`, `tp.compare`, `tp.report`: what Python has is what the command says."""

from __future__ import annotations

import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import plotly.graph_objects as go
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call
from truepose.errors import ArgumentError, RequestError
from truepose.reporting import check, compare, drawing_packages
from truepose.reporting.figures import draw_one, machine_drawing
from truepose.reporting.report import MachineReport

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod"])
def test_a_check_reads_as_the_command_prints_it(name: str, capsys: Capture) -> None:
    file = MACHINES / f"{name}.toml"
    found = tp.check(tp.load(file))
    printed = call(capsys, "check", file)
    assert str(found) == printed.out.rstrip("\n")
    assert (found.met is False) == bool(printed.code)
    data = json.loads(call(capsys, "check", file, "--format", "json").out)
    assert found.as_data() == data
    assert [answer["answer"] for answer in data["answers"]] == [a.answer for a in found.answers]
    table = call(capsys, "check", file, "--format", "csv").out
    assert check.text(found, "csv") == table.rstrip("\n")


def test_what_looks_odd_is_in_a_check(capsys: Capture) -> None:
    hot = "condition.temperature=308"
    found = tp.check(tp.load(PLANAR, [hot]))
    assert [oddity.code for oddity in found.oddities] == ["odd-temperature"]
    assert str(found) == call(capsys, "check", PLANAR, "--set", hot).out.rstrip("\n")
    assert str(found).startswith("looks odd[odd-temperature]: ")


def test_a_comparison_reads_as_the_command_prints_it(capsys: Capture, tmp_path: Path) -> None:
    other = tmp_path / "new.toml"
    text = PLANAR.read_text(encoding="utf-8")
    other.write_text(text.replace("\nlength = 500", "\nlength = 502", 1), encoding="utf-8")
    old, new = tp.load(PLANAR), tp.load(other)
    found = tp.compare(old, new)
    printed = call(capsys, "compare", PLANAR, other)
    assert str(found) == printed.out.rstrip("\n")
    assert found.changed is bool(printed.code) is True
    assert found.verdict in printed.out
    asked = call(capsys, "compare", PLANAR, other, "--format", "json").out
    assert "".join(compare.text(found, "json")) == asked
    assert not tp.compare(old, old).changed
    one = tp.compare(old, new, [0.3, 0.2])
    assert one.dataset.sizes["pose"] == 1
    with pytest.raises(RequestError, match="not"):
        tp.compare(old, tp.load(MACHINES / "hexapod.toml"))


class Shown(HTMLParser):
    """What stands in an HTML fragment, which has to be whole and without style but alignment."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag in {"table", "caption", "thead", "tbody", "tr", "th", "td", "p"}
        assert {name for name, _ in attrs} <= {"scope", "style"}
        assert dict(attrs).get("style") in {None, "text-align: left"}
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        self.text += " "

    def handle_data(self, data: str) -> None:
        self.text += data


def numbers(text: str) -> set[str]:
    """All numbers in a text."""
    return set(re.findall(r"\d[\d,.]*\d|\d", text))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("report") / "python.html"


@pytest.fixture(scope="module")
def written(page: Path) -> MachineReport:
    return tp.report(tp.load(PLANAR), page)


def test_a_report_writes_the_page_of_the_command(
    written: Any, page: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert written.path == page
    other = page.with_name("command.html")
    printed = call(capsys, "report", PLANAR, "--output", other)
    # The file's text is on the page where the file lies beside you.
    assert PLANAR.read_text("utf-8") in unescape(other.read_text("utf-8"))
    monkeypatch.chdir(PLANAR.parent)
    tp.report(tp.load(PLANAR), page)
    assert page.read_bytes() == other.read_bytes()
    assert written.met == {"before compensation": False, "after compensation": False}
    html = Shown(written._repr_html_()).text
    assert "Is the machine good enough?" in html
    assert numbers(html) - numbers(str(page)) <= numbers(printed.out)
    assert {"682.5", "500.2"} <= numbers(html)


def test_a_report_in_another_language(tmp_path: Path) -> None:
    report = tp.report(tp.load(PLANAR), tmp_path / "page.html", language="de")
    assert '<html lang="de">' in (tmp_path / "page.html").read_text("utf-8")
    assert report.language == "de"
    assert "682,5" in report._repr_html_()


def test_what_a_report_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = tp.load(PLANAR)
    monkeypatch.chdir(tmp_path)
    for given in ({"output": "page.txt"}, {"features": "a.toml"}, {"language": "tlh"}):
        with pytest.raises(RequestError):
            tp.report(machine, **given)
    with pytest.raises(ArgumentError):
        tp.report(machine, measurements=3)  # type: ignore[arg-type]
    absent = ImportError("no plotly", name="plotly")
    monkeypatch.setattr(drawing_packages, "import_module", Mock(side_effect=absent))
    for drawing in (tp.report, tp.Machine.plot):
        with pytest.raises(RequestError, match="not installed") as refused:
            drawing(machine)
        assert refused.value.problems[0].code == "extra-missing"
    assert list(tmp_path.iterdir()) == []


def test_a_figure_shows_itself_and_is_written(written: Any, tmp_path: Path) -> None:
    shown = tp.load(PLANAR).plot("machine_drawing")
    bundle = shown._repr_mimebundle_()
    figure = bundle["application/vnd.plotly.v1+json"]
    assert json.loads(json.dumps(figure, allow_nan=False)) == figure
    # plotly's own classes refuse what plotly.js would not draw.
    assert len(go.Figure(figure).data) == len(figure["data"])
    drawn = draw_one(written.study, machine_drawing).figure
    for ours, theirs in zip(figure["data"], drawn.data, strict=True):
        np.testing.assert_array_equal(np.array(ours["x"], float), np.asarray(theirs["x"], float))
    assert shown.says in unescape(Shown(bundle["text/html"]).text)
    shown.write(tmp_path / "one.html")
    shown.write(tmp_path / "one.json")
    assert 'id="figure-machine_drawing"' in (tmp_path / "one.html").read_text("utf-8")
    assert json.loads((tmp_path / "one.json").read_text("utf-8")) == figure
    assert written.plot("tornado").figure["data"]


@pytest.mark.parametrize("name", ["nothing", "over_time", "error_over_time", "calibration_map"])
def test_a_figure_that_is_not_there(name: str) -> None:
    with pytest.raises(RequestError) as refused:
        tp.load(PLANAR).plot(name)
    assert refused.value.problems[0].code == "unknown-choice"


def test_a_notebook_has_the_numbers_of_the_command(capsys: Capture, tmp_path: Path) -> None:
    named = '<b>&"it"</b>'
    text = PLANAR.read_text(encoding="utf-8")
    file = tmp_path / "m.toml"
    file.write_text(text.replace('"Planar two-slider PKM"', f"'{named}'", 1), encoding="utf-8")
    machine = tp.load(file)
    printed = " ".join(call(capsys, "check", file).out.split())
    answers = tp.accuracy(machine)
    checked, compared = tp.check(machine), tp.compare(machine, machine)
    fragments = [answers, *answers, machine, checked, compared]
    shown = [Shown(fragment._repr_html_()).text for fragment in fragments]
    assert shown[0].count("NOT met") == 2
    for html in shown[1:5]:
        assert named in html
    assert compared.verdict in shown[5]
    for html in (*shown[:3], shown[4]):
        assert {"682.5", "500.2"} & numbers(html)
        assert numbers(html) <= numbers(printed)
    poses = " ".join(map(str, (200, 400, 100, 300)))
    assert numbers(shown[3].replace(f"SHA-256 {machine.file_hash}", "")) <= numbers(printed + poses)
    data = json.loads(call(capsys, "check", file, "--format", "json").out)
    assert data["machine"]["hash"] in shown[3]
