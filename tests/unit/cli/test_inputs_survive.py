"""No output takes the place of an input, or of another output; what is no file is neither."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from command_line import MACHINES, call
from truepose.files import limits
from truepose.files.one_run import one_run, reads, will_write

Capture = pytest.CaptureFixture[str]
TRIPOD = MACHINES / "tripod.toml"


@pytest.fixture
def warm(tmp_path: Path) -> Path:
    """A machine with a temperature log beside it, named .csv and, by a link, .json."""
    rows = ["time (s),strut.1 (degC),strut.2 (degC)"]
    rows += [f"{time},{20 + 0.1 * time},{20 + 0.2 * time}" for time in range(40)]
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n")
    text = (MACHINES / "planar_two_slider.toml").read_text()
    machine = tmp_path / "machine.toml"
    machine.write_text(text.replace("\ntemperature = 35", '\ntemperature_log = "log.csv"', 1))
    return machine


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("by", ["name", "link", "hard link"])
@pytest.mark.parametrize("command", ["over-time", "budget", "compensate"])
def test_a_temperature_log_survives(
    command: str, by: str, warm: Path, tmp_path: Path, capsys: Capture
) -> None:
    output = tmp_path / ("log.csv" if by == "name" else "out.csv")
    if by == "link":
        output.symlink_to("log.csv")
    elif by == "hard link":
        output.hardlink_to(tmp_path / "log.csv")
    before = contents(tmp_path)
    outcome = call(capsys, command, warm, "-o", output)
    assert (outcome.code, outcome.codes, outcome.out) == (2, ["output-is-input"], "")
    assert f"{tmp_path / 'log.csv'}, of --output" in outcome.err
    assert contents(tmp_path) == before


def test_measurements_survive_every_output(tmp_path: Path, capsys: Capture) -> None:
    data = tmp_path / "data.csv"
    assert call(capsys, "plan", TRIPOD, "--instrument", "position=10um", "--poses", 5,
                "--template", data).code == 0  # fmt: skip
    before = contents(tmp_path)
    for arguments in (
        ("plan", TRIPOD, "--instrument", data, "--poses", 5, "--template", data),
        ("plan", TRIPOD, "--instrument", data, "--poses", 5, "--program", data),
        ("plan", TRIPOD, "--instrument", data, "--poses", 5, "-o", data),
        ("plan", TRIPOD, "--instrument", "position=1um", "--compare", data, "--poses", 5,
         "-o", data),
        ("calibrate", TRIPOD, data, "-o", data),
    ):  # fmt: skip
        outcome = call(capsys, *arguments)
        assert (outcome.code, outcome.codes) == (2, ["output-is-input"]), arguments
        assert contents(tmp_path) == before


@pytest.mark.parametrize(
    ("one", "other"),
    [("-o", "--template"), ("-o", "--program"), ("--template", "--program")],
)
def test_two_outputs_are_two_files(one: str, other: str, tmp_path: Path, capsys: Capture) -> None:
    same, link = tmp_path / "same.csv", tmp_path / "link.csv"
    link.symlink_to(same)
    for second in (same, link, tmp_path / "." / "same.csv"):
        outcome = call(
            capsys, "plan", TRIPOD, "--instrument", "position=10um", "--poses", 5,
            one, same, other, second,
        )  # fmt: skip
        assert (outcome.code, outcome.codes, outcome.out) == (2, ["output-twice"], "")
        assert f"{other} would be written to the same file" in outcome.err
        assert not same.exists()


def test_calibrate_writes_three_files_or_none(tmp_path: Path, capsys: Capture) -> None:
    for outputs in (("-o", "--report"), ("--machine-output", "-o")):
        same = tmp_path / "same.html"
        outcome = call(
            capsys, "calibrate", TRIPOD, tmp_path / "none.csv", "--date", "2026-01-01",
            outputs[0], same, outputs[1], same,
        )  # fmt: skip
        assert (outcome.code, outcome.codes) == (2, ["output-twice"])


def test_the_order_does_not_matter(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_text("x")
    with one_run():
        reads(file)
        with pytest.raises(Exception, match="write over a file that is read"):
            will_write(file, "--output")
    with one_run():
        will_write(file, "--output")
        with pytest.raises(Exception, match="write over a file that is read"):
            reads(file)
    # Outside of a run, in Python, nothing is noted.
    reads(file)
    will_write(file, "--output")
    reads(file)


@pytest.mark.parametrize("kind", ["pipe", "socket", "device"])
@pytest.mark.parametrize("command", ["budget", "check", "gcode", "init", "plan", "report"])
def test_devices_are_no_targets(
    command: str, kind: str, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    ending = {"gcode": "ngc", "init": "toml", "plan": "csv", "report": "html"}.get(command, "json")
    monkeypatch.chdir(tmp_path)
    target = tmp_path / f"out.{ending}"
    opened = None
    if kind == "pipe":
        os.mkfifo(target)
    elif kind == "socket":
        opened = socket.socket(socket.AF_UNIX)
        opened.bind(target.name)
    else:
        target.symlink_to("/dev/null")
    mode = target.stat().st_mode
    arguments: tuple[object, ...] = (command, TRIPOD, "-o", target)
    if command == "gcode":
        (tmp_path / "part.ngc").write_text("G21 G0 X1\n")
        arguments = (command, TRIPOD, "part.ngc", "-o", target)
    elif command == "init":
        arguments = (command, "tripod", "-o", target)
    elif command == "plan":
        arguments = (*arguments, "--instrument", "position=1um", "--poses", 5)
    outcome = call(capsys, *arguments)
    assert outcome.code == 2
    assert set(outcome.codes) <= {"output-not-writable", "output-exists"}
    assert outcome.codes
    assert target.stat().st_mode == mode
    if opened is not None:
        opened.close()


def test_a_pipe_is_read(tmp_path: Path, capsys: Capture) -> None:
    pipe = tmp_path / "machine.toml"
    os.mkfifo(pipe)
    text = TRIPOD.read_text()
    writer = threading.Thread(target=lambda: pipe.write_text(text))
    writer.start()
    outcome = call(capsys, "check", pipe)
    writer.join()
    assert outcome.out == call(capsys, "check", TRIPOD).out
    assert outcome.code == 0


def test_a_pipe_without_end_is_refused(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("truepose.files.text_file.LARGEST_FILE", 1_000_000)
    pipe = tmp_path / "machine.toml"
    os.mkfifo(pipe)

    def pour() -> None:
        with suppress(BrokenPipeError), pipe.open("wb", buffering=0) as stream:
            while True:
                stream.write(bytes(4096))

    writer = threading.Thread(target=pour)
    writer.start()
    outcome = call(capsys, "check", pipe)
    writer.join()
    assert (outcome.code, outcome.codes) == (2, ["file-too-large"])
    assert limits.LARGEST_FILE <= 200_000_000  # of bytes that are held


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null"])
def test_a_device_is_not_read(device: str, warm: Path, tmp_path: Path, capsys: Capture) -> None:
    start = time.monotonic()
    program = tmp_path / "part.ngc"
    program.write_text("G21 G0 X250 Y150\n")
    named = tmp_path / "device.csv"
    named.symlink_to(device)
    for arguments in (
        ("check", device),
        ("calibrate", TRIPOD, device),
        ("plan", TRIPOD, "--instrument", named, "--poses", 5),
        ("over-time", warm, "--set", f'condition.temperature_log="{device}"'),
        ("gcode", TRIPOD, device, "-o", tmp_path / "out.ngc"),
        ("gcode", MACHINES / "planar_two_slider.toml", program, "--var", device, "--dry-run"),
    ):
        outcome = call(capsys, *arguments)
        assert outcome.code == 2, arguments
        assert outcome.codes == ["file-unreadable"], (arguments, outcome.err)
    assert time.monotonic() - start < 30.0


@pytest.mark.parametrize("command", ["check", "calibrate", "gcode"])
def test_ctrl_c_ends_the_wait_for_a_pipe(command: str, tmp_path: Path) -> None:
    pipe = tmp_path / "input"
    os.mkfifo(pipe)
    arguments = {
        "check": [str(pipe)],
        "calibrate": [str(TRIPOD), str(pipe)],
        "gcode": [str(TRIPOD), str(pipe), "-o", str(tmp_path / "out.ngc")],
    }[command]
    process = subprocess.Popen(
        [sys.executable, "-c", "from truepose.cli import main; main()", command, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    if command == "gcode":  # a program is read twice, which a pipe is not
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 2
        assert "input is a pipe" in errors
        return
    # It is at the pipe once its other end can be opened without waiting.
    for _ in range(600):
        try:
            other = os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
            break
        except OSError:
            time.sleep(0.1)
    time.sleep(0.5)  # it waits in the system, not on the way there
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    os.close(other)
    assert (process.returncode, errors) == (130, "Interrupted: no file was changed.\n")


def test_an_export_that_fails_leaves_the_old_set(tmp_path: Path, capsys: Capture) -> None:
    machine = MACHINES / "planar_two_slider.toml"
    assert call(capsys, "export", "linuxcnc", machine, "-o", tmp_path).code == 0
    before = contents(tmp_path)
    assert len(before) >= 3
    last = sorted(before)[-1]
    (tmp_path / last).chmod(0o444)
    outcome = call(
        capsys, "export", "linuxcnc", machine, "-o", tmp_path,
        "--set", "condition.temperature=60 degC",
    )  # fmt: skip
    assert (outcome.code, outcome.codes) == (2, ["output-not-writable"])
    assert contents(tmp_path) == before
    (tmp_path / last).chmod(0o644)
    assert call(
        capsys, "export", "linuxcnc", machine, "-o", tmp_path,
        "--set", "condition.temperature=60 degC",
    ).code == 0  # fmt: skip
    after = contents(tmp_path)
    assert after.keys() == before.keys()
    assert np.mean([after[name] != before[name] for name in after]) > 0.3


LONG = "n" * 300


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", f"{LONG}.toml"),
        ("check", TRIPOD, "-o", f"{LONG}.json"),
        ("check", TRIPOD, "-o", f"{LONG}/a.json"),
        ("init", "tripod", "-o", f"{LONG}.toml"),
        ("gcode", TRIPOD, f"{LONG}.ngc", "--dry-run"),
        ("gcode", TRIPOD, TRIPOD, "--dry-run", "--var", f"{LONG}.var"),
        ("plan", TRIPOD, "--instrument", f"{LONG}.csv:a", "--poses", 5),
        ("check", TRIPOD, "--set", 'condition.temperature_log="a\\u0000b.csv"'),
    ],
)
def test_names_that_no_file_has_are_refused(
    arguments: tuple[object, ...], capsys: Capture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = call(capsys, *arguments)
    assert outcome.code == 2, outcome.err
    assert outcome.codes
    assert list(tmp_path.iterdir()) == []


def test_an_output_without_a_name_is_refused(capsys: Capture) -> None:
    assert call(capsys, "export", "c", TRIPOD, "-o", "").code == 2


def test_a_machine_file_out_of_a_pipe_is_read_once(tmp_path: Path, capsys: Capture) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    machine = MACHINES / "planar_two_slider.toml"
    writer = threading.Thread(target=lambda: pipe.write_text(machine.read_text()))
    writer.start()
    page = tmp_path / "page.html"
    outcome = call(capsys, "report", pipe, "-o", page)
    writer.join()
    assert outcome.code == 0, outcome.err
    assert "name = &#34;Planar two-slider PKM&#34;" in page.read_text()


def test_a_calibrated_machine_with_a_log_goes_where_a_link_leads(
    tmp_path: Path, capsys: Capture
) -> None:
    data = MACHINES.parent / "examples" / "data"
    text = (data / "delta_printer.toml").read_text()
    log = "time (s),default (degC)\n0,20\n10,20\n"
    (tmp_path / "log.csv").write_text(log)
    (tmp_path / "machine.toml").write_text(
        text + '\n[condition]\ntemperature_log = "log.csv"\n'
        if "[condition]" not in text
        else text.replace("[condition]", '[condition]\ntemperature_log = "log.csv"', 1)
    )
    far = tmp_path / "far"
    far.mkdir()
    link = tmp_path / "link.toml"
    link.symlink_to(far / "real.toml")
    outcome = call(
        capsys, "calibrate", tmp_path / "machine.toml", data / "delta_positions.csv",
        "--machine-output", link, "--date", "2026-01-01", "--force",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert call(capsys, "check", link).code in (0, 1)
    assert call(capsys, "check", far / "real.toml").code in (0, 1)
