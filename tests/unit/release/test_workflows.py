"""Workflows are sound, run what there is, and trust no tag of an action."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from release import ROOT
from release.targets import SDIST, TARGETS

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
ACTIONLINT = sorted((ROOT / "build" / "release").glob("actionlint-*/actionlint"))
PINNED = r"[\w.-]+/[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+"

workflow = pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)


def jobs(path: Path) -> dict[str, Any]:
    return yaml.safe_load(path.read_text("utf-8"))["jobs"]


def scripts(path: Path) -> str:
    """All that the steps of a workflow run, a line each."""
    steps = [step for job in jobs(path).values() for step in job["steps"]]
    return "\n".join(step["run"] for step in steps if "run" in step)


def make_targets() -> set[str]:
    return set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))


def test_the_workflows_are_there() -> None:
    assert {"test", "release", "audit", "change-report"} <= {path.stem for path in WORKFLOWS}


@workflow
def test_what_is_run_exists(path: Path) -> None:
    text = scripts(path)
    asked = set(re.findall(r"\bmake ([a-z-]+)", text))
    assert asked <= make_targets()
    modules = set(re.findall(r"-m (release[\w.]*)", text))
    assert not [name for name in modules if importlib.util.find_spec(name) is None]
    files = re.findall(r"(?<![\w/])((?:\.ci|release|tests)/[\w./-]+)", text)
    assert not [name for name in files if not (ROOT / name).exists()]
    assert asked or modules or files


@workflow
def test_actions_are_pinned_by_commit_with_their_version_beside(path: Path) -> None:
    uses = re.findall(r"uses: (.+)$", path.read_text("utf-8"), re.MULTILINE)
    assert uses
    assert not [action for action in uses if not re.fullmatch(PINNED, action)]


@workflow
def test_a_job_may_do_what_it_says_and_ends(path: Path) -> None:
    assert yaml.safe_load(path.read_text("utf-8"))["permissions"] == {}
    for job in jobs(path).values():
        assert "permissions" in job
        assert job["timeout-minutes"] <= 120


def test_an_action_has_one_version() -> None:
    pins: dict[str, set[str]] = {}
    for path in WORKFLOWS:
        for name, pin in re.findall(r"uses: ([^@]+)@(.+)$", path.read_text("utf-8"), re.MULTILINE):
            pins.setdefault(name, set()).add(pin)
    assert not {name: found for name, found in pins.items() if len(found) > 1}


def test_a_release_builds_every_target_and_publishes_after_all_else() -> None:
    release = jobs(ROOT / ".github" / "workflows" / "release.yml")
    built = release["build"]["strategy"]["matrix"]["include"]
    assert {one["name"] for one in built} == {*TARGETS, SDIST}
    for one in built:
        assert one.get("rust") == (None if one["name"] == SDIST else TARGETS[one["name"]].triple)
    before: set[str] = set()
    wanted = ["publish"]
    while wanted:
        needs = release[wanted.pop()].get("needs", [])
        new = {needs} if isinstance(needs, str) else set(needs)
        wanted += new - before
        before |= new
    assert before == set(release) - {"publish"}
    assert "release-check" in release["check"]["steps"][-1]["run"]
    assert release["publish"]["permissions"]["id-token"] == "write"
    # Nothing but publishing may write anything.
    others = [job for name, job in release.items() if name != "publish"]
    assert all(job["permissions"] == {"contents": "read"} for job in others)


def test_tests_run_with_the_oldest_python_that_is_allowed() -> None:
    matrix = jobs(ROOT / ".github" / "workflows" / "test.yml")["systems"]["strategy"]["matrix"]
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    (oldest,) = re.findall(r'^requires-python = ">=(.+)"$', project, re.MULTILINE)
    assert oldest in matrix["python"]
    assert [(one["python"], one["dependencies"]) for one in matrix["include"]] == [
        (oldest, "oldest")
    ]


def test_actionlint_finds_nothing() -> None:
    """`make lint-workflows` installs it, which needs Go; `.ci/run` does without."""
    found = shutil.which("actionlint") or (str(ACTIONLINT[-1]) if ACTIONLINT else "")
    if not found:
        pytest.skip("no actionlint: make lint-workflows")
    run = subprocess.run([found], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout


def test_hooks_and_forms_are_sound() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    (local,) = hooks["repos"]
    assert local["repo"] == "local"  # nothing is fetched
    asked = {hook["entry"].split()[1] for hook in local["hooks"] if hook["entry"][:5] == "make "}
    assert asked <= make_targets()
    forms = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
    for path in forms:
        form = yaml.safe_load(path.read_text("utf-8"))
        if path.name != "config.yml":
            names = [field["id"] for field in form["body"]]
            assert form["name"]
            assert form["description"]
            assert len(set(names)) == len(names)
    assert len(forms) > 1
