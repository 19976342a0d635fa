"""The store: it goes on, it is read as any other, and nobody writes over another study."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import PLANAR
from truepose.cluster import evaluator
from truepose.errors import RequestError
from truepose.studies import store as stores
from truepose.studies import study as studies
from truepose.studies.lock import lock_file, only_writer
from truepose.studies.store import StudyStore

zarr = pytest.importorskip("zarr")
xr = pytest.importorskip("xarray")

VARY = ["strut.*.length=380,500,520 mm", "condition.temperature=20:40:4 degC"]


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "study.zarr"


class StopError(Exception):
    pass


def broken_off(store: Path, after: int, failure: BaseException, **asked: Any) -> Any:
    """A study that ends by `failure` when so many variants are evaluated."""

    def progress(done: int, total: int) -> None:
        if done == after:
            raise failure

    return tp.study(PLANAR, VARY, output=store, progress=progress, **asked)


def same_content(one: Any, other: Any) -> None:
    """The same arrays, coordinates and plan, to the last bit."""
    assert one.attrs["plan_hash"] == other.attrs["plan_hash"]
    assert set(one.variables) == set(other.variables)
    for name, variable in one.variables.items():
        values, others = variable.values, other.variables[name].values
        assert values.dtype == others.dtype, name
        if values.dtype == object:
            assert values.tolist() == others.tolist(), name
        else:
            assert values.tobytes() == others.tobytes(), name


def test_a_store_has_what_is_computed_in_memory(store: Path) -> None:
    in_memory = tp.study(PLANAR, VARY)
    stored = tp.study(PLANAR, VARY, output=store)
    xr.testing.assert_identical(in_memory, stored)
    assert list(in_memory.data_vars) == list(stored.data_vars)
    assert list(in_memory.coords) == list(stored.coords)
    same_content(in_memory, stored)
    assert sorted(path.name for path in store.parent.iterdir()) == ["study.zarr"]


def test_xarray_reads_it_as_any_other(store: Path) -> None:
    stored = tp.study(PLANAR, VARY, output=store)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        opened = xr.open_zarr(store).load()
        assert xr.open_dataset(store, engine="zarr").identical(opened)
    for name, variable in opened.variables.items():
        np.testing.assert_array_equal(variable.values.astype(stored[name].dtype), stored[name])
        assert {"units", "long_name"} <= variable.attrs.keys(), name
    assert zarr.open_group(str(store), mode="r").metadata.zarr_format == 3
    chosen = opened.sel(variant=opened["status"] == "ok")
    assert chosen.sizes["variant"] == 8
    assert opened["value"].sel(variable="strut.*.length").values[:3].tolist() == [380, 500, 520]
    assert opened["variable_units"].values.tolist() == ["mm", "degC"]


@pytest.mark.parametrize("after", [1, 5, 11])
def test_it_goes_on_where_it_ended(store: Path, after: int) -> None:
    whole = tp.study(PLANAR, VARY)
    with pytest.raises(StopError):
        broken_off(store, after, StopError())
    assert int(StudyStore(store).done().sum()) == after - 1
    calls: list[tuple[int, int]] = []
    again = tp.study(PLANAR, VARY, output=store, progress=lambda *told: calls.append(told))
    left = 12 - (after - 1)
    assert calls == [(done, left) for done in range(1, left + 1)]
    same_content(whole, again)


def test_a_finished_store_computes_nothing(store: Path) -> None:
    whole = tp.study(PLANAR, VARY, output=store)
    before = {path: path.stat().st_mtime_ns for path in store.rglob("*")}
    again = tp.study(PLANAR, VARY, output=store, progress=lambda *_: pytest.fail("computed"))
    same_content(whole, again)
    assert {path: path.stat().st_mtime_ns for path in store.rglob("*")} == before


def test_ctrl_c_gives_what_is_done(store: Path) -> None:
    part = broken_off(store, 6, KeyboardInterrupt())
    assert part.attrs["interrupted"] == 1
    assert part["done"].values.tolist() == [True] * 5 + [False] * 7
    assert part["status"].values[5:].tolist() == ["not computed"] * 7
    whole = tp.study(PLANAR, VARY, output=store)
    assert whole.attrs["interrupted"] == 0
    same_content(whole, tp.study(PLANAR, VARY))
    np.testing.assert_array_equal(part["known"].values[:5], whole["known"].values[:5])


def test_ctrl_c_in_memory_gives_what_is_done_too() -> None:
    def progress(done: int, total: int) -> None:
        if done == 4:
            raise KeyboardInterrupt

    part = tp.study(PLANAR, VARY, progress=progress)
    assert part["done"].sum() == 3
    assert part.attrs["interrupted"] == 1


def test_the_plan_is_never_drawn_again(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {"design": "latin-hypercube", "count": 6, "seed": 4}
    vary = ["condition.temperature=20:40 degC"]
    first = tp.study(PLANAR, vary, output=store, quantities=["error"], **asked)

    def other(*_: Any) -> Any:
        raise AssertionError("drawn")

    drawn = studies.plan_of
    monkeypatch.setattr(studies, "plan_of", lambda *a: shifted(drawn(*a)))
    again = tp.study(PLANAR, vary, output=store, quantities=["error"], **asked)
    same_content(first, again)


def shifted(plan: Any) -> Any:
    """The plan as another version of SciPy might draw it."""
    from dataclasses import replace

    return replace(plan, settings=plan.settings[::-1], values=plan.values[::-1])


def test_what_a_lost_process_left_is_swept(store: Path) -> None:
    with pytest.raises(StopError):
        broken_off(store, 4, StopError())
    orphan = store / "known" / "c" / "0.0123456789abcdef.partial"
    orphan.write_bytes(b"half")
    folder = store.parent / ".study.01234567.zarr"
    folder.mkdir()
    (folder / "zarr.json").write_text("{}")
    other = store.parent / ".study2.01234567.zarr"
    other.mkdir()
    same_content(tp.study(PLANAR, VARY), tp.study(PLANAR, VARY, output=store))
    assert not orphan.exists()
    assert not folder.exists()
    assert other.exists(), "it may be of a store that somebody makes"


CHANGES: dict[str, tuple[dict[str, Any], str]] = {
    "vary": ({"vary": [VARY[0], "condition.temperature=20:40:3 degC"]}, "what is varied"),
    "settings": ({"settings": ["accuracy.target=1"]}, "what is set for all variants"),
    "quantities": ({"quantities": ["error"]}, "the quantities"),
    "reach": ({"reach": 0.5}, "the reach"),
    "seed": ({"seed": 1}, "the seed"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_store_of_another_study_is_refused(store: Path, change: str) -> None:
    tp.study(PLANAR, VARY, output=store)
    before = content(store)
    asked, word = CHANGES[change]
    with pytest.raises(RequestError) as caught:
        tp.study(PLANAR, **{"vary": VARY, "output": store, **asked})
    assert [problem.code for problem in caught.value.problems] == ["other-study"]
    assert f"{word} is another" in str(caught.value)
    assert content(store) == before


def test_another_design_differs_in_its_count_too(store: Path) -> None:
    tp.study(PLANAR, VARY, output=store)
    with pytest.raises(RequestError) as caught:
        tp.study(PLANAR, VARY, design="sobol", count=4, output=store)
    assert [problem.message.split(": ")[1] for problem in caught.value.problems] == [
        "the design is another", "the count of variants is another",
    ]  # fmt: skip


def test_a_machine_file_or_data_file_that_changed_is_another_study(
    tmp_path: Path, store: Path
) -> None:
    machine = tmp_path / "machine.toml"
    text = PLANAR.read_text().replace("\ntemperature = 35", '\ntemperature_log = "log.csv"', 1)
    machine.write_text(text)
    log = tmp_path / "log.csv"
    log.write_text("time (s),default (degC)\n0,20\n60,30\n")
    vary = ["strut.*.length=500,520 mm"]
    tp.study(machine, vary, output=store)
    log.write_text("time (s),default (degC)\n0,20\n60,31\n")
    with pytest.raises(RequestError, match="the data files is another") as caught:
        tp.study(machine, vary, output=store)
    assert "log.csv" in str(caught.value)
    log.write_text("time (s),default (degC)\n0,20\n60,30\n")
    machine.write_text(text + "# a comment\n")
    with pytest.raises(RequestError, match="the machine file is another"):
        tp.study(machine, vary, output=store)


def test_another_version_is_another_study(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tp.study(PLANAR, VARY, output=store)
    monkeypatch.setattr(studies, "version", lambda: "0.2.0")
    with pytest.raises(RequestError, match="the version of truepose is another"):
        tp.study(PLANAR, VARY, output=store)


def test_it_goes_on_with_the_instructions_it_was_begun_with(
    store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from truepose._kernel import instruction_set

    monkeypatch.setattr(evaluator, "instruction_set", lambda: "scalar")
    with pytest.raises(StopError):
        broken_off(store, 3, StopError())
    monkeypatch.undo()
    told: list[str] = []
    tp.study(PLANAR, VARY, output=store, progress=lambda *_: told.append(instruction_set()))
    assert set(told) == {"scalar"}
    assert instruction_set() != "scalar"


def test_instructions_that_are_not_here_are_refused(
    store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evaluator, "instruction_set", lambda: "scalar")
    tp.study(PLANAR, VARY, output=store)
    zarr.open_group(str(store), mode="r+").attrs["study"] = (
        StudyStore(store).attrs["study"].replace('"scalar"', '"avx1024"')
    )
    with pytest.raises(RequestError, match="instructions that this processor has not") as caught:
        tp.study(PLANAR, VARY, output=store)
    assert [problem.code for problem in caught.value.problems] == ["other-study"]


def test_a_plan_that_was_changed_is_refused(store: Path) -> None:
    with pytest.raises(StopError):
        broken_off(store, 3, StopError())
    zarr.open_group(str(store), mode="r+")["setting"][7, 0] = "999 mm"
    with pytest.raises(RequestError, match="not the one that was drawn"):
        tp.study(PLANAR, VARY, output=store)


@pytest.mark.parametrize("make", ["folder", "zarr", "dataset", "broken"])
def test_what_is_no_store_of_a_study_is_not_written_over(store: Path, make: str) -> None:
    if make == "folder":
        store.mkdir()
        (store / "notes.txt").write_text("mine")
    elif make == "zarr":
        zarr.create_array(str(store), shape=(3,), dtype="f8")
    elif make == "dataset":
        xr.Dataset({"a": ("x", np.zeros(3))}).to_zarr(store, consolidated=False)
    else:
        tp.study(PLANAR, VARY, output=store)
        (store / "zarr.json").write_text('{"zarr_format": 3, "node')
    before = content(store)
    with pytest.raises(RequestError) as caught:
        tp.study(PLANAR, VARY, output=store)
    assert [problem.code for problem in caught.value.problems] == ["output-exists"]
    assert content(store) == before


def content(store: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in store.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("name", "code"),
    [("study.nc", "output-ending"), ("study", "output-ending"), ("no/study.zarr",
      "output-not-writable"), ("file.zarr", "output-not-writable"),
     ("a\0b.zarr", "output-not-writable")],
)  # fmt: skip
def test_where_no_store_can_be(name: str, code: str, tmp_path: Path) -> None:
    (tmp_path / "file.zarr").write_text("a file")
    with pytest.raises(RequestError) as caught:
        tp.study(PLANAR, VARY, output=str(tmp_path / name))
    assert [problem.code for problem in caught.value.problems] == [code]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file.zarr"]


HOLDING = """
import sys, time
from pathlib import Path
from truepose.studies.lock import only_writer
with only_writer(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(600)
"""


def holder(store: Path) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDING, str(store)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "locked\n"
    return process


def test_a_second_writer_is_told_who_writes(store: Path) -> None:
    process = holder(store)
    try:
        with pytest.raises(RequestError) as caught:
            tp.study(PLANAR, VARY, output=store)
        (problem,) = caught.value.problems
        assert problem.code == "store-in-use"
        assert problem.found is not None
        assert f"process {process.pid} on " in problem.found
        assert not store.exists()
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    # What it left is nobody's.
    assert lock_file(store).exists()
    assert tp.study(PLANAR, VARY, output=store)["done"].all()
    assert not lock_file(store).exists()


def test_the_lock_is_free_after_any_end(store: Path) -> None:
    with pytest.raises(StopError), only_writer(store):
        raise StopError
    with only_writer(store), pytest.raises(RequestError, match="store-in-use"), only_writer(store):
        pass
    assert not lock_file(store).exists()


def full_after(count: int) -> Callable[..., Any]:
    """What writes a key of a store, until there is no room for more."""
    whole, written = zarr.storage.LocalStore.set, []

    async def put(self: Any, key: str, *given: Any, **more: Any) -> None:
        written.append(key)
        if len(written) > count:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        await whole(self, key, *given, **more)

    return put


@pytest.mark.parametrize("count", [90, 120, 150])
def test_a_full_disk_ends_it_and_it_goes_on(
    count: int, store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zarr.storage.LocalStore, "set", full_after(count))
    with pytest.raises(RequestError) as caught:
        tp.study(PLANAR, VARY, output=store)
    (problem,) = caught.value.problems
    assert problem.code == "output-not-writable"
    assert problem.found == "No space left on device"
    assert "the same command goes on" in str(problem.hint)
    done = int(StudyStore(store).done().sum())
    assert 0 < done < 12
    assert f"{done} of 12 variants done" in str(problem.hint)
    monkeypatch.undo()
    same_content(tp.study(PLANAR, VARY), tp.study(PLANAR, VARY, output=store))


def test_a_disk_that_is_full_from_the_start(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zarr.storage.LocalStore, "set", full_after(5))
    with pytest.raises(RequestError, match="No space left on device"):
        tp.study(PLANAR, VARY, output=store)
    assert list(store.parent.iterdir()) == []


def test_without_zarr_there_is_no_store(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stores, "find_spec", lambda _: None)
    with pytest.raises(RequestError, match="extra-missing"):
        tp.study(PLANAR, VARY, output=store)
    assert tp.study(PLANAR, VARY)["done"].all(), "in memory it needs none"
