"""`truepose check --watch`: again whenever a file changes, until Ctrl-C, whatever stands there."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from command_line import PLANAR, call
from truepose.cli import _watch

MET = 'target = "50 mm"'
ASKED = 'target = "0.5 mm"'
LOG = "time (min), default (degC)\n0, 20\n20, 25\n"


class Watch:
    """A check that goes on in a process of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        self._told = folder / "told"
        self._shown = folder / "shown"
        with self._told.open("wb") as err, self._shown.open("wb") as out:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "truepose", "check", "m.toml", "--watch", *options],
                cwd=folder,
                stdout=out,
                stderr=err,
            )

    @property
    def told(self) -> str:
        return self._told.read_text("utf-8")

    @property
    def shown(self) -> str:
        return self._shown.read_text("utf-8")

    def codes(self, count: int) -> list[int]:
        """The exit codes of the checks so far, once there are `count`."""
        end = time.monotonic() + 60.0
        while time.monotonic() < end:
            codes = [int(code) for code in re.findall(r", exit code (\d+); watching", self.told)]
            if len(codes) >= count:
                return codes
            assert self.process.poll() is None, self.told
            time.sleep(0.05)
        raise AssertionError(f"no {count} checks: {self.told}")

    def interrupt(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(60.0)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "m.toml").write_text(PLANAR.read_text())
    return tmp_path


@pytest.fixture
def watch(folder: Path) -> Iterator[Watch]:
    watching = Watch(folder)
    yield watching
    watching.process.kill()
    watching.process.wait()


def test_it_checks_again_and_ends_with_the_last_answer(folder: Path, watch: Watch) -> None:
    file, text = folder / "m.toml", PLANAR.read_text()
    assert watch.codes(1) == [1]
    file.write_text(text.replace(ASKED, MET))
    assert watch.codes(2) == [1, 0]
    assert "watching m.toml; Ctrl-C ends." in watch.told
    assert watch.shown.count("met") >= 2
    assert watch.interrupt() == 0
    assert "Traceback" not in watch.told


def test_nothing_that_stands_there_ends_it(folder: Path, watch: Watch) -> None:
    file, text = folder / "m.toml", PLANAR.read_text()
    states = {
        "half of it": lambda: file.write_text(text[: len(text) // 2]),
        "nothing": lambda: file.write_text(""),
        "no text": lambda: file.write_bytes(b"\xff\xfe\x00"),
        "no file": file.unlink,
        "a folder": file.mkdir,
    }
    watch.codes(1)
    for count, make in enumerate(states.values(), start=2):
        make()
        assert watch.codes(count)[count - 1 :] == [2]
    file.rmdir()
    assert watch.codes(7)[6:] == [2]
    # As an editor writes: beside it, and renamed.
    (folder / "new").write_text(text.replace(ASKED, MET))
    os.replace(folder / "new", file)  # noqa: PTH105
    assert watch.codes(8)[7:] == [0]
    file.write_text("schema = 2\n")
    watch.codes(9)
    assert watch.interrupt() == 2
    codes = re.findall(r"error\[([a-z0-9-]+)\]", watch.told)
    assert {"missing-key", "not-utf8", "file-missing", "file-is-directory"} <= set(codes)


def test_files_that_it_names_are_watched_even_before_they_are_there(
    folder: Path, watch: Watch
) -> None:
    file = folder / "m.toml"
    text = PLANAR.read_text().replace("\ntemperature = 35", '\ntemperature_log = "log.csv"')
    watch.codes(1)
    file.write_text(text)
    assert watch.codes(2)[1:] == [2]
    (folder / "log.csv").write_text(LOG)
    assert watch.codes(3)[2:] == [1]
    assert "watching log.csv, m.toml;" in watch.told
    # While the machine file is broken, the log stays watched.
    file.write_text(text.replace("schema = 1", "schema = "))
    assert watch.codes(4)[3:] == [2]
    (folder / "log.csv").write_text(LOG + "40, 30\n")
    assert watch.codes(5)[4:] == [2]
    assert watch.interrupt() == 2


def test_outputs_are_written_every_time(folder: Path) -> None:
    watching = Watch(folder, "--format", "json", "-o", "out.json", "-v")
    try:
        watching.codes(1)
        first = (folder / "out.json").read_bytes()
        (folder / "m.toml").write_text(PLANAR.read_text().replace(ASKED, MET))
        assert watching.codes(2) == [1, 0]
        assert (folder / "out.json").read_bytes() != first
        assert watching.interrupt() == 0
    finally:
        watching.process.kill()
        watching.process.wait()
    # What is said of a file is said again where it has another content.
    assert len(re.findall(r"read m\.toml: ", watching.told)) == 2


def test_an_output_over_an_input_is_refused_at_every_check(folder: Path) -> None:
    (folder / "m.json").write_text(PLANAR.read_text())
    done = subprocess.Popen(
        [sys.executable, "-m", "truepose", "check", "m.json", "--watch", "-o", "m.json"],
        cwd=folder,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    assert done.stderr is not None
    assert "output-is-input" in done.stderr.readline()
    done.kill()
    done.communicate()
    assert (folder / "m.json").read_text() == PLANAR.read_text()


def test_a_defect_is_told_and_the_watch_goes_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def wrong() -> int:
        raise ZeroDivisionError

    def interrupted(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(_watch, "_wait", interrupted)
    assert _watch.watched(wrong, tmp_path / "m.toml", as_json=False) == 70
    assert "this is a defect of truepose" in capsys.readouterr().err


def test_ctrl_c_before_the_first_answer(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("truepose.cli.check._check", interrupted)
    assert call(capsys, "check", PLANAR, "--watch").code == 130
