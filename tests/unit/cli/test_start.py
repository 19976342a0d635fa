"""The registry of commands, and that nothing heavy is imported before it is needed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

import truepose
from command_line import MACHINES, call
from truepose.__main__ import main as program
from truepose.cli import COMMANDS

PAGE = Path(truepose.__file__).with_name("help.txt")

HEAVY = (
    "numpy", "xarray", "pydantic", "pint", "plotly", "jinja2", "rich", "truepose._kernel",
    "starlette", "uvicorn", "websockets", "tomlkit", "multiprocessing",
)  # fmt: skip


@pytest.mark.parametrize("arguments", [["--help"], *([name, "--help"] for name in COMMANDS)])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    program = (
        "import sys; from truepose.cli import run; code = run(sys.argv[1:]); "
        f"sys.exit(code or ','.join(name for name in {HEAVY} if name in sys.modules) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "Usage: truepose" in done.stdout


@pytest.mark.parametrize("form", ["table", "json", "csv"])
def test_a_check_makes_no_dataset(form: str) -> None:
    """Importing what makes one takes as long as the check itself."""
    heavy = ("xarray", "pandas", "pint", "scipy", "plotly", "jinja2", "numpy.ma")
    program = (
        # Before numpy 2 its own import has numpy.ma.
        "import sys, numpy; new = set(sys.modules); from truepose.cli import run; "
        "run(sys.argv[1:]); new = set(sys.modules) - new; "
        f"sys.exit(','.join(name for name in {heavy} if name in new) or 0)"
    )
    asked = ["check", str(MACHINES / "hexapod.toml"), "--format", form]
    done = subprocess.run(
        [sys.executable, "-c", program, *asked], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("columns", ["80", "200", "79", "40"])
@pytest.mark.parametrize("asked", ["-h", "--help"])
def test_the_page_written_before_is_the_help(
    asked: str,
    columns: str,
    golden: Callable[[str, str], str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    shown = call(capsys, asked).out
    if columns == "80":
        assert golden(str(PAGE), shown) == shown
    monkeypatch.setattr(sys, "argv", ["truepose", asked])
    with suppress(SystemExit):
        program()
    assert capsys.readouterr().out == shown


@pytest.mark.parametrize("asked", ["-h", "--help"])
def test_the_help_needs_the_interpreter_alone(asked: str) -> None:
    script = (
        "import sys; bare = set(sys.modules); from truepose.__main__ import main; main(); "
        "print(*sorted(set(sys.modules) - bare), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, asked], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert set(done.stderr.split()) <= {
        "__future__",
        "truepose",
        "truepose.__main__",
        "encodings.ascii",
    }
    assert done.stdout == PAGE.read_text("ascii")


@pytest.mark.parametrize("form", ["table", "json", "csv"])
def test_the_kinds_are_listed_without_a_machine(form: str) -> None:
    """Only what draws a table on a terminal is imported for them."""
    heavy = [name for name in HEAVY if name != "rich" or form != "table"]
    program = (
        "import sys; from truepose.cli import run; code = run(sys.argv[1:]); "
        f"sys.exit(code or ','.join(name for name in {heavy} if name in sys.modules) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "init", "--list", "--format", form],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "planar_two_slider" in done.stdout


def test_help_names_every_command_in_the_order_of_work(capsys: pytest.CaptureFixture[str]) -> None:
    shown = call(capsys, "--help").out
    places = [shown.index(f"\n  {name} ") for name in COMMANDS]
    assert places == sorted(places)
    commands = shown.partition("Commands:")[2]
    assert "..." not in commands, "a first sentence too long for the list of commands"


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    from truepose import __version__

    assert call(capsys, "--version").out == f"truepose {__version__}\n"


def test_a_command_that_is_not_there_is_told_with_the_nearest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    outcome = call(capsys, "bugdet", "machine.toml")
    assert outcome.code == 2
    assert "No such command 'bugdet'. Did you mean 'budget'?" in outcome.err


@pytest.mark.parametrize(
    "arguments",
    [["budget"], ["budget", "m.toml", "--format", "xml"], ["check", "m.toml", "--fromat", "json"]],
)
def test_wrong_usage_is_bad_input(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    outcome = call(capsys, *arguments)
    assert outcome.code == 2
    assert "Usage: truepose" in outcome.err
    assert outcome.out == ""
