"""Builds wheels and the sdist into dist/; of Linux wheels auditwheel says what they run on.

`python -m release.build [NAME ...]`, names of release/targets.py or `sdist`. Linux is linked by
zig, on any machine; macOS and Windows on their own. Needs what release/requirements.txt lists.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

from release import DIST, ROOT
from release.targets import DEFAULT, SDIST, TARGETS, Target

WEB_KERNEL = "truepose/_kernel.wasm.gz"
"""The kernel for pages, which every distribution has: `make web` builds it."""

SBOMS = ".dist-info/sboms/"
"""Where a wheel says what it was built from (PEP 770); maturin writes it."""


def main() -> int:
    """0, or 2 with a sentence where something is missing or a wheel is not what it says."""
    parser = argparse.ArgumentParser(prog="python -m release.build", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(TARGETS)} or {SDIST}")
    names = parser.parse_args().names or list(DEFAULT)
    if unknown := set(names) - {*TARGETS, SDIST}:
        parser.error(f"no target {', '.join(sorted(unknown))}; there are {', '.join(TARGETS)}")
    DIST.mkdir(exist_ok=True)
    try:
        require_web_kernel()
        for name in names:
            built = source_distribution() if name == SDIST else wheel(TARGETS[name])
            print(f"{built.relative_to(ROOT)}: {built.stat().st_size / 1e6:.2f} MB", flush=True)
    except RuntimeError as error:
        print(f"release.build: {error}", file=sys.stderr)
        return 2
    return 0


def require_web_kernel() -> None:
    """Raise `RuntimeError` where the kernel for pages was not built."""
    if not (ROOT / "python" / WEB_KERNEL).exists():
        raise RuntimeError(
            "there is no kernel for pages; run: rustup target add wasm32-unknown-unknown, make web"
        )


def source_distribution() -> Path:
    """The sdist."""
    return _new_file("*.tar.gz", [*_maturin("sdist")])


def wheel(target: Target) -> Path:
    """A wheel, looked at.

    Raises `RuntimeError` where Rust's library for the target is missing, or the wheel runs on fewer
    systems than its name says.
    """
    rust = subprocess.run(
        ["rustc", "--print", "sysroot"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
    )
    if not (Path(rust.stdout.strip()) / "lib" / "rustlib" / target.triple).exists():
        raise RuntimeError(
            f"Rust has no library for {target.triple}; run: rustup target add {target.triple}"
        )
    command = [*_maturin("build"), "--release", "--locked", "--target", target.triple]
    if target.is_linux:
        command += ["--zig", "--compatibility", target.compatibility]
    built = _new_file("*.whl", command)
    look_at(built, target)
    return built


def look_at(built: Path, target: Target) -> None:
    """Refuse a wheel that is not what it says.

    Not abi3, without its SBOM or the kernel for pages, or for fewer systems than in its name.
    """
    python, _, platforms = built.stem.partition("-abi3-")
    # Several, where older installers know the same systems by another name.
    tags = platforms.split(".")
    if not python.endswith("-cp311") or not any(tag.startswith(target.tag) for tag in tags):
        raise RuntimeError(f"{built.name} is not cp311-abi3-{target.tag}")
    with zipfile.ZipFile(built) as archive:
        names = archive.namelist()
    if not any(SBOMS in name for name in names):
        raise RuntimeError(f"{built.name} has no SBOM")
    if WEB_KERNEL not in names:
        raise RuntimeError(f"{built.name} has no kernel for pages")
    if target.is_linux and (said := audited_tag(built)) != target.tag:
        raise RuntimeError(f"auditwheel says {said} of {built.name}")


def audited_tag(built: Path) -> str:
    """The platform tag that auditwheel finds a Linux wheel consistent with."""
    run = subprocess.run(
        [sys.executable, "-m", "auditwheel", "show", "--json", str(built)],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return str(json.loads(run.stdout)["overall_tag"])


def _maturin(command: str) -> tuple[str, ...]:
    return (sys.executable, "-m", "maturin", command, "--out", str(DIST))


def _new_file(pattern: str, command: list[str]) -> Path:
    """The file that a command of maturin's writes into dist/."""
    commit = subprocess.run(
        ["git", "log", "-1", "--format=%ct"], cwd=ROOT, stdout=subprocess.PIPE, check=False
    )
    environment = {"SOURCE_DATE_EPOCH": commit.stdout.decode().strip() or "0"} | os.environ
    # zig comes as a Python package: it is asked of this Python, not of one on the PATH.
    environment["CARGO_ZIGBUILD_PYTHON_PATH"] = sys.executable
    before = {path: path.stat().st_mtime_ns for path in DIST.glob(pattern)}
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    (new,) = (p for p in DIST.glob(pattern) if before.get(p) != p.stat().st_mtime_ns)
    return new


if __name__ == "__main__":
    sys.exit(main())
