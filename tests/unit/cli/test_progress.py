"""Progress shows where someone looks, and only when the work is long."""

from __future__ import annotations

import pytest

from truepose.cli import _progress


def shown(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *, patience: float
) -> str:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setattr(_progress, "PATIENCE", patience)
    monkeypatch.setenv("TERM", "xterm")
    with _progress.progress("error budget") as report:
        assert report is not None
        report(8192, 30000)
        report(16384, 30000)
    return capsys.readouterr().err


def test_long_work_shows_a_bar(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "error budget" in shown(capsys, monkeypatch, patience=-1.0)


def test_short_work_shows_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert shown(capsys, monkeypatch, patience=60.0) == ""


def test_nothing_where_nobody_looks(capsys: pytest.CaptureFixture[str]) -> None:
    with _progress.progress("error budget") as report:
        assert report is None
    assert capsys.readouterr().err == ""
