"""`truepose live`: the page alone, where it cannot be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import PLANAR, call
from truepose.reporting.live import part

Capture = pytest.CaptureFixture[str]


def test_a_page_is_refused_without_its_kernel(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Capture
) -> None:
    monkeypatch.setattr(part, "kernel_file", lambda: tmp_path / "kernel.gz")
    output = tmp_path / "live.html"
    outcome = call(capsys, "live", PLANAR, "--output", output)
    assert (outcome.code, outcome.out, outcome.codes) == (2, "", ["no-live-kernel"])
    assert "no kernel.gz" in outcome.err
    assert "make web" in outcome.err
    assert not list(tmp_path.iterdir())
