"""What `make test-all` found, as the trust page shows it, and whether it is of this commit.

`tests/results_file.py` writes build/test-results.json.
"""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

PLACE = Path("build") / "test-results.json"
AGAIN = "run `make test-all` on a committed tree"


@dataclass(frozen=True)
class Results:
    """The results read, and why they may not be shown as those of this commit, or ""."""

    tests: list[dict[str, Any]] = field(default_factory=list)
    commit: str = ""
    python: str = ""
    system: str = ""
    refusal: str = ""

    @property
    def counts(self) -> dict[str, int]:
        """Number of tests by outcome."""
        outcomes = [test["outcome"] for test in self.tests]
        return {name: outcomes.count(name) for name in sorted(set(outcomes))}


def git(root: Path, *words: str) -> str:
    """What git prints in a checkout."""
    run = subprocess.run(  # noqa: S603 words of ours
        ["git", "-C", str(root), *words],  # noqa: S607 the developer's git
        capture_output=True,
        text=True,
        check=True,
    )
    return run.stdout.strip()


def read_results(root: Path) -> Results:
    """The results file of a checkout; `refusal` says if it is missing, stale, partial or red."""
    file = root / PLACE
    if not file.exists():
        return Results(refusal=f"there are no test results ({PLACE}): {AGAIN}")
    read = json.loads(file.read_text("utf-8"))
    head = git(root, "rev-parse", "HEAD")
    commit = read["commit"]
    failed = sum(test["outcome"] not in {"passed", "skipped"} for test in read["tests"])
    refusal = ""
    if commit != head:
        refusal = f"the test results are of commit {commit[:10]}, this is {head[:10]}: {AGAIN}"
    elif read["changed"]:
        refusal = f"the tests ran on a tree with uncommitted changes: {AGAIN}"
    elif git(root, "status", "--porcelain"):
        refusal = "this tree has uncommitted changes: commit, then run `make test-all`"
    elif not read["complete"]:
        refusal = f"only some of the tests ran: {AGAIN}"
    elif failed:
        refusal = f"{failed} tests failed"
    # Numbers of another tree are not shown at all, those of a partial or red run are.
    shown = commit == head and not read["changed"]
    return Results(read["tests"] if shown else [], commit, read["python"], read["system"], refusal)
