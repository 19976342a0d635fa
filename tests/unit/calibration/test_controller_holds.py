"""A calibrated file says which geometry the controller works with, and goes on saying it."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import call
from truepose.calibration.calibrate import Calibration
from truepose.calibration.result.bands import tolerance_covariance
from truepose.errors import RequestError
from truepose.machine import Machine

DATA = Path(__file__).parents[3] / "examples" / "data"
DRAWING = DATA / "delta_printer.toml"
POSITIONS = DATA / "delta_positions.csv"
DAY = "2026-01-31"


@pytest.fixture(scope="module")
def found() -> Calibration:
    return tp.calibrate(tp.load(DRAWING), POSITIONS)


def former(found: Calibration, folder: Path, form: str) -> Path:
    """A file as earlier versions wrote it: without [controller]."""
    path = folder / "former.toml"
    found.save(path, original=DRAWING, date=DAY, controller_holds=form)  # type: ignore[arg-type]
    text = path.read_text("utf-8")
    line = f'[controller]\nholds = "{form}"\n'
    assert text.count(line) == 1
    path.write_text(text.replace(line, ""), encoding="utf-8")
    return path


def known(machine: Machine) -> np.ndarray:
    """(n_parameter,) what is known of each: its value and the middle of its band."""
    return np.asarray(machine.nominal + tolerance_covariance(machine).shift)


def test_both_forms_know_the_same_machine(found: Calibration, tmp_path: Path) -> None:
    untouched = found.save(tmp_path / "untouched.toml", original=DRAWING, date=DAY)
    loaded = found.save(
        tmp_path / "loaded.toml", original=DRAWING, date=DAY, controller_holds="calibrated"
    )
    assert (untouched.controller_holds, loaded.controller_holds) == ("drawing", "calibrated")
    assert np.array_equal(untouched.nominal, found.machine.nominal)
    assert not tolerance_covariance(loaded).shift.any()
    np.testing.assert_allclose(known(untouched), known(loaded), rtol=1e-12)
    assert found.calibrated().controller_holds == "calibrated"
    np.testing.assert_allclose(known(found.calibrated()), known(loaded), rtol=1e-12)


def test_the_former_word_warns_and_means_the_default(found: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    for word in (True, False):
        with pytest.warns(DeprecationWarning, match="controller_holds=") as caught:
            written = found.save(path, original=DRAWING, date=DAY, as_shifts=word)
        assert [Path(each.filename).name for each in caught] == [Path(__file__).name]
        assert written.controller_holds == "drawing"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found.save(path, original=DRAWING, date=DAY)


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        ({"controller_holds": "drawings"}, "unknown-choice"),
        ({"controller_holds": None}, "unknown-choice"),
        ({"controller_holds": "calibrated", "as_shifts": True}, "excluding-keys"),
    ],
)
def test_what_is_refused(
    asked: dict[str, object], code: str, found: Calibration, tmp_path: Path
) -> None:
    with pytest.raises(RequestError) as refused:
        found.save(tmp_path / "no.toml", original=DRAWING, date=DAY, **asked)  # type: ignore[arg-type]
    (problem,) = refused.value.problems
    assert problem.code == code
    assert "drawing" in (problem.expected or "")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("holds", ["drawing", "calibrated"])
def test_whose_geometry_stays_is_still_said(holds: str, found: Calibration, tmp_path: Path) -> None:
    """Calibrated again, the controller not touched since: nominal values stay, and their word."""
    first = tmp_path / "first.toml"
    found.save(first, original=DRAWING, date=DAY, controller_holds=holds)  # type: ignore[arg-type]
    machine = tp.load(first)
    again = tp.calibrate(machine, POSITIONS)
    second = again.save(tmp_path / "second.toml", original=first, date=DAY, force=True)
    assert second.controller_holds == holds
    assert np.array_equal(second.nominal, machine.nominal)
    third = again.save(
        tmp_path / "third.toml", original=first, date=DAY, controller_holds="calibrated", force=True
    )
    assert third.controller_holds == "calibrated"
    assert not tolerance_covariance(third).shift.any()
    assert (tmp_path / "third.toml").read_text("utf-8").count("[controller]") == 1


@pytest.mark.parametrize("form", ["drawing", "calibrated"])
def test_a_former_file_calibrated_again(
    form: str, found: Calibration, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nominal values cannot stay where it is not known whose they are; others may be written."""
    path, new = former(found, tmp_path, form), tmp_path / "new.toml"
    machine = tp.load(path)
    again = tp.calibrate(machine, POSITIONS)
    with pytest.raises(RequestError) as refused:
        again.save(new, original=path, date=DAY, force=True)
    assert [problem.code for problem in refused.value.problems] == ["controller-unsaid"]
    asked = ("--machine-output", new, "--date", DAY, "--force")
    done = call(capsys, "calibrate", path, POSITIONS, *asked)
    assert (done.code, done.out) == (2, "")
    assert "controller-unsaid" in done.err
    assert not new.exists()
    # A file whose nominal geometry is the one found is no drawing's.
    wrong = {"calibrated": "drawing"}.get(form, "")
    if wrong:
        said = ("--set", f"controller.holds={wrong}")
        done = call(capsys, "calibrate", path, POSITIONS, *asked, *said)
        assert (done.code, done.out) == (2, "")
        assert "controller-contradicted" in done.err
        assert "calibrate delta_printer.toml with delta_positions.csv again" in done.err
        assert not new.exists()
    done = call(capsys, "calibrate", path, POSITIONS, *asked, "--set", f"controller.holds={form}")
    assert done.code == 0
    assert tp.load(new).controller_holds == form
    assert np.array_equal(tp.load(new).nominal, machine.nominal)
    done = call(capsys, "calibrate", path, POSITIONS, *asked, "--controller-holds", "calibrated")
    assert done.code == 0
    assert tp.load(new).controller_holds == "calibrated"
