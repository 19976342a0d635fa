"""Module, INI and HAL file are of one export, or the module does not load and says which is not."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest
from module_under_test import exported
from real_linuxcnc import required, run

import truepose as tp
from benchmarks.kinematics_host import NEEDED, available, compiled, the_host
from command_line import MACHINES
from system_package import missing

MACHINE = "planar_two_slider"
HASH = "([0-9a-f]{8})"
PLACES = {
    "c": rf'#define HASH "{HASH}"',
    "ini": rf"KINEMATICS = \w+ ini={HASH}\n",
    "hal": rf"loadrt \[KINS\]KINEMATICS hal={HASH}\n",
}


def hashes(files: Mapping[str, str]) -> set[str]:
    """What the files of an export state: one, or they contradict each other."""
    return {hash_ for ending, place in PLACES.items() for hash_ in re.findall(place, files[ending])}


def the_hash(files: Mapping[str, str]) -> str:
    (found,) = hashes(files)
    return found


def test_whatever_changes_an_export_changes_its_hash(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / f"{MACHINE}.toml")
    again = tp.load(MACHINES / f"{MACHINE}.toml")
    assert the_hash(exported(machine)) == the_hash(exported(again))
    file = tmp_path / f"{MACHINE}.toml"
    file.write_text((MACHINES / file.name).read_text() + "\n# a remark\n")
    exports = [
        exported(machine),
        exported(machine, prefix="left"),
        exported(machine, rate_limit="0.5"),
        exported(machine, clamp="0.5 mm"),
        exported(machine, without="thermal"),
        exported(tp.load(MACHINES / f"{MACHINE}.toml", {"condition.temperature": "41 degC"})),
        exported(machine.replace({"strut.1.length": 0.5000000001})),
        exported(tp.load(file)),
    ]
    assert len({the_hash(files) for files in exports}) == len(exports)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The module, compiled, and its hash."""
    if not available():
        missing(f"no LinuxCNC headers: apt-get install --no-install-recommends {NEEDED}")
    files = exported(tp.load(MACHINES / f"{MACHINE}.toml"))
    source = tmp_path_factory.mktemp("module") / "kins.c"
    source.write_text(files["c"])
    return compiled(source), the_hash(files)


def started(library: Path, parameters: Mapping[str, str], folder: Path) -> None:
    """Load a copy, which is another library to the loader: in it no parameter is set."""
    copy = folder / f"copy{len(list(folder.iterdir()))}.so"
    shutil.copy(library, copy)
    the_host().load(copy, 2, parameters)


@pytest.mark.parametrize("wrong", ["ini", "hal"])
@pytest.mark.parametrize("given", [None, "", "00000000", "{}0", "ini={}"])
def test_the_module_does_not_start_with_another_hash(
    library: tuple[Path, str], wrong: str, given: str | None, tmp_path: Path
) -> None:
    module, own = library
    parameters = {"ini": own, "hal": own}
    started(module, parameters, tmp_path)
    del parameters[wrong]
    if given is not None:
        parameters[wrong] = given.format(own)
    with pytest.raises(OSError, match="does not start"):
        started(module, parameters, tmp_path)


def refusal(files: Mapping[str, str], folder: Path) -> str:
    """What LinuxCNC says, in one line, of files with which it does not start."""
    with pytest.raises(AssertionError) as caught:
        run(
            folder,
            {f"truepose_{MACHINE}.{ending}": text for ending, text in files.items()},
            [{"do": "home"}],
            axes="XY",
            joints=2,
        )
    return " ".join(str(caught.value).split())


@pytest.mark.parametrize(("wrong", "name"), [("hal", "HAL"), ("ini", "INI")])
def test_linuxcnc_does_not_start_with_a_file_of_another_export(
    wrong: str, name: str, tmp_path: Path
) -> None:
    required()
    machine = tp.load(MACHINES / f"{MACHINE}.toml")
    files = dict(exported(machine))
    other = exported(machine, rate_limit="0.5")
    files[wrong] = other[wrong]
    told = refusal(files, tmp_path)
    assert (
        f"the module has the hash {the_hash(exported(machine))}, the {name} file has "
        f"{the_hash(other)}. Take module, INI and HAL file from one export"
    ) in told
    assert "did not come to its end" in told


def test_linuxcnc_says_what_line_is_missing(tmp_path: Path) -> None:
    required()
    files = dict(exported(tp.load(MACHINES / f"{MACHINE}.toml")))
    own = the_hash(files)
    files["hal"] = files["hal"].replace(f" hal={own}", "")
    told = refusal(files, tmp_path)
    assert "the HAL file has none." in told
    assert f"it has the line: loadrt [KINS]KINEMATICS hal={own}" in told
