"""What the tests found, as a file: `pytest --results FILE`, as `make test-all` calls it.

The site's trust page is made of it, and of nothing else. It has the commit, whether the tree had
changes, whether all tests were asked for, and of each test its outcome and the published numbers
that it compared. Workers of pytest-xdist send their reports to the process that writes the file.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

import pytest

PUBLISHED = "published"
"""Property of a test: the numbers that it compared with published ones."""
ROOT = Path(__file__).resolve().parent.parent


def git(*words: str) -> str:
    """What git prints, or nothing outside of a checkout."""
    run = subprocess.run(
        ["git", "-C", str(ROOT), *words],  # noqa: S607 the git that the developer has
        capture_output=True,
        text=True,
        check=False,
    )
    return run.stdout.strip()


class ResultsFile:
    """Collects the reports of a run and writes them when it ends."""

    def __init__(self, path: Path, complete: bool) -> None:
        self.path, self.complete = path, complete
        self.tests: dict[str, dict[str, Any]] = {}
        # Before the tests: what is committed while they run was not tested.
        self.commit, self.changed = git("rev-parse", "HEAD"), bool(git("status", "--porcelain"))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        test = self.tests.setdefault(report.nodeid, {"test": report.nodeid, "outcome": "passed"})
        if report.outcome != "passed":
            test["outcome"] = report.outcome
        if report.when == "call":
            shown = [value for name, value in report.user_properties if name == PUBLISHED]
            if shown:
                test[PUBLISHED] = shown

    def pytest_sessionfinish(self) -> None:
        found = {
            "commit": self.commit,
            "changed": self.changed,
            "complete": self.complete,
            "python": platform.python_version(),
            "system": f"{platform.system()} {platform.machine()}",
            "tests": [self.tests[name] for name in sorted(self.tests)],
        }
        self.path.parent.mkdir(parents=True, exist_ok=True)
        partial = self.path.with_name(f".{self.path.name}.partial")
        partial.write_text(json.dumps(found, indent=1), encoding="utf-8")
        partial.replace(self.path)


def asks_for_all(config: pytest.Config) -> bool:
    """Whether no test was left out by a path or an expression."""
    chosen = config.getoption("markexpr") or config.getoption("keyword")
    return not chosen and [Path(one).resolve() for one in config.args] == [ROOT / "tests"]


def start(config: pytest.Config) -> None:
    """Collect, where a results file is asked for and this process is no worker."""
    path = config.getoption("results")
    if path is not None and "PYTEST_XDIST_WORKER" not in os.environ:
        config.pluginmanager.register(ResultsFile(Path(path), asks_for_all(config)), "results-file")
