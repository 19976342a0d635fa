"""The studies beside a machine file: what a store says of its variants, and one that is set."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import PLANAR
from served_studio import ServedStudio, studio_of
from studio_visit import PATIENCE, Visit
from truepose.errors import RequestError
from truepose.studio.answers import Question
from truepose.studio.messages import fits
from truepose.studio.tabs import TABS
from truepose.studio.tabs.studies import MOST_DRAWN, MOST_VARIANTS

VARY = ["strut.*.length=380,500,520 mm", "strut.1.material=steel,aluminium"]
SETTINGS = {"condition.temperature": "30", "accuracy.target": "0.7 mm"}


def told(folder: Path, **options: Any) -> Any:
    question = Question(tp.load(folder / "m.toml"), options=options, folder=folder)
    (value,) = TABS["studies"].give(question)
    assert fits({"type": "tab", "number": 1, "name": "studies", "value": value})
    return json.loads(json.dumps(value, allow_nan=False))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    inside = tmp_path_factory.mktemp("studies") / "machine"
    inside.mkdir()
    (inside / "m.toml").write_bytes(PLANAR.read_bytes())
    tp.study(inside / "m.toml", VARY, settings=SETTINGS, output=inside / "a.zarr")
    tp.study(inside / "m.toml", VARY, output=inside.parent / "secret.zarr", quantities=["error"])
    (inside / "empty.zarr").mkdir()
    (inside / "other.zarr").mkdir()
    (inside / "other.zarr" / "zarr.json").write_text('{"attributes": {}}')
    (inside / "link.zarr").symlink_to(inside.parent / "secret.zarr")
    return inside


def test_studies_are_listed_and_nothing_else(folder: Path) -> None:
    assert told(folder) == {"stores": ["a.zarr"], "stores_left_out": 0}


def test_a_study_is_that_of_the_function(folder: Path) -> None:
    machine = tp.load(folder / "m.toml")
    study = told(folder, store="a.zarr")["study"]
    whole = tp.study(machine, VARY, settings=SETTINGS)
    assert study["machine_hash"] == machine.file_hash
    assert dict(study["settings"]) == SETTINGS
    assert study["variables"] == whole["variable"].values.tolist()
    assert study["asked"] == {"position": 0.0005, "orientation": None}  # of the file as it is now
    assert study["counts"] == {"ok": 4, "infeasible": 2, "failed": 0, "not computed": 0}
    (cause,) = study["causes"]
    assert (cause["count"], cause["reason"]) == (2, whole["reason"].values[cause["first"]])
    sizes = whole["linear_maximum"].values[:, 0]
    numbers = [row["number"] for row in study["rows"]]
    assert sizes[numbers].tolist() == sorted(sizes[np.isfinite(sizes)])
    assert study["left_out"] == 0
    for row in study["rows"]:
        there = whole.isel(variant=row["number"])
        assert row["settings"] == there["setting"].values.tolist()
        assert row["linear_maximum"] == {"position": float(there["linear_maximum"][0])}
        assert row["known"] == {"position": float(there["known"][0])}
        assert list(row["answers"].values()) == there["answer"].values.tolist()
    words = {word for row in study["rows"] for (word,) in row["answers"].values()}
    assert words == {"met", "NOT met"}
    drawn = study["drawn"]
    assert drawn["numbers"] == numbers
    assert list(drawn["axes"]) == ["strut.*.length"]  # a material is no number
    assert drawn["axes"]["strut.*.length"] == whole["value"].values[numbers, 0].tolist()
    assert drawn["sizes"]["position"] == sizes[numbers].tolist()


def test_a_study_of_many_variants_and_variables_is_cut(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_bytes(PLANAR.read_bytes())
    vary = ["condition.temperature=20:40 degC", "each:strut.*.length=499:501 mm"]
    several = {"design": "latin-hypercube", "count": 300, "quantities": ["error"]}
    whole = tp.study(tmp_path / "m.toml", vary, output=tmp_path / "many.zarr", **several)
    study = told(tmp_path, store="many.zarr")["study"]
    assert (len(study["rows"]), study["left_out"]) == (MOST_VARIANTS, 300 - MOST_VARIANTS)
    assert len(study["drawn"]["numbers"]) == MOST_DRAWN
    sizes = study["drawn"]["sizes"]["position"]
    assert sizes == sorted(sizes)
    every = whole["linear_maximum"].values
    assert (sizes[0], sizes[-1]) == (every.min(), every.max())
    assert list(study["drawn"]["axes"]) == study["variables"]
    assert "answers" not in study["rows"][0]


@pytest.mark.parametrize(
    "name",
    ["../secret.zarr", "link.zarr", "/etc", "none.zarr", ".", "", "a\0b", "x" * 5000, "m.toml"],
)
def test_no_store_of_another_folder_is_read(name: str, folder: Path) -> None:
    with pytest.raises(RequestError) as failure:
        told(folder, store=name)
    (problem,) = failure.value.problems
    assert problem.code == "file-missing"
    assert "secret" not in problem.message


def test_what_is_no_study_is_told(folder: Path) -> None:
    for name, code in ((3, "bad-argument"), ("empty.zarr", "output-exists")):
        with pytest.raises(RequestError) as failure:
            told(folder, store=name)
        assert failure.value.problems[0].code == code


# --- in the page


@pytest.fixture(scope="module")
def served(folder: Path) -> Iterator[tuple[ServedStudio, Path]]:
    with studio_of(folder / "m.toml", folder.parent / "state") as one:
        yield one, folder


def test_a_variant_that_is_set_has_its_numbers(visit: Visit, folder: Path) -> None:
    page, study = visit.page, told(folder, store="a.zarr")["study"]
    visit.set("strut.2.modulus", "205 GPa")  # is taken back by what is set
    page.locator("#tab-studies").click()
    page.locator("[data-tab=studies] select").first.select_option("a.zarr")
    page.wait_for_selector("[data-tab=studies] [data-variant]", timeout=PATIENCE)
    assert page.locator("[data-tab=studies] .problem").all_inner_texts() == [""]
    plain = page.evaluate("() => document.querySelector('[data-tab=studies] canvas').toDataURL()")
    best, other = study["rows"][0], study["rows"][-1]
    for row in (best, other):
        number = row["number"]
        assert visit.number(f"study.{number}.known.position") == row["known"]["position"]
        page.locator(f"[data-variant='{number}']").click()
        for key, value in [
            *study["settings"],
            *zip(study["variables"], row["settings"], strict=True),
        ]:
            page.wait_for_function(
                """([key, value]) => {
                  const row = document.querySelector(`[data-key="${key}"]`);
                  return !row || row.querySelector("input, select").value === value;
                }""",
                arg=[key, value],
                timeout=PATIENCE,
            )
        visit.rest()
        assert visit.input("strut.2.modulus").input_value() == "210 GPa"
        reached = visit.number("studio.largest.linear.position")
        assert reached == pytest.approx(row["linear_maximum"]["position"], rel=1e-12)
    page.locator("[data-tab=studies] select").nth(2).select_option(index=0)
    assert plain.startswith("data:image/png")
