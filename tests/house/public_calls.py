"""Imports every submodule of the package, then uses every public name of it once on small machines.

    python tests/house/public_calls.py

test_public_functions.py runs it in a process of its own. An import may put a module in the place of
a function of the same name (`truepose.budget`), which shows only when everything is imported.
Prints the names that were used; a name of `truepose.__all__` without a use is an error.
"""

from __future__ import annotations

import importlib
import pkgutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import xarray as xr

import truepose as tp

ROOT = Path(__file__).parents[2]
MACHINES = ROOT / "machines"
DATA = ROOT / "examples" / "data"
POSE = [0.3, 0.2]
"""m, a pose of `small()`."""

LOG = "time (s),default (degC)\n0,20\n60,25\n"

Use = Callable[[], None]

USES: dict[str, Use] = {}
"""Public name -> a small use of it, which raises where the name is not what it should be."""


def use(name: str) -> Callable[[Use], Use]:
    """The function below is the use of the public `name`."""

    def kept(function: Use) -> Use:
        USES[name] = function
        return function

    return kept


def small() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def expect(kind: type, result: object) -> None:
    assert isinstance(result, kind), f"{type(result).__name__} instead of {kind.__name__}"


@use("accuracy")
def accuracy() -> None:
    assert {answer.state for answer in tp.accuracy(small(), POSE)}


@use("allocate")
def allocate() -> None:
    cost = 'bands = ["20 um", "50 um"]\nat = "20 um"\ncost = 4'
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
        path.write_text(f'{text}\n[[cost.tolerance]]\nof = "strut.*.length"\n{cost}\n')
        found = tp.allocate(tp.load(path))
        assert found.cost == 3.2
        assert '"50 um"' in found.text()


@use("tightening")
def tightening() -> None:
    advised = tp.tightening(small())
    assert advised is not None
    assert advised.enough


@use("bounds")
def bounds() -> None:
    expect(xr.Dataset, tp.bounds(small(), POSE))


@use("budget")
def budget() -> None:
    expect(xr.Dataset, tp.budget(small(), POSE))


@use("calibrate")
def calibrate() -> None:
    printer = tp.load(DATA / "delta_printer.toml")
    calibration = tp.calibrate(printer, DATA / "delta_heights.csv", robust=False)
    expect(xr.Dataset, calibration.dataset)


@use("check")
def check() -> None:
    assert tp.check(small()).met is False


@use("compare")
def compare() -> None:
    assert not tp.compare(small(), small()).changed


@use("compensate")
def compensate() -> None:
    expect(xr.Dataset, tp.compensate(small(), POSE))


@use("circular_test")
def circular_test() -> None:
    centre = {"x": 0.3, "y": 0.2}
    expect(xr.Dataset, tp.circular_test(small(), 0.02, centre, step=0.1, samples=100))


@use("correct_program")
def correct_program() -> None:
    with tempfile.TemporaryDirectory() as folder:
        part, corrected = Path(folder) / "part.ngc", Path(folder) / "corrected.ngc"
        part.write_text("G21 G90 G94 F600\nG0 X300 Y200\nG1 X301\nM2\n", encoding="utf-8")
        proof = tp.correct_program(small(), part, corrected, interpolation="pose", start={})
        assert proof.moves
        assert corrected.read_text(encoding="utf-8")


@use("errors")
def errors() -> None:
    try:
        tp.load(MACHINES / "planar_two_slider.toml", ["strut.1.nothing=1"])
    except tp.errors.TrueposeError:
        return
    raise AssertionError("a setting that leads nowhere is not refused")


@use("export")
def export() -> None:
    assert tp.export(small(), "c").files


@use("forward_solutions")
def forward_solutions() -> None:
    assert len(tp.forward_solutions(small(), small().inverse(POSE), starts=50).poses) == 2


@use("inverse_solutions")
def inverse_solutions() -> None:
    assert len(tp.inverse_solutions(small(), POSE).joints) == 4


@use("import_machine")
def import_machine() -> None:
    expect(tp.Machine, tp.import_machine(DATA / "printer.cfg").machine)


@use("load")
def load() -> None:
    expect(tp.Machine, small())


@use("monte_carlo")
def monte_carlo() -> None:
    expect(xr.Dataset, tp.monte_carlo(small(), POSE, 200))


@use("oddities")
def oddities() -> None:
    hot = tp.load(MACHINES / "planar_two_slider.toml", ["condition.temperature=308"])
    assert [oddity.code for oddity in tp.oddities(hot)] == ["odd-temperature"]
    assert tp.oddities(small()) == ()


@use("over_time")
def over_time() -> None:
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        log.write_text(LOG, encoding="utf-8")
        machine = tp.load(
            MACHINES / "linear_delta.toml",
            [f"condition.temperature_log={log}", "frame.material=steel"],
        )
        assert tp.over_time(machine).sizes["time"] == 2


@use("plan")
def plan() -> None:
    from truepose.calibration import Frame, Instrument

    tracker = Instrument("tracker", "position", Frame(), uncertainty={"m": 1e-5})
    assert len(tp.plan(small(), tracker, 4).poses) == 4


@use("part")
def part() -> None:
    with tempfile.TemporaryDirectory() as folder:
        program, features = Path(folder) / "part.ngc", Path(folder) / "part.toml"
        program.write_text("G21 G90 G94 F600\nG0 X300 Y200\nG1 X310\nM2\n", encoding="utf-8")
        features.write_text(
            '[[feature]]\nname = "edge"\nkind = "straightness"\nlines = "3"\nzone = "1 mm"\n',
            encoding="utf-8",
        )
        expect(xr.Dataset, tp.part(small(), program, features, samples=20))


@use("report")
def report() -> None:
    with tempfile.TemporaryDirectory() as folder:
        written = tp.report(small(), Path(folder) / "page.html")
        assert written.path is not None
        assert written.path.read_text(encoding="utf-8").startswith("<!doctype html>")


@use("shares")
def shares() -> None:
    expect(xr.Dataset, tp.shares(small(), POSE, samples=64))


@use("strain")
def strain() -> None:
    expect(xr.Dataset, tp.strain(tp.load(MACHINES / "overconstrained.toml")))


@use("study")
def study() -> None:
    varied = {"condition.temperature": "20,30 degC"}
    result = tp.study(MACHINES / "planar_two_slider.toml", varied, quantities=["error"])
    expect(xr.Dataset, result)


@use("threads")
def threads() -> None:
    assert tp.threads() >= 1


@use("uncertainty")
def uncertainty() -> None:
    expect(xr.Dataset, tp.uncertainty(small(), POSE))


@use("worst_case")
def worst_case() -> None:
    expect(xr.Dataset, tp.worst_case(small(), POSE))


@use("Condition")
def condition() -> None:
    warm = tp.Condition(default_temperature=298.15)
    expect(xr.Dataset, tp.budget(small(), POSE, warm))


@use("Input")
def input_of_a_function() -> None:
    given = {"a": tp.Input(1.0, 0.1), "b": tp.Input.exact(2.0)}
    expect(xr.Dataset, tp.worst_case(lambda a, b: a * b, given))


@use("Machine")
def machine() -> None:
    expect(type, tp.Machine)


@use("__version__")
def version() -> None:
    expect(str, tp.__version__)


def import_everything() -> int:
    """Import every submodule of the package -> how many there are."""

    def refuse(name: str) -> None:
        raise ImportError(f"{name} cannot be imported")

    names = [module.name for module in pkgutil.walk_packages(tp.__path__, "truepose.", refuse)]
    for name in names:
        importlib.import_module(name)
    return len(names)


def main() -> int:
    print(f"{import_everything()} submodules")
    unused = sorted(set(tp.__all__) - set(USES))
    gone = sorted(set(USES) - set(tp.__all__))
    assert not unused, f"public names without a use here: {unused}"
    assert not gone, f"used here, but no public names any more: {gone}"
    for name in tp.__all__:
        USES[name]()
        print(name)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
