"""What an installation takes of a disk, a line a package: `python -m release.installed_size WHAT`.

WHAT is what pip is asked for, such as dist/truepose-1.0.0-...whl or `truepose[report]`. It goes
into a folder of its own, which is counted before anything has run: with the byte code that pip
wrote.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from importlib.metadata import distributions
from pathlib import Path

MEGABYTE = 1e6


def main() -> int:
    """0, or pip's exit code."""
    parser = argparse.ArgumentParser(prog="python -m release.installed_size", description=__doc__)
    parser.add_argument("what", metavar="WHAT")
    with tempfile.TemporaryDirectory() as folder:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--target", folder]
        done = subprocess.run([*pip, parser.parse_args().what], check=False)
        if done.returncode:
            return done.returncode
        sizes = package_sizes(Path(folder))
    for name, size in sorted(sizes.items(), key=lambda item: -item[1]):
        print(f"{size / MEGABYTE:8.1f} MB  {name}")
    print(f"{sum(sizes.values()) / MEGABYTE:8.1f} MB  all")
    return 0


def package_sizes(folder: Path) -> dict[str, int]:
    """Bytes of the files of each package in a folder, and of what belongs to none."""
    sizes: dict[str, int] = {}
    counted: set[Path] = set()
    for package in distributions(path=[str(folder)]):
        files = {Path(str(file.locate())).resolve() for file in package.files or ()}
        here = {file for file in files - counted if file.is_file()}
        sizes[package.metadata["Name"]] = sum(file.stat().st_size for file in here)
        counted |= here
    rest = {file.resolve() for file in folder.rglob("*") if file.is_file()} - counted
    if rest:
        sizes["(of no package)"] = sum(file.stat().st_size for file in rest)
    return sizes


if __name__ == "__main__":
    sys.exit(main())
