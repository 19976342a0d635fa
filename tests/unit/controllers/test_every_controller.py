"""What holds of every adapter in the registry: a new one is tried without being asked."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import truepose as tp
from build_machine import MACHINES
from sweeps import sweep
from truepose.controllers import REGISTRY, Export, controller, export
from truepose.errors import RequestError

PAGES = Path(__file__).parents[3] / "docs" / "controllers"
LIBRARY = sorted(path.stem for path in MACHINES.glob("*.toml"))
REFUSALS = {"controller-cannot", "no-pose-left", "no-workspace", "no-source", "bad-option"}


def served(name: str, machine: str) -> Export | None:
    """What the controller is given for a machine of the library; None where it refuses it."""
    try:
        return export(tp.load(MACHINES / f"{machine}.toml"), name)
    except RequestError as refusal:
        problems = refusal.problems
    assert {problem.code for problem in problems} <= REFUSALS
    assert all(problem.expected for problem in problems)
    return None


@pytest.mark.parametrize("name", REGISTRY)
def test_it_says_what_it_is(name: str) -> None:
    adapter = controller(name)
    assert adapter.name == name
    assert adapter.doc
    assert "\n" not in adapter.doc
    for option in adapter.options.values():
        assert option.doc
        assert not option.choices or option.default in option.choices


@pytest.mark.parametrize("name", REGISTRY)
def test_it_has_a_page(name: str) -> None:
    said = re.compile(rf"`(?:truepose )?(?:export )?{re.escape(name)}[` ]")
    pages = [page.name for page in PAGES.glob("*.md") if said.search(page.read_text("utf-8"))]
    assert "README.md" in pages


@pytest.mark.parametrize("name", REGISTRY)
def test_an_option_that_it_does_not_have_is_refused(name: str) -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    with pytest.raises(RequestError) as refused:
        export(machine, name, {"no such option": "1"})
    assert [problem.code for problem in refused.value.problems] == ["bad-option"]


@pytest.mark.parametrize("name", REGISTRY)
def test_a_machine_of_the_library_is_served_alike_each_time(name: str) -> None:
    machine, first = next((m, found) for m in LIBRARY if (found := served(name, m)) is not None)
    second = served(name, machine)
    assert second is not None
    assert (first.files, first.statement) == (second.files, second.statement)
    assert first.files
    for file, text in first.files.items():
        assert Path(file).name == file
        assert text.endswith("\n")


@sweep
@pytest.mark.parametrize("machine", LIBRARY)
@pytest.mark.parametrize("name", REGISTRY)
def test_every_machine_is_served_or_refused_with_a_reason(name: str, machine: str) -> None:
    found = served(name, machine)
    assert found is None or found.files
