"""The site of a release shows results of this commit, of all tests, all green, or says why not."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from document_blocks import ROOT

ONE = {"test": "tests/a.py::test_one", "outcome": "passed"}


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module of docs/site that reads them."""
    monkeypatch.syspath_prepend(ROOT / "docs" / "site")
    import test_results

    return test_results


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout of one commit, in which build/ is not looked at."""
    (tmp_path / ".gitignore").write_text("build/\n", "utf-8")
    name = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    for words in (["init", "-q"], ["add", "."], [*name, "commit", "-qm", "first"]):
        subprocess.run(["git", "-C", tmp_path, *words], check=True)  # noqa: S607 the developer's
    return tmp_path


@pytest.fixture
def write(checkout: Path, results: ModuleType) -> Callable[..., None]:
    """Write the results file, of this commit where nothing else is said."""

    def written(**changes: Any) -> None:
        found = {
            "commit": results.git(checkout, "rev-parse", "HEAD"),
            "changed": False,
            "complete": True,
            "python": "3.11.2",
            "system": "Linux x86_64",
            "tests": [ONE],
        }
        file = checkout / results.PLACE
        file.parent.mkdir(exist_ok=True)
        file.write_text(json.dumps(found | changes), "utf-8")

    return written


def test_results_of_this_commit_are_taken(
    checkout: Path, results: ModuleType, write: Callable[..., None]
) -> None:
    write()
    read = results.read_results(checkout)
    assert read.refusal == ""
    assert read.tests == [ONE]
    assert read.counts == {"passed": 1}


@pytest.mark.parametrize(
    ("changes", "why", "shown"),
    [
        ({"commit": "0" * 40}, "are of commit 0000000000, this is", 0),
        ({"changed": True}, "ran on a tree with uncommitted changes", 0),
        ({"complete": False}, "only some of the tests ran", 1),
        ({"tests": [ONE, {"test": "tests/a.py::test_two", "outcome": "failed"}]}, "1 tests", 2),
    ],
)
def test_others_are_refused_and_stale_numbers_not_shown(
    changes: dict[str, Any],
    why: str,
    shown: int,
    checkout: Path,
    results: ModuleType,
    write: Callable[..., None],
) -> None:
    write(**changes)
    read = results.read_results(checkout)
    assert why in read.refusal
    assert len(read.tests) == shown


def test_a_tree_that_was_changed_since_is_refused(
    checkout: Path, results: ModuleType, write: Callable[..., None]
) -> None:
    write()
    (checkout / "new.py").write_text("", "utf-8")
    assert "this tree has uncommitted changes" in results.read_results(checkout).refusal


def test_a_checkout_without_results_builds_no_site_to_publish(
    checkout: Path, results: ModuleType
) -> None:
    assert "there are no test results" in results.read_results(checkout).refusal


def test_the_site_of_a_release_ends_before_anything_is_built(tmp_path: Path) -> None:
    """Whatever results this checkout has, those of a tree with a new file are none of a release."""
    witness = ROOT / "docs" / "site" / "not_committed.md"
    assert not witness.exists()
    build = [sys.executable, ROOT / "docs" / "site" / "build.py", "--release"]
    witness.write_text("", "utf-8")
    try:
        run = subprocess.run(
            [*build, "--output", tmp_path / "site"], capture_output=True, text=True, check=False
        )
    finally:
        witness.unlink()
    assert run.returncode == 1
    assert run.stderr.startswith("no site to publish: ")
    assert list(tmp_path.iterdir()) == []
