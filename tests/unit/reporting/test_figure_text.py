"""Names that read like markup are drawn as they stand in the machine file."""

from __future__ import annotations

import html
import re

import pytest

import truepose
from build_machine import MACHINES
from truepose.reporting import assembly
from truepose.reporting.figures import draw
from truepose.reporting.figures._plot import Plot, trace
from truepose.reporting.figures._text import NO_BOX, as_text

MARKUP = "<u>U</u><br>&amp;"


@pytest.fixture(scope="module")
def texts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """Every text of every figure of a machine whose parts have such names."""
    text = (MACHINES / "planar_two_slider.toml").read_text()
    named = re.sub(r'^(name|drive) = "(.+)"$', rf'\1 = "\2{MARKUP}"', text, flags=re.M)
    assert named != text
    file = tmp_path_factory.mktemp("machine") / "machine.toml"
    file.write_text(named)
    study = assembly.study(truepose.load(file))
    return {drawn.name: texts_of([drawn.figure.data, drawn.figure.layout]) for drawn in draw(study)}


def texts_of(value: object) -> list[str]:
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [text for each in value.values() for text in texts_of(each)]
    if hasattr(value, "tolist"):
        value = value.tolist()
    return (
        [text for each in value for text in texts_of(each)]
        if isinstance(value, list | tuple)
        else []
    )


def test_no_tag_of_a_name_is_one_of_the_figure(texts: dict[str, list[str]]) -> None:
    assert len(texts) > 8
    for name, found in texts.items():
        for text in found:
            tags = set(re.findall(r"<[^>]*>?", text.removesuffix(NO_BOX)))
            assert tags <= {"<br>"}, (name, text)


def test_the_names_are_there_as_they_stand_in_the_file(texts: dict[str, list[str]]) -> None:
    drawn = [html.unescape(text) for text in texts["tornado"]]
    # Long names are cut, and none of them is ours.
    assert any(text.startswith("strut.1<u>U") for text in drawn), drawn
    assert not any("<u" in text for text in texts["tornado"])


def test_lines_end_where_the_text_says_so() -> None:
    hover = f"%{{x}} & more{NO_BOX}"
    plot = Plot(trace("scatter", x=[1.0], y=[2.0], name="a\nb <br>", hovertemplate=hover))
    plot.update_layout(title={"text": "<i>"})
    marked = as_text(plot)
    assert marked.data[0]["name"] == "a<br>b &lt;br&gt;"
    assert marked.data[0]["hovertemplate"] == "%{x} &amp; more<extra></extra>"
    assert marked.data[0]["x"] == [1.0]
    assert marked.layout == {"title": {"text": "&lt;i&gt;"}}
