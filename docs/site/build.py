"""Build the site into build/site: `python docs/site/build.py [--release] [--output FOLDER]`.

The pages of docs/ and the documents beside README are laid out in a folder of their own with the
same places relative to each other, so that their links hold here and in the checkout. Pages that
are computed (machines, trust, Python's interface) are written between them, and Sphinx makes the
site: notebooks are run, every warning is an error, nothing is asked from anywhere.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent
ROOT = DOCS.parent
sys.path[:0] = [str(HERE), str(DOCS)]

import interface_page  # noqa: E402 they stand beside this file
import live_pages  # noqa: E402
import machine_pages  # noqa: E402
import trust_page  # noqa: E402
from test_results import Results, read_results  # noqa: E402

import truepose  # noqa: E402
from truepose.machine.library import machines  # noqa: E402

BESIDE = (
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "SECURITY.md",
    "CODE_OF_CONDUCT.md",
    "CITATION.cff",
    "LICENSE",
)
FOLDERS = ("machines", "examples", "python", "crates", "tests")
"""Linked to by pages: what a link leads to is copied into the site."""
INDEXED = ("tutorials", "decisions", "controllers", "sources")
"""Folders whose README is the index of all other pages in them."""


def lay_out(source: Path, results: Results) -> None:
    """Write all pages of the site below `source`."""
    shutil.rmtree(source, ignore_errors=True)
    unwanted = shutil.ignore_patterns("site", "*.py", "__pycache__")
    shutil.copytree(DOCS, source / "docs", ignore=unwanted)
    for folder in ("benchmarks", "release"):
        (source / folder).mkdir()
        for page in sorted((ROOT / folder).glob("*.md")):
            shutil.copy(page, source / folder)
    for name in BESIDE:
        shutil.copy(ROOT / name, source)
    shutil.copy(HERE / "index.md", source)
    for name in FOLDERS:
        (source / name).symlink_to(ROOT / name, target_is_directory=True)
    for folder in INDEXED:
        others = sorted(p.stem for p in (DOCS / folder).glob("*.md") if p.stem != "README")
        index = source / "docs" / folder / "README.md"
        listed = "\n".join(others)
        index.write_text(
            f"{index.read_text('utf-8')}\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n", "utf-8"
        )
    machine_pages.write(source / "docs" / "gallery")
    (source / "docs" / "interface.md").write_text(interface_page.page(), "utf-8")
    (source / "docs" / "trust.md").write_text(trust_page.page(results), "utf-8")


def make(source: Path, output: Path) -> int:
    """Run Sphinx, with all warnings as errors -> its exit code."""
    programs, kernel = Path(sys.executable).parent, source.with_name("kernel")
    shutil.copytree(HERE / "kernel", kernel, dirs_exist_ok=True)
    workshops = source.with_name("workshops")
    shutil.rmtree(workshops, ignore_errors=True)
    workshops.mkdir()
    environment = os.environ | {
        "TRUEPOSE_SITE_VERSION": truepose.__version__,
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "NO_COLOR": "1",
        "COLUMNS": "92",  # what `truepose` prints is as wide as a page
        "TMPDIR": str(workshops),  # where pages are run
        "TRUEPOSE_SITE_DOCS": str(DOCS),
        "IPYTHONDIR": str(kernel),  # a copy: IPython writes into it
    }
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going"]
    # Afresh: a page whose text is the same may print other numbers.
    command += ["--jobs", "auto", "--fresh-env"]
    command += ["-c", str(HERE), "-d", str(source.parent / "doctrees"), str(source), str(output)]
    code = subprocess.run(command, env=environment, check=False).returncode  # noqa: S603 ours
    if code == 0:
        import plotly

        script = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
        shutil.copy(script, output / "_static")
        if live_pages.can_be_written():
            kinds = [entry.kind for entry in machines()]
            live_pages.write(output / "docs" / "gallery" / "live", kinds)
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the site -> 0, or 1 with what is wrong on stderr."""
    parser = argparse.ArgumentParser(description="Build the site.")
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "site")
    parser.add_argument(
        "--release", action="store_true", help="refuse test results that are not this commit's"
    )
    asked = parser.parse_args(arguments)
    results = read_results(ROOT)
    if asked.release and results.refusal:
        print(f"no site to publish: {results.refusal}", file=sys.stderr)
        return 1
    if not live_pages.can_be_written():
        print("No live pages: the kernel for browsers was not built (make web).", file=sys.stderr)
        if asked.release:
            return 1
    output = asked.output.resolve()
    source = output.with_name(f"{output.name}-source") / "pages"
    lay_out(source, results)
    shutil.rmtree(output, ignore_errors=True)
    code = make(source, output)
    if code == 0:
        print(f"The site is {output / 'index.html'}: open it in a browser.")
    return code


if __name__ == "__main__":
    sys.exit(main())
