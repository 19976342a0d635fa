"""A commit of this repository, its sources and its kernel built beside this one under build/."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "build" / "against"
LIBRARIES = {"linux": "lib_kernel.so", "darwin": "lib_kernel.dylib", "win32": "_kernel.dll"}
MODULE = "_kernel.pyd" if sys.platform == "win32" else "_kernel.abi3.so"


@dataclass(frozen=True)
class Tree:
    """Sources with a kernel built from them."""

    path: Path
    commit: str
    """Abbreviated, with a + where the files are not as committed."""

    @property
    def machines(self) -> Path:
        """Where its machine files are."""
        return self.path / "machines"

    @property
    def version(self) -> str:
        """Version of the package."""
        return str(self._project()["version"])

    @property
    def entry(self) -> str:
        """Module and function that the command `truepose` calls."""
        return str(self._project()["scripts"]["truepose"])

    def environment(self) -> dict[str, str]:
        """The environment of a Python that imports truepose from here, on one thread."""
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        # The package of the virtual environment comes after it; its launcher knows only that one.
        places = {"PYTHONPATH": str(self.path / "python"), "TRUEPOSE_ENTRY": self.entry}
        threads = dict.fromkeys(
            ("TRUEPOSE_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"
        )
        return environment | threads | places

    def _project(self) -> dict:
        return tomllib.loads((self.path / "pyproject.toml").read_text("utf-8"))["project"]


def this_tree() -> Tree:
    """The sources as they lie here, with the kernel that `make package` built."""
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", "python", "crates")
    return Tree(
        ROOT, _git("rev-parse", "--short", "HEAD").decode().strip() + ("+" if changed else "")
    )


def built_commit(name: str) -> Tree:
    """The sources of a commit, unpacked and built where that was not done before, one job.

    Raises `subprocess.CalledProcessError` where there is no such commit or it cannot be built.
    """
    commit = _git("rev-parse", "--short", "--verify", f"{name}^{{commit}}").decode().strip()
    tree = Tree(FOLDER / commit, commit)
    module = tree.path / "python" / "truepose" / MODULE
    if not module.exists():
        with tarfile.open(fileobj=io.BytesIO(_git("archive", commit))) as archive:
            archive.extractall(tree.path, filter="data")
        # Commits share the folder, so that what they depend on is compiled once.
        target = FOLDER / "target"
        command = ("build", "--release", "--locked", "--lib", "--package", "truepose-python")
        environment = os.environ | {"CARGO_TARGET_DIR": str(target)}
        environment.setdefault("PYO3_PYTHON", sys.executable)
        cargo = ["cargo", *command, "--jobs", "1"]  # the machine stays usable meanwhile
        subprocess.run(cargo, cwd=tree.path, env=environment, check=True)
        shutil.copyfile(target / "release" / LIBRARIES[sys.platform], module)
    return tree


def _git(*arguments: str) -> bytes:
    command = ["git", *arguments]
    return subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
