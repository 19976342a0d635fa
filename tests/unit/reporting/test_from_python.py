"""`tp.check`, `tp.compare`, `tp.report`: what Python has is what the command says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call
from truepose.errors import RequestError
from truepose.reporting import check, compare

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
