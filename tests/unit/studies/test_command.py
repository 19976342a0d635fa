"""`truepose study`: what it prints, how it ends, what it refuses."""

from __future__ import annotations

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call
from sweeps import sweep
from truepose.cli import _progress
from truepose.cli import study as command
from truepose.reporting import variants
from truepose.studies.ranking import ranked

Capture = pytest.CaptureFixture[str]
VARY = ("--vary", "strut.*.length=380,500,520 mm", "--vary", "condition.temperature=20,35 degC")
STUDY = ("study", PLANAR, *VARY)


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "study.zarr"


def test_the_table_has_the_best_variants_and_why_others_are_none(
    store: Path, capsys: Capture
) -> None:
    outcome = call(capsys, *STUDY, "--output", store)
    assert (outcome.code, outcome.err) == (0, f"wrote {store}\n")
    lines = [" ".join(line.split()) for line in outcome.out.splitlines()]
    assert "variants 6" in lines
    assert "ok 4" in lines
    assert "infeasible 2" in lines
    study = tp.study(PLANAR, VARY[1::2])
    order = ranked(study)[: variants.MOST_SHOWN].tolist()
    sizes = study["linear_maximum"].values[order, 0]
    assert sizes.tolist() == sorted(sizes)
    shown = [line for line in lines if line[:1].isdigit() and " mm " in line]
    assert [int(line.split()[0]) for line in shown] == order
    for line, number in zip(shown, order, strict=True):
        assert line.endswith(f"{1e6 * study['linear_maximum'].values[number, 0]:.1f}")
        assert " / ".join(study["answer"].values[number, 0]) in line
    assert any(line.startswith("infeasible 2 0 ") and "25 poses lost" in line for line in lines)


def test_a_page_is_written_beside_the_store(store: Path, capsys: Capture) -> None:
    page = store.with_suffix(".html")
    outcome = call(capsys, *STUDY, "--output", store, "--report", page)
    assert (outcome.code, outcome.err) == (0, f"wrote {store}\nwrote {page}\n")
    assert "How the error goes with each variable" in page.read_text("utf-8")


def test_a_dry_run_writes_no_page(store: Path, capsys: Capture) -> None:
    outcome = call(capsys, *STUDY, "--dry-run", "--report", store.with_suffix(".html"))
    assert outcome.code == 2
    assert "leave out --report" in outcome.err
    assert not store.with_suffix(".html").exists()


def test_the_same_command_says_that_it_goes_on(store: Path, capsys: Capture) -> None:
    first = call(capsys, *STUDY, "--output", store)
    again = call(capsys, *STUDY, "--output", store)
    assert again.out == first.out
    assert again.err == f"{store}: 6 of 6 variants are done, going on\nwrote {store}\n"


def test_csv_is_a_row_a_variant_in_the_units_of_the_file(store: Path, capsys: Capture) -> None:
    outcome = call(capsys, *STUDY, "--output", store, "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(outcome.out)))
    study = tp.study(PLANAR, VARY[1::2])
    assert [row["status"] for row in rows] == study["status"].values.tolist()
    for number, row in enumerate(rows):
        assert float(row["strut.*.length [mm]"]) == study["value"].values[number, 0]
        assert float(row["condition.temperature [degC]"]) == study["value"].values[number, 1]
        if row["status"] == "ok":
            linear = 1000.0 * study["linear_maximum"].values[number, 0]
            assert float(row["linear_maximum_position [mm]"]) == pytest.approx(linear, rel=1e-14)
            assert row["answer_before_compensation_position"] in ("met", "NOT met")
        else:
            assert row["linear_maximum_position [mm]"] == ""
            assert row["reason"]


def test_json_has_every_variable(store: Path, capsys: Capture) -> None:
    outcome = call(capsys, *STUDY, "--output", store, "--format", "json")
    told = json.loads(outcome.out)
    study = tp.study(PLANAR, VARY[1::2])
    assert told["command"] == "study"
    assert set(told["variables"]) >= set(study.data_vars)
    assert told["variables"]["status"]["values"] == study["status"].values.tolist()


@pytest.mark.parametrize("form", ["table", "json", "csv"])
def test_a_dry_run_says_how_many_how_long_how_large(
    form: str, store: Path, capsys: Capture
) -> None:
    outcome = call(capsys, *STUDY, "--dry-run", "--format", form)
    assert (outcome.code, outcome.err) == (0, "")
    assert list(store.parent.iterdir()) == []
    if form == "table":
        assert "6 variants of 2 variables, each at 25 poses" in outcome.out
        assert "on this computer, by 3 variants that were evaluated" in outcome.out
        assert "MB in" in outcome.out
        return
    if form == "json":
        told = json.loads(outcome.out)["dry_run"]
    else:
        (told,) = csv.DictReader(io.StringIO(outcome.out))
    assert int(told["variants"]) == 6
    assert 0.0 < float(told["seconds"]) < 600.0
    call(capsys, *STUDY, "--output", store)
    files = [path for path in store.rglob("*") if path.is_file()]
    size = sum(-(-path.stat().st_size // 4096) * 4096 for path in store.rglob("*"))
    assert 0.5 * size < int(told["bytes"]) < 2.0 * size
    assert 0.5 * len(files) < int(told["files"]) < 2.0 * len(files)


@pytest.mark.parametrize(
    ("more", "codes"),
    [
        (("--vary", "strut.*.lenght=1,2 mm"), ["unknown-key"]),
        (("--vary", "drive.d1.mass=1 kg:1000 g:3"), ["bad-vary"]),
        (("--vary", "drive.*.mass=1:2:100000 kg", "--vary", "frame.mass=1:2:10000 kg"),
         ["study-too-large"]),
        (("--design", "sobol"), ["bad-design"]),
        (("--count", "3"), ["bad-design"]),
        (("--design", "grid"), ["unknown-choice"]),
        (("--quantities", "errors"), ["unknown-choice"]),
        (("--reach", "ninety"), ["bad-reach"]),
        (("--reach", "120 %"), ["bad-reach"]),
        (("--seed", "-1", "--design", "sobol", "--count", "3"), ["bad-seed"]),
        (("--set", "strut.9.length=3"), ["bad-setting"]),
    ],
)  # fmt: skip
def test_bad_input(more: tuple[str, ...], codes: list[str], store: Path, capsys: Capture) -> None:
    outcome = call(capsys, *STUDY, "--output", store, *more)
    assert (outcome.code, outcome.codes, outcome.out) == (2, codes, "")
    assert list(store.parent.iterdir()) == []


def test_it_writes_or_it_says_what_it_would(store: Path, capsys: Capture) -> None:
    for more in ((), ("--output", store, "--dry-run")):
        outcome = call(capsys, *STUDY, *more)
        assert outcome.code == 2
        assert "either --output STORE.zarr, or --dry-run" in outcome.err


def test_another_plan_says_which_part(store: Path, capsys: Capture) -> None:
    call(capsys, *STUDY, "--output", store)
    outcome = call(
        capsys, *STUDY, "--output", store, "--reach", "90 %", "--set", "accuracy.target=1"
    )
    assert (outcome.code, outcome.codes) == (2, ["other-study", "other-study"])
    assert "what is set for all variants is another" in outcome.err
    assert "the reach is another" in outcome.err


MANY = ("--vary", "strut.1.length=490:510:60 mm", "--quantities", "error,verdict")


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=sweep)])
def test_a_signal_leaves_a_store_that_goes_on(number: int, store: Path, capsys: Capture) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "truepose", "study", str(PLANAR), *MANY, "--output", str(store)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    first = store / "done" / "c" / "0"
    begun = time.monotonic()
    while not first.exists() and process.poll() is None and time.monotonic() - begun < 100.0:
        time.sleep(0.01)
    process.send_signal(number)
    out, err = process.communicate(timeout=100)
    assert first.exists(), err
    assert (process.returncode, out) == (128 + number, "")
    if number == signal.SIGINT:
        assert f"of 60 variants stand in {store}; the same command goes on." in err
    assert sorted(path.name for path in store.parent.iterdir()) == ["study.zarr"]
    rest = tp.study(PLANAR, [MANY[1]], quantities=["error", "verdict"], output=store)
    assert int(rest["done"].sum()) == 60


def test_a_study_of_the_hexapod_by_latin_hypercube(store: Path, capsys: Capture) -> None:
    outcome = call(
        capsys, "study", MACHINES / "hexapod.toml", "--vary", "strut.*.stiffness=30:120 N/um",
        "--vary", "strut.*.material=steel,invar", "--design", "latin-hypercube", "--count", "4",
        "--seed", "3", "--quantities", "error", "--output", store,
    )  # fmt: skip
    assert outcome.code == 0
    assert "ok 4" in " ".join(outcome.out.split())
    stored = tp.study(
        MACHINES / "hexapod.toml",
        {"strut.*.stiffness": "30:120 N/um", "strut.*.material": "steel,invar"},
        design="latin-hypercube", count=4, seed=3, quantities=["error"], output=store,
    )  # fmt: skip
    assert stored["done"].all()
    assert sorted(stored["setting"].values[:, 1].tolist()) == ["invar"] * 2 + ["steel"] * 2


def test_progress_counts_what_is_left(
    store: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its rate and the time left, as all long work (`cli._progress`)."""
    told: list[tuple[int, int]] = []
    what: list[tuple[str, str]] = []

    @contextmanager
    def progress(name: str, unit: str) -> Iterator[Callable[[int, int], None]]:
        what.append((name, unit))

        def report(done: int, total: int) -> None:
            told.append((done, total))
            if (done, total) == (3, 6):
                raise KeyboardInterrupt

        yield report

    monkeypatch.setattr(_progress, "progress", progress)
    outcome = call(capsys, *STUDY, "--output", store)
    assert (outcome.code, outcome.out) == (130, "")
    assert f"Interrupted: 2 of 6 variants stand in {store}" in outcome.err
    assert call(capsys, *STUDY, "--output", store).code == 0
    assert what == [("study", "variants")] * 2
    assert told == [(1, 6), (2, 6), (3, 6), (1, 4), (2, 4), (3, 4), (4, 4)]


def test_help_names_every_quantity_and_design() -> None:
    from truepose.studies.design import DESIGNS
    from truepose.studies.quantities import QUICK_NAMES, REGISTRY

    options = {param.name: getattr(param, "help", None) or "" for param in command.command.params}
    for quantity in REGISTRY:
        assert quantity.name in options["quantities"]
    assert f"[default: {','.join(QUICK_NAMES)}]" in options["quantities"]
    for design in DESIGNS:
        assert design in options["design"]
