"""The recorder: one case is the same twice, and what changed in it is found."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from house.comparison import compare_records

RECORDER = Path(__file__).parent / "recorder.py"
TESTS = str(Path(__file__).parents[1])
CASE = "over-time/planar"


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two records of one case."""
    folder = tmp_path_factory.mktemp("records")
    both = folder / "old", folder / "new"
    for record in both:
        subprocess.run(
            [sys.executable, RECORDER, "record", record, "--only", CASE, "--jobs", "1"],
            check=True,
            capture_output=True,
            env={**os.environ, "PYTHONPATH": TESTS},
        )
    return both


def edited(record: Path, target: Path, name: str, change: Callable[[str], str]) -> Path:
    shutil.copytree(record, target)
    path = target / CASE / name
    text = path.read_text(encoding="utf-8")
    assert change(text) != text
    path.write_text(change(text), encoding="utf-8")
    return target


def test_a_record_is_the_same_twice(
    records: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare_records(*records) == 0
    assert "1 cases, 1 equal, 0 differing" in capsys.readouterr().out
    written = {path.name for path in (records[0] / CASE / "files").iterdir()}
    assert written == {"out.csv", "out.nc.txt"}
    assert "exit code 0" in (records[0] / CASE / "1.exit").read_text(encoding="utf-8")
    assert "<folder>" not in (records[0] / CASE / "1.stdout").read_text(encoding="utf-8")


def changed_number(text: str) -> str:
    """The last number of a CSV times 1 + 1e-6."""
    head, _, last = text.rstrip().rpartition(",")
    return f"{head},{float(last) * (1 + 1e-6)!r}\n"


def test_a_changed_number_is_found(
    records: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    new = edited(records[1], tmp_path / "new", "files/out.csv", changed_number)
    assert compare_records(records[0], new) == 1
    assert compare_records(records[0], new, relative=1e-9) == 1
    assert compare_records(records[0], new, relative=1e-9, mask_sentences=True) == 1
    assert compare_records(records[0], new, relative=1e-5) == 0
    assert CASE in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("1.exit", "exit code 0", "exit code 1"),
        ("2.stdout", '"truepose_version"', '"version"'),
        ("files/out.csv", "time [s]", "moment [s]"),
        ("7.stderr", "error[file-missing]", "error[file-lost]"),
    ],
)
def test_a_changed_name_or_exit_code_is_found(
    name: str, old: str, new: str, records: tuple[Path, Path], tmp_path: Path
) -> None:
    target = edited(records[1], tmp_path / "new", name, lambda text: text.replace(old, new))
    for mask in (False, True):
        assert compare_records(records[0], target, 1e-6, mask) == 1


def test_sentences_may_differ_where_that_is_asked(
    records: tuple[Path, Path], tmp_path: Path
) -> None:
    name = "7.stderr"
    target = edited(
        records[1], tmp_path / "new", name, lambda text: text.replace("there is no", "missing:")
    )
    assert compare_records(records[0], target) == 1
    assert compare_records(records[0], target, mask_sentences=True) == 0


def test_a_case_that_is_missing_is_found(records: tuple[Path, Path], tmp_path: Path) -> None:
    new = tmp_path / "new"
    new.mkdir()
    assert compare_records(records[0], new) == 1
