"""The Tab key: what is offered where, in the shells' own protocol and in a real bash."""

from __future__ import annotations

import os
import pty
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from build_machine import MACHINES, machine_files
from command_line import call
from truepose import __main__ as program
from truepose.cli import COMMANDS, COMPLETION, cli
from truepose.cli._shells import SHELLS, Bash
from truepose.controllers import REGISTRY
from truepose.explanations import explanations
from truepose.files.document import read
from truepose.files.settings import apply
from truepose.machine.shared_keys import share_each

HEAVY = ("numpy", "xarray", "pydantic", "pint", "plotly", "rich", "truepose._kernel")
TRUEPOSE = (sys.executable, "-m", "truepose")


def offered(*words: str) -> list[str]:
    """What is offered for the last word."""
    *before, incomplete = words
    asked = Bash(cli, {}, "truepose", COMPLETION)
    return [item.value for item in asked.get_completions(before, incomplete)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: a machine file, a program, a folder, a hidden file."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(MACHINES / "hexapod.toml", "m.toml")
    for name in ("part.ngc", "measured.csv", ".hidden.toml"):
        Path(name).write_text("")
    Path("machines").mkdir()
    return tmp_path


def test_the_variable_is_the_one_that_the_program_asks_for() -> None:
    assert program.COMPLETION == COMPLETION


def test_commands_and_options() -> None:
    assert offered("") == list(COMMANDS)
    assert offered("b") == ["budget", "bounds"]
    assert offered("check", "--w") == ["--witness", "--watch"]
    assert offered("check", "m.toml", "--format", "") == ["table", "json", "csv"]


def test_kinds_controllers_codes_and_shells() -> None:
    assert offered("init", "") == [path.stem for path in machine_files()]
    assert offered("init", "planar_t") == ["planar_two_slider"]
    assert offered("export", "") == list(REGISTRY)
    assert offered("explain", "") == list(explanations())
    assert offered("explain", "no-unit", "unknown-k") == ["unknown-key", "unknown-kind"]
    assert offered("completion", "z") == ["zsh"]


@pytest.mark.usefixtures("folder")
def test_files_by_their_ending() -> None:
    assert offered("check", "") == ["m.toml", "machines/"]
    assert offered("check", ".h") == [".hidden.toml"]
    assert offered("calibrate", "m.toml", "") == ["machines/", "measured.csv"]
    assert offered("gcode", "m.toml", "p") == ["part.ngc"]
    assert offered("report", "m.toml", "--measurements", "") == ["machines/", "measured.csv"]
    assert offered("check", "nowhere/") == []
    assert offered("export", "c", "m.t") == ["m.toml"]


@pytest.mark.usefixtures("folder")
def test_keys_of_the_machine_file_word_by_word() -> None:
    every = offered("check", "m.toml", "--set", "")
    assert {"strut.", "drive.", "condition.", "tolerance."} <= set(every)
    assert "schema=" not in every
    assert offered("check", "m.toml", "--set", "strut.1") == ["strut.1."]
    of_one = offered("check", "m.toml", "--set", "strut.1.")
    assert {"strut.1.stiffness=", "strut.1.base=", "strut.1.base."} <= {*of_one, "strut.1.base."}
    assert offered("check", "m.toml", "--set", "strut.1.base.") == [
        f"strut.1.base.{axis}=" for axis in "xyz"
    ]
    assert "strut.*.stiffness=" in offered("budget", "m.toml", "--set", "strut.*.")
    # Settings before it, and other options, do not hide the file; nor does its place.
    more = ("check", "m.toml", "--set", "strut.1.length=3", "--strict", "--set", "accuracy.")
    assert offered(*more) == ["accuracy.target=", "accuracy.angle_target="]
    assert offered("export", "c", "m.toml", "--set", "acc") == ["accuracy."]


@pytest.mark.usefixtures("folder")
def test_what_is_offered_can_be_set() -> None:
    """Followed to its end, every key is one that --set finds."""
    ends, begun = [], [""]
    while begun:
        for text in offered("check", "m.toml", "--set", begun.pop()):
            (ends if text.endswith("=") else begun).append(text)
    assert len(ends) > 100
    for key in ends:
        document = read("m.toml")
        share_each(document, [], {"tolerance"})
        apply(document, [f"{key}1"], {"tolerance"})
        assert set(document.set_keys.values()) == {f"{key}1"}


@pytest.mark.usefixtures("folder")
def test_freedoms_and_unknowns() -> None:
    assert offered("bounds", "m.toml", "--region", "")[:2] == ["x=", "y="]
    assert offered("bounds", "m.toml", "--region", "x=1:2,")[:2] == ["x=1:2,y=", "x=1:2,z="]
    assert "strut.1.length" in offered("calibrate", "m.toml", "d.csv", "--identify", "strut.1.")


@pytest.mark.parametrize(
    "content", [b"", b"[[strut]\n", b"strut = 3\n[each]\nx = 1\n", b"\xff\xfe", b"machine = 1"]
)
def test_a_file_that_cannot_be_read_offers_nothing_and_breaks_nothing(
    content: bytes, tmp_path: Path
) -> None:
    file = tmp_path / "m.toml"
    file.write_bytes(content)
    for path in (file, tmp_path, tmp_path / "none.toml"):
        assert set(offered("check", str(path), "--set", "strut.")) <= {"strut="}
        assert offered("bounds", str(path), "--region", "x") == []


def test_nothing_heavy_is_imported_for_it(folder: Path) -> None:
    script = (
        "import sys, os; from truepose.cli import run\n"
        f"try: run()\nexcept SystemExit: print(*(n for n in {HEAVY} if n in sys.modules))"
    )
    for line, count in (
        ("truepose check m.toml --set strut.", 4),
        ("truepose export ", 2),
        ("truepose explain no-", 2),
        ("truepose init ", 2),
        ("truepose ", 1),
    ):
        asked = {"COMP_WORDS": line, "COMP_CWORD": str(count), COMPLETION: "bash_complete"}
        done = subprocess.run(
            [sys.executable, "-c", script],
            env=os.environ | asked,
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
        )
        *completions, imported = done.stdout.split("\n")[:-1]
        assert completions, line
        assert imported == "", line


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_is_answered_in_its_protocol(shell: str, folder: Path) -> None:
    line = "truepose check m.toml --set accuracy."
    asked = {"COMP_WORDS": line, COMPLETION: f"{shell}_complete"}
    asked["COMP_CWORD"] = "accuracy." if shell == "fish" else "4"
    done = subprocess.run(
        TRUEPOSE, env=os.environ | asked, cwd=folder, capture_output=True, text=True, check=False
    )
    lines = {
        "bash": ["open,accuracy.target=", "open,accuracy.angle_target="],
        "zsh": ["open", "accuracy.target=", "_", "open", "accuracy.angle_target=", "_"],
        "fish": ["plain,accuracy.target=", "plain,accuracy.angle_target="],
    }
    assert done.stdout.split() == lines[shell]
    assert done.stderr == ""


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_of_every_shell(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, "completion", shell)
    assert outcome.code == 0
    assert f"{COMPLETION}={shell}_complete" in outcome.out
    assert "%" not in outcome.out.replace("%%/", "").replace("${value%/}", "")
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=outcome.out, text=True, check=True)


class Terminal:
    """A real interactive bash, to which keys are typed."""

    def __init__(self, folder: Path) -> None:
        ours, theirs = pty.openpty()
        bash = shutil.which("bash")
        assert bash is not None
        path = f"{folder}:{os.environ['PATH']}"
        self._process = subprocess.Popen(
            [bash, "--norc", "-i"],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=folder,
            env=os.environ | {"PATH": path, "TERM": "dumb", "PS1": "> ", "INPUTRC": "/dev/null"},
            start_new_session=True,
        )
        os.close(theirs)
        self._ours = ours

    def types(self, text: str, until: str) -> str:
        """What the screen shows after the keys, once `until` (a pattern) is there."""
        os.write(self._ours, text.encode())
        shown, end = "", time.monotonic() + 60.0
        while not re.search(until, shown):
            left = end - time.monotonic()
            assert left > 0.0, f"not shown: {until!r}; but {shown!r}"
            if select.select([self._ours], [], [], left)[0]:
                shown += os.read(self._ours, 4096).decode(errors="replace")
        return shown

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._ours)


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_a_real_bash(folder: Path) -> None:
    program = folder / "truepose"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m truepose "$@"\n')
    program.chmod(0o755)
    (folder / "my machine.toml").write_text("")
    terminal = Terminal(folder)
    try:
        terminal.types('eval "$(truepose completion bash)"; echo re""ady\n', r"ready\r?\n")
        terminal.types("truepose bud\t", "truepose budget $")
        terminal.types("m.\t", "m.toml $")
        terminal.types("--set acc\t", r"accuracy\.$")
        # One end for both keys that begin so; then what follows stands right behind it.
        terminal.types("t\t", r"target=$")
        terminal.types("1 --set strut.\\*.stiff\t", r"stiffness=$")
        terminal.types("\x15truepose check my\t", r"check my\\ machine.toml $")
        terminal.types("\x15truepose check mach\t", "check machines/$")
        terminal.types("\x15truepose explain gcode-no-u\t", "explain gcode-no-units $")
        terminal.types("\x15truepose export kli\t", "export klipper $")
    finally:
        terminal.close()
