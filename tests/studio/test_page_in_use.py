"""The studio's page as somebody uses it: fields, answers, changes, tabs, by keys alone too."""

from __future__ import annotations

import json
import re
import signal
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import truepose as tp
from command_line import MACHINES, PLANAR
from served_studio import ServedStudio, started, studio_of
from studio_visit import NUMBER, PATIENCE, Visit, opened
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.errors import MachineFileError
from truepose.reporting.live import part
from truepose.verdict.answer import BEFORE

EXPANSION = "strut.1.expansion"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ServedStudio, Path]]:
    folder = tmp_path_factory.mktemp("used")
    (folder / "m.toml").write_bytes(PLANAR.read_bytes())
    with studio_of(folder / "m.toml", folder / "state") as one:
        yield one, folder


def test_a_value_changes_pixels_and_text_and_back_changes_neither(visit: Visit) -> None:
    before = visit.looks()
    visit.set("condition.temperature", "40")
    during = visit.looks()
    # The word of the verdict is the same; numbers and pictures are not.
    assert [name for name in before if during[name] == before[name]] == ["strip"]
    visit.set("condition.temperature", "35")
    assert visit.looks() == before


def test_numbers_are_those_of_the_commands_for_the_saved_file(visit: Visit) -> None:
    visit.set(EXPANSION, "2.3e-5 1/K")
    visit.page.locator("[data-studio=save]").click()
    visit.page.locator("[data-studio=save-name]").fill("warm.toml")
    visit.page.locator("[data-studio=save-form] button[type=submit]").click()
    visit.page.wait_for_selector("[data-saved='warm.toml']")
    answer = visit.page.locator("[data-studio=save-answer]").inner_text()
    assert "truepose report warm.toml" in answer
    machine = tp.load(visit.folder / "warm.toml")
    assert machine.parameters == tp.load(PLANAR).parameters
    budget = tp.budget(machine)
    assert visit.number("studio.largest.linear.position") == pytest.approx(
        float(budget["linear_maximum"].values.max()), rel=1e-12
    )
    for name, state in (("before", tp.accuracy(machine)[0]), ("after", tp.accuracy(machine)[-1])):
        for line, value in (("found", state.witness), ("proven", state.bound)):
            shown = visit.number(f"workspace.{name}.{line}.position")
            assert shown == pytest.approx(value.value, rel=1e-12)
    # What the page works out by itself is what the studio answers.
    quick = visit.number("before.known.position")
    assert quick == pytest.approx(visit.number("studio.known.position"), abs=1e-12)
    changed = (visit.folder / "warm.toml").read_text().splitlines()
    differ = [
        (ours, theirs)
        for ours, theirs in zip(changed, PLANAR.read_text().splitlines(), strict=True)
        if ours != theirs
    ]
    assert len(differ) == 1
    # The same name again is refused where it is asked, and replaced when that is said.
    visit.page.locator("[data-studio=save-form] button[type=submit]").click()
    visit.page.wait_for_selector("[data-studio=save-answer].problem")
    visit.page.locator("[data-studio=save-replace]").check()
    visit.page.locator("[data-studio=save-form] button[type=submit]").click()
    visit.page.wait_for_selector("[data-studio=save-answer]:not(.problem) code")


def test_a_refused_value_says_so_in_the_words_of_the_file(visit: Visit) -> None:
    key = "strut.1.section_area"
    with pytest.raises(MachineFileError) as failure:
        tp.load(PLANAR, [f"{key}=wide"])
    (problem,) = failure.value.problems
    visit.find(key)
    field = visit.input(key)
    before, undo = field.input_value(), visit.page.locator("[data-studio=undo]")
    steps = undo.get_attribute("title")
    field.fill("wide")
    field.press("Enter")
    visit.page.wait_for_selector(f'[data-key="{key}"] input[aria-invalid=true]')
    said = visit.problem(key).inner_text()
    assert problem.expected
    assert problem.expected in said
    assert "--set" not in said
    assert field.input_value() == "wide"
    described = field.get_attribute("aria-describedby").split()
    assert visit.problem(key).get_attribute("id") in described
    field.press("Escape")
    assert field.input_value() == before
    assert field.get_attribute("aria-invalid") is None
    assert visit.problem(key).inner_text() == ""
    assert undo.get_attribute("title") == steps
    assert visit.page.locator("[data-studio=edits]").inner_text() == "as in the file"


def test_what_was_refused_is_told_above_all_and_goes_with_a_reset(visit: Visit) -> None:
    key, page = "condition.temperature", visit.page
    told = page.locator("[data-studio=refused]")
    before, answers = visit.input(key).input_value(), visit.looks()
    assert told.is_hidden()
    visit.find(key)
    visit.input(key).fill("warm")
    visit.input(key).press("Enter")
    page.wait_for_selector("[data-studio=refused]:not([hidden])")
    assert told.inner_text() == "1 value refused"
    visit.find("nothing of this name")
    told.click()
    assert visit.input(key).evaluate("field => field === document.activeElement")
    page.locator("[data-studio=reset]").click()
    page.wait_for_selector("[data-studio=refused][hidden]", state="attached")
    assert visit.input(key).input_value() == before
    assert visit.problem(key).inner_text() == ""
    visit.rest()
    assert visit.looks() == answers


def test_another_condition_than_that_of_the_file_is_told_above_all(visit: Visit) -> None:
    edits, page = visit.page.locator("[data-studio=edits]"), visit.page
    assert edits.inner_text() == "as in the file"
    note = page.locator("[data-studio=condition]")
    assert note.is_hidden()
    page.locator('[data-of="temperature"] input[type=number]').fill("50")
    page.wait_for_selector("[data-studio=condition]:not([hidden])")
    assert edits.inner_text() == "as in the file; shown at other temperatures or another load"
    cards = page.locator("[data-studio=cards]")
    assert note.bounding_box()["y"] < cards.bounding_box()["y"]
    page.locator("[data-live=reset]").click()
    page.wait_for_selector("[data-studio=condition][hidden]", state="attached")
    visit.rest()


def test_a_material_is_chosen_from_a_list(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_bytes((MACHINES / "hexapod.toml").read_bytes())
    key = "strut.1.material"
    with studio_of(tmp_path / "m.toml", tmp_path / "state") as studio:
        visit = opened(browser, studio, tmp_path)
        visit.rest()
        visit.find(key)
        chosen = visit.page.locator(f'[data-key="{key}"] select')
        assert chosen.input_value() == "steel"
        chosen.select_option("invar")
        visit.page.wait_for_selector(f'[data-key="{key}"].edited')
        visit.rest()
        machine = tp.load(tmp_path / "m.toml", settings={key: "invar"})
        of_file = tp.load(tmp_path / "m.toml")
        position = tp.accuracy(machine, states=(BEFORE,))[0].linear.value
        assert visit.number("workspace.before.linear.position") == pytest.approx(position, 1e-9)
        assert abs(position - tp.accuracy(of_file, states=(BEFORE,))[0].linear.value) > 1e-6
        visit.page.close()
    assert visit.complaints == []


def test_undo_redo_reset_and_the_difference(visit: Visit) -> None:
    key, page = "condition.temperature", visit.page
    before = visit.looks()
    visit.set(key, "41")
    changed = visit.looks()
    row = page.locator(f'[data-key="{key}"]')
    assert "edited" in row.get_attribute("class").split()
    page.locator("[data-studio=difference]").click()
    page.wait_for_selector("[data-studio=difference-text] .came")
    lines = page.locator("[data-studio=difference-text] span").all_inner_texts()
    signs = [line.strip() for line in lines if re.match(r"[+-](?![+-])", line)]
    assert len(signs) == 2
    assert "41" in signs[1]
    page.keyboard.press("Escape")
    edits = page.locator("[data-studio=edits]")
    for button, looks, value in (
        ("undo", before, "35"),
        ("redo", changed, "41"),
        ("reset", before, "35"),
        ("undo", changed, "41"),
    ):
        page.locator(f"[data-studio={button}]").click()
        page.wait_for_function(
            "([key, value]) => document.querySelector(`[data-key='${key}'] input`).value === value",
            arg=[key, value],
        )
        visit.rest()
        assert visit.looks() == looks
        assert ("1" in edits.inner_text()) is (value == "41")
    # The field's own button takes its change back.
    row.locator("button.back").click()
    page.wait_for_function(
        "key => document.querySelector(`[data-key='${key}'] input`).value === '35'", arg=key
    )
    visit.rest()
    assert visit.looks() == before


def test_what_is_stale_is_grey_and_then_fresh(visit: Visit) -> None:
    """Held at the moment between the state and its answers, which the socket gives later."""
    seen = visit.page.evaluate(
        """async key => {
          const cards = document.querySelector("[data-studio=cards]"), seen = [cards.dataset.stale];
          const words = [];
          new MutationObserver(() => {
            if (cards.dataset.stale !== seen.at(-1)) {
              seen.push(cards.dataset.stale);
              words.push(document.querySelector("[data-studio=status]").dataset.state);
            }
          }).observe(cards, {attributes: true, attributeFilter: ["data-stale"]});
          const input = document.querySelector(`[data-key="${key}"] input`);
          input.value = "44";
          input.dispatchEvent(new Event("change"));
          return new Promise(done => {
            const look = () => seen.length >= 3 ? done([seen, words]) : setTimeout(look, 5);
            look();
          });
        }""",
        "condition.temperature",
    )
    stale, status = seen
    assert stale[:3] == ["no", "yes", "no"]
    assert status[0] == "computing"
    visit.rest()


def test_arrow_keys_step_the_last_digit_and_are_one_step(visit: Visit) -> None:
    key = "condition.temperature"
    visit.find(key)
    field = visit.input(key)
    field.focus()
    for _ in range(3):
        field.press("ArrowUp")
    visit.page.wait_for_function(
        "key => document.querySelector(`[data-key='${key}'] input`).value === '38'"
        " && document.querySelector('[data-studio=edits]').textContent.includes('1')",
        arg=key,
    )
    visit.rest()
    with visit.studio.window() as window:
        state = window.until("state")
    assert state["edits"] == [[key, "38"]]
    before = state["undo"]
    field.press("ArrowDown")
    visit.rest()
    visit.page.locator("[data-studio=undo]").click()
    visit.page.wait_for_function(
        "key => document.querySelector(`[data-key='${key}'] input`).value === '35'", arg=key
    )
    visit.rest()
    with visit.studio.window() as window:
        assert window.until("state")["undo"] == before - 1


STEPPED = [
    ("0.0005", 6, 1, "0.0006"),
    ("[-0.0005, 0.0005]", 4, -1, "[-0.0006, 0.0005]"),
    ("[-0.0005, 0.0005]", 16, 1, "[-0.0005, 0.0006]"),
    ("210 GPa", 0, 10, "220 GPa"),
    ("1.1e-5 1/K", 3, 1, "1.2e-5 1/K"),
    ("0.1", 3, -2, "-0.1"),
    ("-0.1", 4, 1, "0.0"),
    ('{ default = 20, "strut.1" = 35 }', 24, 1, '{ default = 20, "strut.1" = 36 }'),
    ("none", 2, 1, None),
]


def test_a_number_in_a_text_is_stepped(visit: Visit) -> None:
    source = Path(part.__file__).parents[2] / "studio" / "page" / "stepped.js"
    stepped = f"""cases => {{ {source.read_text()}
      const said = one => (stepped(...one) || {{text: null}}).text;
      return cases.map(said); }}"""
    found = visit.page.evaluate(stepped, [list(case[:3]) for case in STEPPED])
    assert found == [case[3] for case in STEPPED]


def test_two_windows_show_the_same_and_keep_their_tabs(browser: Any, visit: Visit) -> None:
    other = opened(browser, visit.studio, visit.folder)
    other.page.locator("#tab-budget").click()
    visit.page.bring_to_front()
    visit.set("condition.temperature", "39")
    slider = visit.page.locator('[data-of="pose.x"] input[type=number]')
    slider.fill("320")
    slider.press("Enter")
    other.page.bring_to_front()
    other.page.wait_for_function(
        """() => document.querySelector('[data-of="pose.x"] input[type=number]').value === "320"
          && document.querySelector('[data-key="condition.temperature"] input').value === "39" """,
        timeout=PATIENCE,
    )
    other.rest()
    assert other.page.locator("#tab-budget").get_attribute("aria-selected") == "true"
    assert visit.page.locator("#tab-budget").get_attribute("aria-selected") == "false"
    assert visit.number("studio.known.position") == other.number("studio.known.position")
    other.page.close()


def test_a_pose_is_gone_to_and_the_studio_answers_for_it(visit: Visit) -> None:
    page = visit.page
    page.locator(
        "[data-studio=largest] tr:has([data-of='studio.largest.known.position']) .go"
    ).click()
    page.wait_for_function(
        f"""() => {{ const number = {NUMBER};
          return number("studio.known.position") === number("studio.largest.known.position"); }}""",
        timeout=PATIENCE,
    )
    visit.rest()
    quick = visit.number("before.known.position")
    assert quick == pytest.approx(visit.number("studio.largest.known.position"), abs=1e-12)


def test_a_dropped_file_of_measurements_is_answered(browser: Any, tmp_path: Path) -> None:
    data = MACHINES.parent / "examples" / "data"
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "d.toml").write_bytes((data / "delta_printer.toml").read_bytes())
    with studio_of(tmp_path / "m" / "d.toml", tmp_path / "state") as studio:
        visit = opened(browser, studio, tmp_path / "m")
        visit.page.locator("#tab-calibration").click()
        visit.page.set_input_files("#dropped-file", data / "delta_positions.csv")
        answer = visit.page.locator("[data-of='calibration.answer']")
        answer.wait_for(timeout=PATIENCE)
        machine = tp.load(data / "delta_printer.toml")
        said = tp.calibrate(machine, data / "delta_positions.csv").dataset.attrs["answer"]
        assert answer.inner_text() == said
        visit.page.locator("[data-tab=calibration] form input").fill("3")
        visit.page.locator("[data-tab=calibration] form button").click()
        visit.page.wait_for_selector("[data-tab=calibration] .scroll .go", timeout=PATIENCE)
        shown = visit.page.locator("[data-tab=calibration] .go").all_inner_texts()
        instruments = read_measurements(data / "delta_positions.csv", machine).instruments
        planned = tp.plan(machine, instruments, 3)
        first = planned.poses[planned.rank.tolist().index(1)]
        assert len(shown) == 3
        numbers = [float(one.replace("−", "-")) for one in re.findall(r"[−\d.]+", shown[0])]
        assert numbers == [round(1000 * float(value), 3) for value in first]
        for count in (1, 2, 3):
            assert visit.number(f"planned.{count}.position") == planned.rms[count, 0]
        # What cannot be read is refused in its own words.
        visit.page.set_input_files(
            "#dropped-file", {"name": "b.csv", "mimeType": "text/csv", "buffer": b"\xff\xfe1"}
        )
        problem = visit.page.locator("[data-tab=calibration] > .problem")
        problem.filter(has_text="UTF-8").wait_for(timeout=PATIENCE)
        assert visit.complaints == []
        visit.page.close()


def test_a_studio_that_ends_is_found_again_with_its_state(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "m" / "m.toml"
    file.parent.mkdir()
    file.write_bytes(PLANAR.read_bytes())
    with studio_of(file, tmp_path / "state") as studio:
        visit = opened(browser, studio, file.parent)
        visit.rest()
        visit.set("condition.temperature", "43")
        looks = visit.looks()
        studio.process.send_signal(signal.SIGKILL)
        studio.process.wait(60)
        visit.page.wait_for_selector("[data-studio=status][data-state=lost]", timeout=PATIENCE)
        assert visit.page.locator("[data-studio=cards]").get_attribute("data-stale") == "yes"
        visit.input("condition.temperature").fill("44")
        visit.input("condition.temperature").press("Enter")
        visit.problem("condition.temperature").filter(has_text="not answer").wait_for()
        visit.input("condition.temperature").press("Escape")
        again = started(file, tmp_path / "state", "--port", str(studio.port))
        try:
            assert again.address == studio.address
            visit.rest()
            assert visit.input("condition.temperature").input_value() == "43"
            assert visit.looks() == looks
        finally:
            again.end()
            for pipe in (again.process.stdout, again.process.stderr):
                if pipe is not None:
                    pipe.close()
        visit.page.close()


def test_a_file_that_changes_is_offered_to_be_read_again(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "m" / "m.toml"
    file.parent.mkdir()
    file.write_bytes(PLANAR.read_bytes())
    with studio_of(file, tmp_path / "state") as studio:
        visit = opened(browser, studio, file.parent)
        visit.rest()
        notice = visit.page.locator("[data-studio=changed]")
        assert notice.is_hidden()
        visit.set("condition.temperature", "43")
        text = PLANAR.read_text()
        assert tomllib.loads(text)["accuracy"]
        file.write_text(text.replace("[accuracy]", "# by somebody else\n[accuracy]", 1))
        notice.wait_for(state="visible", timeout=PATIENCE)
        visit.page.locator("[data-studio=reload]").click()
        notice.wait_for(state="hidden", timeout=PATIENCE)
        visit.page.wait_for_selector("html[data-studio-ready=yes]", timeout=PATIENCE)
        visit.rest()
        assert visit.input("condition.temperature").input_value() == "43"
        assert visit.complaints == []
        visit.page.close()


def test_without_webassembly_the_studio_answers_alone(browser: Any, visit: Visit) -> None:
    other = opened(browser, visit.studio, visit.folder, "delete globalThis.WebAssembly")
    page = other.page
    page.wait_for_selector("[data-studio=status][data-state=rest]", timeout=PATIENCE)
    assert page.locator("[data-studio=alone]").is_visible()
    assert page.locator(".live-body").is_hidden()
    slider = page.locator('[data-studio=controls] [data-of="pose.x"] input[type=number]')
    slider.fill("330")
    slider.press("Enter")
    page.wait_for_function(
        """() => document.querySelector("[data-studio=largest] .caption")
          .textContent.includes("330")""",
        timeout=PATIENCE,
    )
    error = tp.budget(tp.load(PLANAR), [[0.33, 0.2]])["overall_error"].values[0]
    size = float((error**2).sum() ** 0.5)
    assert other.number("studio.known.position") == pytest.approx(size, rel=1e-9)
    assert other.complaints == []
    page.close()


def test_keys_alone_find_a_field_change_it_and_undo_it(visit: Visit) -> None:
    page = visit.page

    def tab_to(wanted: str) -> None:
        for _ in range(400):
            page.keyboard.press("Tab")
            if page.evaluate("wanted => document.activeElement.matches(wanted)", wanted):
                return
        raise AssertionError(wanted)

    page.evaluate("() => document.activeElement.blur()")
    tab_to("#studio-filter")
    page.keyboard.type("condition.temperature")
    tab_to('[data-key="condition.temperature"] input')
    page.keyboard.type("42")  # a field that is reached by keys is selected
    page.keyboard.press("Enter")
    page.wait_for_function(
        "() => document.querySelector('[data-studio=edits]').textContent.includes('1')"
    )
    assert visit.input("condition.temperature").input_value() == "42"
    tab_to("[data-live=reset]")
    page.keyboard.press("Control+z")
    page.wait_for_function(
        "key => document.querySelector(`[data-key='${key}'] input`).value === '35'",
        arg="condition.temperature",
    )
    tab_to("[role=tab][aria-selected=true]")
    visit.rest()


def test_everything_that_can_be_used_is_reached_by_tab(visit: Visit) -> None:
    visit.page.evaluate(
        "() => { for (const one of document.querySelectorAll('details')) one.open = true; }"
    )
    wanted, reached = visit.page.evaluate(
        """() => {
          const all = [...document.querySelectorAll(
            "button, input, select, a[href], summary, canvas[tabindex], [role=tab]")];
          const shown = all.filter(one => one.checkVisibility({visibilityProperty: true}));
          const reached = shown.filter(one => one.tabIndex >= 0 || one.role === "tab");
          return [shown.length, reached.length];
        }"""
    )
    assert wanted > 80
    assert reached == wanted


@pytest.mark.parametrize("width", [1400, 800, 400])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_serious_keeps_people_from_using_it(width: int, scheme: str, visit: Visit) -> None:
    from axe_playwright_python.sync_playwright import Axe

    page = visit.page
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    visit.set("condition.temperature", "36")
    visit.find("")
    found = []
    for tab in ("sources", "shares", "calibration", "part", "studies", "modes"):
        page.locator(f"#tab-{tab}").click()
        visit.rest()
        found += Axe().run(page).response["violations"]
    wide, window = page.evaluate(
        "() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    page.emulate_media(color_scheme="light")
    assert wide <= window
    assert not [
        (one["id"], json.dumps(one["nodes"][0]["html"])[:200])
        for one in found
        if one["impact"] in {"serious", "critical"}
    ]
