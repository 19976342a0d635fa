"""What a person sees of a result at a prompt and in a notebook: short, informative, and escaped."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path

import pytest

import truepose as tp
from build_machine import MACHINES
from made_blunders import good
from truepose.calibration.calibrate import Calibration
from truepose.calibration.planning.comparison import compare_instruments
from truepose.calibration.planning.plan import Plan, plan
from truepose.machine import Machine
from truepose.representation import MOST, Represented

SCRIPT = "<script>alert('1')</script>&\\\""


@pytest.fixture(scope="module")
def machine() -> Machine:
    return tp.load(MACHINES / "hexapod.toml")


@pytest.fixture(scope="module")
def found(machine: Machine) -> Calibration:
    return tp.calibrate(machine, good(machine, "pose", seed=1, count=20))


@pytest.fixture(scope="module")
def planned(machine: Machine, found: Calibration) -> Plan:
    return plan(machine, found.measurements.instruments, 6)


def reachable(start: object) -> Iterator[object]:
    """Every object of the package that public attributes lead to, each once."""
    waiting, seen = [start], {}
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen[id(one)] = one
        if isinstance(one, Mapping):
            waiting += one.values()
        elif isinstance(one, (tuple, list)):
            waiting += one
        elif type(one).__module__.startswith("truepose"):
            yield one
            waiting += [
                value for name, value in getattr(one, "__dict__", {}).items() if name[0] != "_"
            ]


def test_nothing_that_a_result_leads_to_fills_a_screen(
    machine: Machine, found: Calibration, planned: Plan
) -> None:
    """Whatever a public function returns, and each part of it, is told in 2,000 characters."""
    every_source = tp.load(MACHINES / "hexapod_all_sources.toml")
    delta = tp.load(MACHINES / "linear_delta.toml")
    results = {
        "calibrate": found,
        "load": every_source,
        "accuracy": tp.accuracy(machine),
        "plan": planned,
        "export": tp.export(delta, "c"),
        "Input": tp.Input.empirical([float(number) for number in range(1000)]),
        "Condition": every_source.condition,
        "instruments": compare_instruments(machine, found.measurements.instruments * 2, 6),
    }
    kinds = set()
    for name, result in results.items():
        for part in reachable(result):
            kinds.add(type(part).__name__)
            assert len(repr(part)) <= MOST, f"{type(part).__name__} of {name}"
    expected = {"Calibration", "Fit", "Gate", "Measurements", "Unknowns", "IdentificationProblem"}
    assert expected | {"Machine", "Answer", "Export", "Plan", "Comparison"} <= kinds


def test_a_calibration_tells_its_answer_and_how_much_there_was(found: Calibration) -> None:
    text = repr(found)
    assert "accepted: yes" in text
    assert f"unknowns: {len(found.gate.names)}," in text
    assert f"rows: {found.measurements.n_row}," in text
    assert f"readings: {len(found.measurements.value)}," in text
    assert "machine: Hexapod (genhexkins)" in text
    assert f"verdict: {found.gate.words[:100]}" in text


def test_the_parts_of_a_calibration_tell_their_counts(found: Calibration) -> None:
    assert "readings: 120" in repr(found.measurements)
    assert "readings: 120" in repr(found.fit)
    assert "unknowns: 42" in repr(found.fit.problem)
    assert "strut.1.base.x, strut.1.base.y" in repr(found.fit.unknowns)
    assert "determined by the data: 42" in repr(found.gate)


class Cells(HTMLParser):
    """The tags of a page, and what stands in them."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.cells: list[str] = []
        self.feed(html)
        self.close()
        assert not self.open, "a tag that is not closed"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.open.append(tag)
        for name, value in attrs:
            assert (name, value) in {
                ("scope", "row"),
                ("scope", "col"),
                ("style", "text-align: left"),
            }
        self.cells.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.cells[-1] += data


def test_a_notebook_shows_a_small_table_with_every_name_escaped(tmp_path: Path) -> None:
    text = (MACHINES / "hexapod.toml").read_text(encoding="utf-8")
    name = SCRIPT.replace("\\", "").replace('"', "")
    path = tmp_path / "named.toml"
    path.write_text(text.replace('"Hexapod (genhexkins)"', f'"{name}"', 1), encoding="utf-8")
    machine = tp.load(path)
    assert machine.name == name
    found = tp.calibrate(machine, good(machine, "pose", seed=1, count=20))
    exported = tp.export(machine, "c")
    shown = [machine, found, found.gate, found.fit, found.measurements, exported]
    for result in [*shown, *tp.accuracy(machine)]:
        assert isinstance(result, Represented)
        html = result._repr_html_()
        assert len(html) < 10_000
        assert "<script" not in html
        cells = Cells(html)
        assert set(cells.tags) - {"thead", "p"} == {"table", "caption", "tbody", "tr", "th", "td"}
        assert cells.cells[1] == type(result).__name__
        # No colour: the notebook's theme decides.
        assert "color" not in html
        assert "background" not in html
    assert name in Cells(machine._repr_html_()).cells
    assert name in Cells(found._repr_html_()).cells


def test_a_notebook_has_the_whole_verdict(found: Calibration) -> None:
    assert found.gate.words in Cells(found.gate._repr_html_()).cells


class Long(Represented):
    def __init__(self, *facts: tuple[str, object]) -> None:
        self.facts = facts

    def _facts(self) -> tuple[tuple[str, object], ...]:
        return self.facts


def test_what_is_too_long_is_cut_and_says_so() -> None:
    words = Long(("words", "word " * 1000))
    assert len(repr(words)) < 400
    assert repr(words).endswith("...>")
    assert len(repr(Long(*(("words", "word " * 1000) for _ in range(30))))) == MOST
    html = words._repr_html_()
    assert len(html) < MOST + 300
    assert "...</td>" in html


def test_values_are_told_by_what_they_are() -> None:
    values = Long(
        ("flag", True), ("none", None), ("number", 0.1234567), ("few", ("a", 2)), ("empty", ()),
        ("many", range(20)), ("lines", "one\ntwo"),
    )  # fmt: skip
    assert repr(values) == (
        "<Long flag: yes, none: none, number: 0.123457, few: a 2, empty: none, many: 20, "
        "lines: one two>"
    )
