"""What is in the sdist, and which wheels are refused."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from release import ROOT, build
from release.targets import DEFAULT, SDIST, TARGETS
from system_package import missing

LINUX = TARGETS["manylinux-x86_64"]
NAME = "truepose-0.1.0-cp311-abi3-manylinux2014_x86_64.manylinux_2_17_x86_64.whl"
SBOM = "truepose-0.1.0.dist-info/sboms/truepose-python.cyclonedx.json"


def test_the_sdist_has_what_a_kernel_is_built_from(tmp_path: Path) -> None:
    if not shutil.which("cargo"):
        missing("no cargo")
    command = [sys.executable, "-m", "maturin", "sdist", "--out", str(tmp_path)]
    environment = os.environ | {"CARGO_NET_OFFLINE": "true"}
    subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        files = {path.name.partition("/")[2] for path in archive.getmembers()}
    assert {"Cargo.lock", "Cargo.toml", "LICENSE", "README.md", "pyproject.toml"} <= files
    # How cargo is to compile; without it sensitivities would be slower, and nobody would know.
    assert ".cargo/config.toml" in files
    library = {f"python/truepose/machine_library/{p.name}" for p in (ROOT / "machines").iterdir()}
    assert library <= files
    languages = (ROOT / "python/truepose/languages").glob("*.po")
    assert {path.relative_to(ROOT).as_posix() for path in languages} <= files
    sources = (ROOT / "crates").glob("*/src/**/*.rs")
    built = {path.relative_to(ROOT).as_posix() for path in sources}
    assert built
    assert built <= files


def test_what_is_built_by_default_is_known() -> None:
    assert set(DEFAULT) <= {*TARGETS, SDIST}


@pytest.mark.parametrize(
    ("name", "content", "audited", "said"),
    [
        (NAME, [SBOM, build.WEB_KERNEL], LINUX.tag, None),
        (NAME, [SBOM], LINUX.tag, "no kernel for pages"),
        (
            NAME,
            [SBOM, build.WEB_KERNEL],
            "manylinux_2_28_x86_64",
            "auditwheel says manylinux_2_28_x86_64",
        ),
        (NAME, ["truepose/_kernel.abi3.so"], LINUX.tag, "no SBOM"),
        (NAME.replace("abi3", "cp311"), [SBOM], LINUX.tag, "is not cp311-abi3"),
        (NAME.replace("2_17", "2_28"), [SBOM], LINUX.tag, "is not cp311-abi3-manylinux_2_17"),
        (NAME.replace("x86_64", "aarch64"), [SBOM], LINUX.tag, "is not cp311-abi3"),
    ],
)
def test_a_wheel_that_is_not_what_it_says_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    content: list[str],
    audited: str,
    said: str | None,
) -> None:
    wheel = tmp_path / name
    with zipfile.ZipFile(wheel, "w") as archive:
        for file in content:
            archive.writestr(file, "")
    monkeypatch.setattr(build, "audited_tag", lambda built: audited)
    if said is None:
        build.look_at(wheel, LINUX)
    else:
        with pytest.raises(RuntimeError, match=said):
            build.look_at(wheel, LINUX)


def test_nothing_is_built_without_the_kernel_for_pages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(build, "ROOT", tmp_path)
    monkeypatch.setattr(build, "DIST", tmp_path)
    monkeypatch.setattr(sys, "argv", ["build", SDIST])
    assert build.main() == 2
    assert "make web" in capsys.readouterr().err


def test_a_target_that_rust_has_no_library_for_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    if not shutil.which("rustc"):
        missing("no rustc")
    target = build.Target("riscv64gc-unknown-linux-none", "manylinux_2_31", "manylinux_2_31")
    with pytest.raises(RuntimeError, match="rustup target add riscv64gc-unknown-linux-none"):
        build.wheel(target)
