"""A Python for 64-bit ARM on a machine that is none: Debian's packages, unpacked and run by QEMU.

Nothing is installed into the system: apt works on lists of its own, packages are unpacked with
`dpkg -x`, and QEMU's user emulation translates instructions. Numbers are those of the ARM code;
times say nothing.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from release import BUILD

FOLDER = BUILD / "arm64"
PYTHON = "3.11"
"""Debian 12's."""
PACKAGES = (f"python{PYTHON}", "libstdc++6")
"""Of the second numpy takes what every system has."""
CONFIGURATION = """\
APT::Architecture "arm64";
APT::Architectures { "arm64"; };
APT::Sandbox::User "root";
Dir::State "%(apt)s/state";
Dir::State::status "%(apt)s/status";
Dir::Cache "%(apt)s/cache";
Dir::Log "%(apt)s/log";
"""


def python_command() -> list[str]:
    """What starts the ARM Python; it is fetched where that was not done before.

    Raises `subprocess.CalledProcessError` where Debian's packages are not to be had.
    """
    root, qemu = FOLDER / "root", FOLDER / "qemu" / "usr" / "bin" / "qemu-aarch64-static"
    python = root / "usr" / "bin" / f"python{PYTHON}"
    if not python.exists():
        _unpack(_arm_packages(), root)
    if not qemu.exists():
        _unpack([_emulator()], FOLDER / "qemu")
    return [str(qemu), "-L", str(root), str(python)]


def install(wheel: Path, folder: Path) -> None:
    """Install a wheel and what it needs for ARM into a folder, as pip would on such a machine."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--target", str(folder)]
    command += ["--only-binary=:all:", "--python-version", PYTHON, "--implementation", "cp"]
    command += ["--platform", "manylinux_2_17_aarch64", "--platform", "manylinux_2_28_aarch64"]
    subprocess.run([*command, str(wheel)], check=True)


def _arm_packages() -> list[Path]:
    """Python and all that it and numpy need, as files."""
    apt = FOLDER / "apt"
    for below in ("state/lists/partial", "cache/archives/partial", "log"):
        (apt / below).mkdir(parents=True, exist_ok=True)
    (apt / "status").touch()
    configuration = apt / "apt.conf"
    configuration.write_text(CONFIGURATION % {"apt": apt}, encoding="utf-8")
    environment = os.environ | {"APT_CONFIG": str(configuration)}
    install = ["install", "--yes", "--no-install-recommends", "--download-only"]
    for command in (["update"], [*install, *PACKAGES]):
        subprocess.run(
            ["apt-get", "--quiet=2", *command], env=environment, stdout=sys.stderr, check=True
        )
    return sorted((apt / "cache" / "archives").glob("*.deb"))


def _emulator() -> Path:
    """QEMU's package, of this machine's own architecture."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    command = ["apt-get", "--quiet=2", "download", "qemu-user-static"]
    subprocess.run(command, cwd=FOLDER, stdout=sys.stderr, check=True)
    (package,) = FOLDER.glob("qemu-user-static_*.deb")
    return package


def _unpack(packages: list[Path], root: Path) -> None:
    for package in packages:
        subprocess.run(["dpkg", "-x", str(package), str(root)], check=True)
