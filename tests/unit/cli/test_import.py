"""`truepose import`: a machine file, written whole or not at all, and what to know of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import call
from truepose.controllers import READERS

PRINTER = str(Path(__file__).parents[3] / "examples" / "data" / "printer.cfg")


def test_every_reader_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "import", "--list")
    assert done.code == 0
    assert all(name in done.out for name in READERS)


def test_a_machine_file_is_printed_and_what_to_know_beside_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    printed = call(capsys, "import", PRINTER)
    assert printed.code == 0
    assert "assumed: " in printed.err
    written = tmp_path / "mine.toml"
    done = call(capsys, "import", PRINTER, "-o", str(written))
    assert done.code == 0
    assert written.read_text("utf-8") == printed.out
    assert "assumed: " in done.out
    assert f"wrote {written}" in done.err
    assert "NOT met" in call(capsys, "check", str(written)).out  # of what is assumed so widely


def test_a_file_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    done = call(capsys, "import")
    assert done.code == 2
    assert "Give the FILE" in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.cfg"], ["file-missing"]),
        ([PRINTER, "--from", "klippr"], ["unknown-controller", 'did you mean "klipper"?']),
        ([PRINTER, "--set", "no.such=1"], ["bad-setting"]),
        ([PRINTER, "-o", "mine.cfg"], ["output-ending"]),
        ([PRINTER, "--measurements", "mine.txt"], ["output-ending"]),
    ],
)
def test_what_cannot_be_is_refused(
    arguments: list[str],
    words: list[str],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    done = call(capsys, "import", *arguments)
    assert done.code == 2
    assert all(word in done.err for word in words)
    assert not list(tmp_path.iterdir())


def test_the_controllers_file_is_never_written_over(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Nor is what it includes."""
    text = Path(PRINTER).read_text("utf-8")
    (tmp_path / "printer.cfg").write_text("[include more.toml]\n", "utf-8")
    (tmp_path / "more.toml").write_text(text.partition("#*#")[0], "utf-8")
    done = call(capsys, "import", str(tmp_path / "printer.cfg"), "-o", str(tmp_path / "more.toml"))
    assert done.code == 2
    assert "output-exists" in done.err
    assert (tmp_path / "more.toml").read_text("utf-8").startswith("# A printer")


def test_a_file_that_is_there_is_not_touched(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for name, flag in (("mine.toml", "-o"), ("mine.csv", "--measurements")):
        (tmp_path / name).write_text("mine", "utf-8")
        done = call(capsys, "import", PRINTER, flag, str(tmp_path / name))
        assert done.code == 2
        assert "output-exists" in done.err
        assert (tmp_path / name).read_text("utf-8") == "mine"


def test_a_problem_has_the_files_own_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "printer.cfg"
    path.write_text(Path(PRINTER).read_text("utf-8").replace("149.094578", "14l.09"), "utf-8")
    line = 1 + path.read_text("utf-8").split("14l.09")[0].count("\n")
    done = call(capsys, "import", str(path))
    assert done.code == 2
    assert f"printer.cfg:{line}: error[not-a-number]: printer.delta_radius" in done.err


def test_measurements_that_the_file_does_not_have(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "printer.cfg"
    path.write_text(Path(PRINTER).read_text("utf-8").partition("#*# [delta_cal")[0], "utf-8")
    output, data = tmp_path / "mine.toml", tmp_path / "mine.csv"
    done = call(capsys, "import", str(path), "-o", str(output), "--measurements", str(data))
    assert done.code == 2
    assert "import-no-measurements" in done.err
    assert not output.exists()
