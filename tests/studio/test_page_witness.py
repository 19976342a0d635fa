"""One machine of the studio: the witness drawn where it is, and its other solutions."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import truepose as tp
from command_line import MACHINES
from served_studio import ServedStudio, studio_of
from studio_visit import PATIENCE, PIXELS, Visit
from truepose.verdict.answer import AFTER, BEFORE, Answer

MACHINE = MACHINES / "hexapod.toml"
STATES = {"before": BEFORE, "after": AFTER}


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ServedStudio, Path]]:
    folder = tmp_path_factory.mktemp("witness")
    (folder / "m.toml").write_bytes(MACHINE.read_bytes())
    with studio_of(folder / "m.toml", folder / "state") as one:
        yield one, folder


def answered(*settings: str) -> dict[str, Answer]:
    """By the names that the page has for them, the answers of the command."""
    answers = tp.accuracy(tp.load(MACHINE, settings))
    by_state = {state: name for name, state in STATES.items()}
    return {f"{by_state[answer.state]}.{answer.quantity}": answer for answer in answers}


def causes_of(answer: Answer) -> list[str]:
    assert answer.example is not None
    return answer.example.words()[1:]


def drawn(visit: Visit, what: str) -> None:
    visit.page.wait_for_function(
        "what => document.getElementById('live').dataset.drawn === what", arg=what, timeout=PATIENCE
    )
    visit.rest()


def picture(visit: Visit) -> str:
    return str(visit.page.evaluate(PIXELS, "machine"))


def listed(visit: Visit) -> list[str]:
    return list(visit.page.locator("[data-live=witness] li").all_inner_texts())


def shown_pose(visit: Visit) -> list[float]:
    inputs = visit.page.locator('[data-of^="pose."] input[type=number]')
    return [float(one.input_value()) for one in inputs.all()]


def test_each_answer_names_its_machine_as_the_command_does(visit: Visit) -> None:
    for name, answer in answered().items():
        state, quantity = name.split(".")
        line = visit.page.locator(f'[data-of="workspace.{state}.example.{quantity}"]')
        assert "; ".join(causes_of(answer)) in line.inner_text()


def test_the_machine_is_drawn_at_its_pose_alone(visit: Visit) -> None:
    page, select = visit.page, visit.page.locator("[data-live=drawn]")
    answer = answered()["before.position"]
    drawn(visit, "known")
    at_home, home = picture(visit), shown_pose(visit)
    page.locator('[data-of="workspace.before.example.position"] button').click()
    drawn(visit, "other")
    assert select.input_value() == "before.position"
    assert listed(visit) == causes_of(answer)
    units = [visit.page.locator(f'[data-of="pose.{n}"] .unit').inner_text() for n in "xa"]
    inch, degree = {"in": 0.0254}[units[0]], {"°": 3.141592653589793 / 180}[units[1]]
    scale = [inch] * 3 + [degree] * 3
    assert answer.example is not None
    pose = [value / size for value, size in zip(answer.example.pose, scale, strict=True)]
    assert shown_pose(visit) == pytest.approx(pose, abs=1e-6)
    with_witness = picture(visit)
    said = page.locator("[data-live=witness] .there").inner_text()
    assert f"{answer.witness.value / 25.4e-9:.0f} µin" in said
    # Another machine is another picture at another pose, and what is known at the same pose too.
    select.select_option("before.orientation")
    drawn(visit, "other")
    other = picture(visit)
    select.select_option("before.position")
    drawn(visit, "other")
    assert picture(visit) == with_witness != other
    select.select_option("")
    drawn(visit, "known")
    assert picture(visit) != with_witness
    assert listed(visit) == []
    select.select_option("before.position")
    drawn(visit, "other")
    slider = page.locator('[data-of="pose.x"] input[type=number]')
    slider.fill("1")
    drawn(visit, "known")
    elsewhere = page.locator("[data-live=witness] .elsewhere")
    assert elsewhere.is_visible()
    elsewhere.locator("button").click()
    drawn(visit, "other")
    assert elsewhere.is_hidden()
    assert picture(visit) == with_witness
    select.select_option("")
    page.locator("[data-live=reset]").click()
    drawn(visit, "known")
    assert (shown_pose(visit), picture(visit)) == (home, at_home)


def test_another_machine_has_a_witness_of_its_own(visit: Visit) -> None:
    select = visit.page.locator("[data-live=drawn]")
    select.select_option("after.position")
    drawn(visit, "other")
    before = listed(visit)
    visit.set("tolerance.strut.*.base.*", "0.0009")
    answer = answered("tolerance.strut.*.base.*=0.0009")["after.position"]
    assert select.input_value() == "after.position"
    assert listed(visit) == causes_of(answer) != before


def test_other_solutions_are_those_of_the_function(visit: Visit) -> None:
    page, machine = visit.page, tp.load(MACHINE)
    page.locator("#tab-modes").click()
    words = page.locator('[data-of="modes.words"]')
    words.wait_for(timeout=PATIENCE)
    visit.rest()
    assert shown_pose(visit) == [0.0, 0.0, 20.0, 0.0, 0.0, 0.0]
    pose = [0.0, 0.0, 20 * 0.0254, 0.0, 0.0, 0.0]
    found = tp.forward_solutions(machine, machine.inverse(pose), pose)
    assert words.inner_text() == (
        f"{len(found.poses)} found from {found.starts} starts, of which {found.converged} "
        "converged. Not proven complete: what no start reaches is not found."
    )
    for at in range(len(found.poses)):
        assert visit.number(f"modes.{at + 1}.distance") == found.apart[at, 0]
        assert visit.number(f"modes.{at + 1}.residual") == found.residual[at]
    panel = page.locator("[data-tab=modes]")
    assert "no other working mode" in panel.inner_text()
    panel.locator("form input").fill("40")
    panel.locator("form button").click()
    words.filter(has_text="41 starts").wait_for(timeout=PATIENCE)
    # What is no number of starts is refused where it is typed.
    panel.locator("form input").fill("0")
    panel.locator("form button").click()
    assert panel.locator("form input:invalid").count() == 1
    assert "41 starts" in words.inner_text()
