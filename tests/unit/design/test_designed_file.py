"""The design as a machine file: only what was chosen changes, and every command reads it."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from designs import beyond, file_with, row, unseen
from family_machines import family_file
from machine_file import text_of
from truepose.design import option_combination
from truepose.design.options import machine_of
from truepose.design.programme import Programme
from truepose.design.search import DesignSearch, Task
from truepose.design.space import DesignSpace
from truepose.sources.tolerance import bands_of

Capture = pytest.CaptureFixture[str]
RODS = """[[cost.choice]]
name = "rods"
of = "strut.*"
options = [ # what the shop has
  { name = "steel", set = {}, cost = 0 },
  { name = "steel, stiffer", set = { stiffness = "60 N/um" }, cost = 20 },
  { name = "carbon", set = { material = "carbon fibre", stiffness = "30 N/um" }, cost = 18 },
]
"""
HOT = "[case.hot]\ntemperature = 32\n"


@pytest.fixture
def hexapod(tmp_path: Path) -> Path:
    return file_with(tmp_path, "hexapod", RODS, HOT)


@pytest.fixture
def hearing() -> Iterator[None]:
    """Ctrl-C is heard, also where the tests run in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_only_what_was_chosen_changes(hexapod: Path, tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "designed.toml"
    done = call(capsys, "allocate", hexapod, "--set", "accuracy.target=0.12 mm", "-o", out)
    assert done.code == 0, done.err
    assert f"wrote {out}" in done.err
    assert "rods" in done.out
    before, after = hexapod.read_text().splitlines(), out.read_text().splitlines()
    known = set(before)
    new = [line for line in after if line not in known]
    assert new
    assert all(
        line.startswith(("length_tolerance", '"strut.', "target", "material", "stiffness"))
        for line in new
    )
    comments = [line for line in before if "#" in line]
    assert comments
    assert all(line in after for line in comments)
    for command in ("check", "budget"):
        assert call(capsys, command, out).code == 0
    machine = tp.load(out)
    assert machine.costs is not None
    assert beyond(machine, unseen(machine, 2000)) == 0


def test_the_file_is_the_design(hexapod: Path, tmp_path: Path) -> None:
    found = tp.allocate(tp.load(hexapod, ["accuracy.target=0.12 mm"]))
    found.save(tmp_path / "designed.toml")
    read, own = bands_of(tp.load(tmp_path / "designed.toml")), bands_of(found.designed)
    assert read is not None
    assert own is not None
    assert read.parameters.tolist() == own.parameters.tolist()
    assert read.half == pytest.approx(own.half, rel=1e-9)
    assert sum(one.cost for one in (*found.grades, *found.options)) == pytest.approx(found.cost)
    assert found.cases == ("condition", "hot")


def test_the_same_run_twice_writes_the_same(hexapod: Path, tmp_path: Path, capsys: Capture) -> None:
    said = []
    for name in ("one.toml", "two.toml"):
        done = call(capsys, "allocate", hexapod, "--format", "json", "-o", tmp_path / name)
        assert done.code == 2  # the file's own 0.1 mm is out of reach of these grades, hot
        done = call(
            capsys, "allocate", hexapod, "--format", "json", "-o", tmp_path / name,
            "--set", "accuracy.target=0.12 mm",
        )  # fmt: skip
        assert done.code == 0
        said.append(done.out)
    assert said[0] == said[1]
    assert (tmp_path / "one.toml").read_bytes() == (tmp_path / "two.toml").read_bytes()
    document = json.loads(said[0])
    assert document["command"] == "allocate"
    found = tp.allocate(tp.load(hexapod, ["accuracy.target=0.12 mm"]))
    assert document["variables"]["cost"]["values"] == pytest.approx(found.cost)
    assert document["variables"]["cost"]["units"] == "EUR"
    assert document["attributes"]["proven"] == "these poses"
    halves = document["variables"]["half"]
    assert halves["units"] == "in"
    assert halves["values"] == pytest.approx(
        [half / 0.0254 for grade in found.grades for half in grade.halves]
    )


def test_tolerances_as_files_state_them(tmp_path: Path) -> None:
    """Middles, distributions and groups stay; what differs within a pattern gets its own names."""
    path = file_with(
        tmp_path,
        "planar_two_slider",
        rows=(
            row("strut.*.length", tie="kind"),
            row("drive.*.offset", bands='["10 um", "40 um"]'),
            row("strut.*.base.[xy]", tie="kind"),
        ),
    )
    text = path.read_text()
    text = text.replace("length_tolerance = [-0.3, 0.3]", "length_tolerance = [-0.01, 0.05]", 1)
    text = text.replace(
        "[frame]",
        '[tolerance]\n"drive.*.offset" = { standard_deviation = 0.02, sigmas = 2 } # a normal one\n'
        '"strut.*.base.x" = { band = 0.3, group = "jig", sign = -1 }\n"tool.x" = 0.01\n\n[frame]',
    )
    path.write_text(text)
    found = tp.allocate(tp.load(path))
    found.save(tmp_path / "designed.toml")
    text = (tmp_path / "designed.toml").read_text()
    machine = tp.load(tmp_path / "designed.toml")
    bands = bands_of(machine)
    assert bands is not None
    halves = {
        name: half
        for one in found.grades
        for name, half in zip(one.features, one.halves, strict=True)
    }
    for at, parameter in enumerate(bands.parameters.tolist()):
        name = machine.parameters[parameter]
        assert bands.half[0, at] == pytest.approx(halves.get(name, 1e-5), rel=1e-9)
    length = bands.parameters.tolist().index(machine.parameters.index("strut.1.length"))
    assert bands.shift[0, length] == pytest.approx(2e-5)
    offset = bands.parameters.tolist().index(machine.parameters.index("drive.d1.offset"))
    assert bands.distribution[offset].name == "normal"
    assert bands.distribution[offset].sigmas == 2.0
    assert 'group = "jig"' in text
    assert '"tool.x" = 0.01' in text
    assert beyond(machine, unseen(machine, 2000)) == 0


def test_the_parameters_of_a_family(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    text = text_of(family_file("linear_delta"))
    rows = row("family.rod.*") + row("drive.*.offset", tie="kind")
    path.write_text(f'{text}\n[cost]\nunit = "EUR"\n\n{rows}')
    found = tp.allocate(tp.load(path, ["accuracy.target=0.4 mm"]))
    found.save(tmp_path / "designed.toml")
    machine = tp.load(tmp_path / "designed.toml")
    bands = bands_of(machine)
    assert bands is not None
    chosen = {one.name: one.halves[0] for one in found.grades}
    quantities = {
        bands.group_names[number]: one.half for number, one in bands.group_quantities.items()
    }
    for name in ("family.rod.a", "family.rod.b", "family.rod.c"):
        assert quantities[name] == pytest.approx(chosen[name])
    assert beyond(machine, unseen(machine, 2000)) == 0


def test_every_option_shifts_as_the_machine_so_set(hexapod: Path) -> None:
    machine = tp.load(hexapod)
    space = DesignSpace(machine)
    task = Task(machine, {"condition": machine.condition}, (1e-4, None), False, 0.01)
    search = DesignSearch(space, task, lambda *_: ())
    poses = unseen(machine, 20)
    seen = []
    for number, option in enumerate(space.slots[0].choice.options):
        settings = [f"strut.*.{key}={value}" for key, value in option.settings]
        budget = tp.budget(tp.load(hexapod, settings), poses)["overall_error"].values
        bands = search.bands(machine_of(machine, space, (number,)))
        assert search.models(bands)[0].at(poses).value == pytest.approx(budget, abs=1e-15)
        seen.append(np.abs(budget).max())
    assert len(set(seen)) == 3


def test_after_compensation_costs_less(hexapod: Path, tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "designed.toml"
    settings = ("--set", "accuracy.target=0.12 mm")
    done = call(capsys, "allocate", hexapod, "--after", *settings, "-o", out, "--format", "json")
    assert done.code == 0
    after = json.loads(done.out)["variables"]["cost"]["values"]
    before = tp.allocate(tp.load(hexapod, ["accuracy.target=0.12 mm"])).cost
    assert after < before
    machine = tp.load(out)
    for condition in (machine.condition, *machine.cases.values()):
        poses = unseen(machine, 300)
        answers = tp.accuracy(machine, poses, condition, states=("after compensation",))
        assert all(answer.met for answer in answers)


def test_ctrl_c_keeps_the_best(hexapod: Path, hearing: None) -> None:
    machine = tp.load(hexapod, ["accuracy.target=0.12 mm"])

    def stop(done: int, _: int) -> None:
        if done == 4:
            signal.raise_signal(signal.SIGINT)

    found = tp.allocate(machine, progress=stop)
    assert found.interrupted
    whole = tp.allocate(machine)
    assert not whole.interrupted
    assert found.lower_bound <= whole.cost <= found.cost
    assert beyond(found.designed, unseen(machine, 2000)) == 0
    with pytest.raises(KeyboardInterrupt):
        tp.allocate(machine, progress=lambda *_: signal.raise_signal(signal.SIGINT))


def test_ctrl_c_on_the_command_line(
    hexapod: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(option_combination.OptionCombination, "cheapest", interrupted)
    out = tmp_path / "designed.toml"
    settings = ("--set", "accuracy.target=0.12 mm")
    done = call(capsys, "allocate", hexapod, *settings, "-o", out, "--format", "json")
    assert done.code == 130
    assert "Interrupted after" in done.err
    assert json.loads(done.out)["attributes"]["interrupted"] == 1
    assert tp.load(out)


def test_ctrl_c_while_the_solver_works(hearing: None) -> None:
    random = np.random.default_rng(0)
    ties, grades = 60, 6
    tie_of = np.repeat(np.arange(ties), grades)
    cost = random.uniform(1.0, 2.0, tie_of.size)
    rows = random.uniform(0.0, 1.0, (40, tie_of.size))
    most = np.full(40, 0.42 * ties)
    programme = Programme(cost, tie_of)
    timer = threading.Timer(0.7, lambda: signal.pthread_kill(main, signal.SIGINT))
    main = threading.main_thread().ident
    assert main is not None
    timer.start()

    def many() -> None:
        for number in range(1000):
            programme.whole(rows, most - 1e-3 * number, 0.0)

    with pytest.raises(KeyboardInterrupt):
        many()
    timer.join()
