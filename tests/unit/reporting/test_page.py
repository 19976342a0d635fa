"""The page is one file that asks for nothing, and shows what it was given as text, not as code."""

from __future__ import annotations

import dataclasses
import json
import re

import plotly.io
import pytest
from plotly.offline import get_plotlyjs

from made_how_sure import sure_study
from made_study import hexapod_study, planar_study
from truepose.reporting import page
from truepose.reporting.figures import FIGURES
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
    assert "@import" not in planar.partition("<script>")[0]


def test_the_library_is_there_once(planar: str) -> None:
    assert planar.count("Copyright 2012-") == get_plotlyjs().count("Copyright 2012-") == 1
    assert len(planar) < len(get_plotlyjs()) + 3e5


def test_what_is_taken_from_plotly_is_what_it_gives_itself(planar: str) -> None:
    assert get_plotlyjs() in planar
    (template,) = re.findall(r"^const TEMPLATE = (.*);$", planar, flags=re.MULTILINE)
    given = plotly.io.templates["plotly_white"].to_plotly_json()
    assert json.loads(template) == json.loads(json.dumps(given))


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
    assert page.LIMITS.partition(".")[0] in planar


def test_a_study_without_compensation_has_a_page() -> None:
    study = hexapod_study(2)
    before = [answer for answer in study.accuracy if answer.state == BEFORE]
    study = dataclasses.replace(study, compensation=None, accuracy=tuple(before), sampled=())
    text = without_scripts(page.render(study))
    assert "before_after" not in text
    assert "after compensation" not in text


def test_a_large_workspace_stays_a_small_file() -> None:
    assert len(page.render(planar_study(200))) < 9e6
