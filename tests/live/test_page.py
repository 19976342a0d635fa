"""`truepose live`: the page alone, where it cannot be written, and where that is broken off."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import PLANAR, call
from system_package import require_web_kernel
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


def test_ctrl_c_while_it_is_written_leaves_the_old_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Capture
) -> None:
    require_web_kernel()
    output = tmp_path / "live.html"
    output.write_text("old")
    halves: list[Path] = []

    def half(path: Path, text: str, **_: object) -> None:
        path.write_bytes(text[: len(text) // 2].encode())
        halves.append(path)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_text", half)
        outcome = call(capsys, "live", PLANAR, "--output", output)
    assert outcome.code == 130
    assert "Traceback" not in outcome.err
    assert len(halves) == 1
    assert output.read_text() == "old"
    assert list(tmp_path.iterdir()) == [output]
