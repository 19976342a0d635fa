"""The page is one file that asks for nothing, and shows what it was given as text, not as code."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import re

import plotly.io
import pytest
from plotly.offline import get_plotlyjs

from made_how_sure import sure_study
from made_study import hexapod_study, planar_study
from page_data import figures_of, unpacked
from truepose.reporting import page, shell
from truepose.reporting.figures import FIGURES, draw
from truepose.reporting.figures._json import as_json
from truepose.reporting.table import Table
from truepose.verdict.answer import BEFORE


@pytest.fixture(scope="module")
def planar() -> str:
    return page.render(sure_study(planar_study()), 'name = "<b>bold</b> & co"\n')


def without_scripts(text: str) -> str:
    return re.sub(r"<(script|style)\b.*?</\1>", "", text, flags=re.DOTALL)


def test_it_asks_for_nothing_from_outside(planar: str) -> None:
    assert not re.findall(r"<(?:script|img|iframe)[^>]*\ssrc=", planar)
    links = re.findall(r'\s(?:href|src)="([^"]*)"', without_scripts(planar))
    assert all(link.startswith(("#", "data:")) for link in links)
    assert "@import" not in planar


def test_the_policy_lets_the_one_script_run_that_is_there(planar: str) -> None:
    policy = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', planar)
    (script,) = re.findall(r"<script>(.*?)</script>", planar, flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy == [
        "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; "
        f"script-src 'sha256-{digest}' 'strict-dynamic'; base-uri 'none'; form-action 'none'"
    ]
    assert not re.findall(r"<[^>]* on\w+=", without_scripts(planar))


def test_the_library_is_there_once_and_small(planar: str) -> None:
    assert unpacked(planar, "plotly").decode() == get_plotlyjs()
    assert len(planar) < 0.55 * len(get_plotlyjs())


def test_what_is_taken_from_plotly_is_what_it_gives_itself(planar: str) -> None:
    given = plotly.io.templates["plotly_white"].to_plotly_json()
    assert figures_of(planar)["template"] == json.loads(json.dumps(given))


def test_the_figures_data_are_those_of_the_figures() -> None:
    study = planar_study()
    figures = figures_of(page.render(study))["figures"]
    wanted = {
        one.name: {"data": one.figure.data, "layout": one.figure.layout} for one in draw(study)
    }
    assert figures == json.loads(as_json(wanted))


def test_the_same_study_gives_the_same_bytes() -> None:
    assert page.render(planar_study()) == page.render(planar_study())


def test_figures_and_tables_are_numbered_as_they_stand(planar: str) -> None:
    for kind in ("Figure", "Table"):
        numbers = re.findall(rf'<span class="count">{kind} (\d+)</span>', planar)
        assert numbers == [str(number + 1) for number in range(len(numbers))]
        assert len(numbers) > 9
    contents = re.findall(r'<a href="#(\w+)"><span>(\d+)</span> ([^<]*)</a>', planar)
    headings = re.findall(
        r'<h3 id="title-(\w+)"><span class="count">Figure (\d+)</span> ([^<]*)</h3>', planar
    )
    assert contents == headings


def test_the_largest_cells_are_marked() -> None:
    table = Table("t", "T", ("a", "b"), (("x", "1"), ("y", "2")), largest=frozenset({(1, 1)}))
    contents = shell.Contents()
    macros = shell.template("macros.html.jinja").make_module(
        {"contents": contents, "words": shell.page_parts("")["words"]}
    )
    text = str(macros.grid(table))  # type: ignore[attr-defined]
    assert '<td class="number largest">2</td>' in text
    assert '<td class="number">1</td>' in text
    assert "Bold: the largest" in text


def test_the_foot_of_a_printed_page_counts() -> None:
    assert shell.page_parts("")["page_number"] == '"page " counter(page) " of " counter(pages) ""'


@pytest.mark.parametrize("title", ['a" } </style><b>', "Größe\\ \n}", "plain · 1"])
def test_a_title_stays_one_text_of_css(title: str) -> None:
    text = shell.css_text(title)
    assert re.fullmatch(r'"(?:[^"\\\n<]|\\[0-9a-f]+ )*"', text)
    again = re.sub(r"\\([0-9a-f]+) ", lambda found: chr(int(found[1], 16)), text[1:-1])
    assert again == title


def test_every_figure_has_its_place_and_every_link_its_target(planar: str) -> None:
    for module in FIGURES:
        name = module.__name__.rpartition(".")[2]
        assert f'id="{name}"' in planar
        assert f'id="figure-{name}"' in planar
    body = without_scripts(planar)
    for target in re.findall(r'href="#([^"]+)"', body):
        assert f'id="{target}"' in body


def test_text_of_the_user_is_escaped(planar: str) -> None:
    assert "&lt;b&gt;bold&lt;/b&gt; &amp; co" in planar
    assert "<b>bold</b>" not in planar


def test_a_hostile_name_stays_a_name() -> None:
    study = planar_study()
    study.machine.name = "</title><script>alert(1)</script>"
    assert "<script>alert(1)" not in page.render(study)


def test_provenance_is_on_the_page(planar: str) -> None:
    study = planar_study()
    assert study.machine.file_hash in planar
    for name, digest in study.machine.data_files.items():
        assert f"Data file {name} · SHA-256 <code>{digest}" in planar
    assert "truepose 0.0.0" in planar
    assert "SHA-256" in planar
    assert page.limits().partition(".")[0] in planar


def test_a_study_without_compensation_has_a_page() -> None:
    study = hexapod_study(2)
    before = [answer for answer in study.accuracy if answer.state == BEFORE]
    study = dataclasses.replace(study, compensation=None, accuracy=tuple(before), sampled=())
    text = without_scripts(page.render(study))
    assert "before_after" not in text
    assert "after compensation" not in text


def test_a_large_workspace_stays_a_small_file() -> None:
    assert len(page.render(planar_study(200))) < 5e6
