"""What tests compile is kept by what it is made of, and only when it is whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from built_once import built_once


def test_the_same_is_built_once_and_another_beside_it(tmp_path: Path) -> None:
    asked = []

    def build(text: str) -> Path:
        def write(scratch: Path) -> None:
            asked.append(text)
            (scratch / "made").write_text(text)

        return built_once(tmp_path, ["command", text], write)

    first, again, other = build("a"), build("a"), build("b")
    assert asked == ["a", "b"]
    assert first == again
    assert first != other
    assert [(place / "made").read_text() for place in (first, other)] == ["a", "b"]


def test_what_fails_is_not_kept(tmp_path: Path) -> None:
    def fail(scratch: Path) -> None:
        (scratch / "half").write_text("")
        raise ValueError("no")

    def succeed(scratch: Path) -> None:
        (scratch / "whole").write_text("")

    with pytest.raises(ValueError, match="no"):
        built_once(tmp_path, ["x"], fail)
    assert [path.name for path in built_once(tmp_path, ["x"], succeed).iterdir()] == ["whole"]


def test_the_first_of_two_workers_stays(tmp_path: Path) -> None:
    def slowly(scratch: Path) -> None:
        built_once(tmp_path, ["x"], lambda other: (other / "first").write_text(""))
        (scratch / "second").write_text("")

    assert [path.name for path in built_once(tmp_path, ["x"], slowly).iterdir()] == ["first"]
