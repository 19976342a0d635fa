"""Progress shows where someone looks, and only when the work is long."""

from __future__ import annotations

import time

import pytest

from truepose.cli import _progress


def shown(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    *,
    patience: float,
    total: int = 30000,
) -> str:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setattr(_progress, "PATIENCE", patience)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with _progress.progress("error budget") as report:
        assert report is not None
        report(8192, total)
        report(16384, total)
    return capsys.readouterr().err


def test_long_work_shows_a_bar_with_its_rate_and_the_time_left(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = shown(capsys, monkeypatch, patience=-1.0)
    assert "error budget" in said
    assert "16.4 k of 30 k poses" in said
    assert "/s, 0:00 left" in said


def test_work_of_unknown_length_shows_a_bar_without_the_time_left(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = shown(capsys, monkeypatch, patience=-1.0, total=0)
    assert "16.4 k poses" in said
    assert "left" not in said


def test_short_work_shows_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert shown(capsys, monkeypatch, patience=60.0) == ""


def test_nothing_where_nobody_looks(capsys: pytest.CaptureFixture[str]) -> None:
    with _progress.progress("error budget") as report:
        assert report is None
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("patience", "seen"), [(0.0, True), (60.0, False)])
def test_work_that_says_nothing_of_itself_shows_that_it_goes_on(
    patience: float,
    seen: bool,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setattr(_progress, "PATIENCE", patience)
    monkeypatch.setenv("TERM", "xterm")
    with _progress.waiting("calibration"):
        time.sleep(0.3)
    assert ("calibration" in capsys.readouterr().err) == seen


@pytest.mark.parametrize(
    ("done", "total", "seconds", "said"),
    [
        (0, 5, 1.0, "0 of 5 poses"),
        (1, 5, 2.0, "1 of 5 poses, 0.5/s, 0:08 left"),
        (8192, 9999, 4.0, "8192 of 9999 poses, 2048/s, 0:01 left"),
        (3_000_000, 10_000_000, 10.0, "3 M of 10 M poses, 300 k/s, 0:23 left"),
        (10, 72_010, 10.0, "10 of 72 k poses, 1/s, 20:00:00 left"),
        (5, 5, 1.0, "5 of 5 poses, 5/s"),
        (50_000, None, 1.0, "50 k poses, 50 k/s"),
        (2_000_000_000, 4_000_000_000, 60.0, "2 G of 4 G poses, 33.3 M/s, 1:00 left"),
    ],
)
def test_how_far_the_work_is(done: int, total: int | None, seconds: float, said: str) -> None:
    assert _progress.state(done, total, "poses", seconds) == said


def test_the_estimate_says_how_long_and_what_comes_first() -> None:
    said = _progress.estimate("shares", 25, 675, "poses", 2.0, "the worst poses")
    assert said == (
        "shares: about 0:54 for 675 poses, the worst poses first; Ctrl-C gives what is done by then"
    )
    assert "about" not in _progress.estimate("Monte Carlo", 9, 0, "samples", 2.0, "the worst poses")
