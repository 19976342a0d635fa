"""Page one: its answer in a word, its dots against the table, its lines."""

from __future__ import annotations

import html
import math
import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call
from made_study import hexapod_study, planar_study
from sweeps import sweep
from truepose.reporting import how_far, page_one, tables
from truepose.reporting.study import Study
from truepose.verdict.answer import AFTER, BEFORE, MET, NOT_MET, UNDECIDED

WORDS = {
    (MET, MET): "Yes, as it is",
    (NOT_MET, MET): "Yes, with compensation",
    (UNDECIDED, MET): "Yes, with compensation",
    (MET, NOT_MET): "Yes, but not with compensation",
    (MET, UNDECIDED): "Yes, but not with compensation",
    (NOT_MET, NOT_MET): "No",
    (UNDECIDED, NOT_MET): "Undecided",
    (NOT_MET, UNDECIDED): "Undecided",
    (UNDECIDED, UNDECIDED): "Undecided",
}


def judged(before: str | None, after: str | None) -> Study:
    """A study whose position is judged so, and of which nothing else is asked."""
    study = planar_study()
    answers = {BEFORE: before, AFTER: after}
    return replace(
        study,
        accuracy=tuple(
            replace(answer, answer=answers[answer.state], asked=answer.asked or 5e-4)
            for answer in study.accuracy
            if answer.quantity == "position"
        ),
    )


@pytest.mark.parametrize(("before", "after"), list(product((MET, NOT_MET, UNDECIDED), repeat=2)))
def test_the_answer_in_a_word(before: str, after: str) -> None:
    verdict = page_one.machine_verdict(judged(before, after))
    assert verdict.word == WORDS[before, after]
    ((name, findings),) = verdict.rows
    assert name.startswith("position, asked ")
    assert [one.label for one in findings] == ["as commanded", "compensated"]


def test_where_nothing_is_asked_the_found_and_the_proven_are_told() -> None:
    study = judged(None, None)
    study = replace(study, accuracy=tuple(replace(a, asked=None) for a in study.accuracy))
    verdict = page_one.machine_verdict(study)
    assert (verdict.word, verdict.colour) == ("No accuracy is asked", "none")
    assert "accuracy.target" in page_one.to_do(study)
    for answer, finding in zip(study.accuracy, verdict.rows[0][1], strict=True):
        found, proven = map(float, re.findall(r"[\d.]+", finding.word))
        assert found == pytest.approx(answer.witness.value * 1e6, abs=0.05)
        assert proven >= answer.bound.value * 1e6 * (1.0 - 1e-6)


@pytest.mark.parametrize("study", [planar_study(), hexapod_study(3)], ids=["planar", "hexapod"])
def test_dots_are_the_numbers_of_the_table_on_one_scale(study: Study) -> None:
    rows = how_far.how_far(study)
    for plot in page_one.plots(study):
        of = {row.state: row for row in rows if row.quantity == plot.quantity}
        name_of = {name: key for key, name in page_one.ROWS.items()}
        per_si = study.units.error(plot.quantity).per_si
        scales = []
        for row in plot.rows:
            for state, dot in ((BEFORE, row.before), (AFTER, row.after)):
                size = of[state].sizes[name_of[row.name]]
                assert (dot is None) == (not math.isfinite(size))
                if dot is not None:
                    assert float(dot.text) == pytest.approx(size * per_si, rel=2e-3, abs=0.06)
                    assert 0.0 <= dot.at <= 100.0
                    scales.append((dot.at, size))
        if plot.target is not None:
            asked = study.machine.accuracy.target
            assert plot.quantity == "position"
            scales.append((plot.target.at, asked))
        at, sizes = np.array(scales).T
        np.testing.assert_allclose(at, sizes * (at.max() / sizes.max()), atol=1e-9)


def test_what_is_worst_is_first_in_the_ranking() -> None:
    study = planar_study()
    worst, _, left_out = page_one.lines(study)
    first = dict(zip(tables.ranking(study).header, tables.ranking(study).rows[0], strict=True))
    assert f" source {first['source']}: {first['share, %']} %" in worst[1]
    assert f"({first['verdict']})" in worst[1]
    assert "backlash" in left_out[1]


def test_identification_has_serial_and_date_where_the_file_says_them() -> None:
    plain = dict(page_one.of_machine(tp.load(PLANAR)))
    assert "serial number" not in plain
    named = tp.load(PLANAR, settings=["machine.serial=PKM-7", "machine.date=2026-11-26"])
    said = dict(page_one.of_machine(named))
    assert said["serial number"] == "PKM-7"
    assert said["state of"] == "2026-11-26"
    assert said["SHA-256"] == tp.load(PLANAR).file_hash


def of_page(page: str) -> list[str]:
    """The numbers of page one, as they stand there."""
    first = page[page.index('class="page-one"') : page.index('<dl class="identification">')]
    seen = re.sub(r"<(style|script|i)\b[^>]*>.*?</\1>|<[^>]*>", " ", first, flags=re.S)
    return re.findall(r"\d[\d.]*\d|\d", html.unescape(seen))


@pytest.mark.parametrize(
    "name", ["planar_two_slider", pytest.param("hexapod", marks=sweep), "linear_delta"]
)
def test_every_number_of_page_one_is_one_of_the_command(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    done = call(capsys, "report", MACHINES / f"{name}.toml", "--output", page)
    assert done.code == 0
    printed = set(re.findall(r"\d[\d.]*\d|\d", done.out))
    shown = of_page(page.read_text("utf-8"))
    assert len(shown) > 20
    magnification = {"times"}
    assert set(shown) - printed - magnification == set()
