"""Says what stands against a release of this checkout: `python -m release.check [--tag v1.2.3]`."""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from pathlib import Path

from release import ROOT
from release.names import CITATION, PROJECT, names, project_tables


def main() -> int:
    """0 if nothing does, else 2, a line each."""
    parser = argparse.ArgumentParser(prog="python -m release.check", description=__doc__)
    parser.add_argument("--tag", help="the tag that asks for the release, v and the version")
    found = objections(ROOT, parser.parse_args().tag)
    for objection in found:
        print(f"no release: {objection}", file=sys.stderr)
    return 2 if found else 0


def objections(root: Path, tag: str | None = None) -> list[str]:
    """What stands against a release: placeholders, versions that differ, no changes told."""
    project = _toml(root / PROJECT)["project"]
    known, version = names(root), str(project["version"])
    found = [f"{CITATION}: {place} is a placeholder or missing" for place in known.missing]
    if not known.missing:
        found += [
            f"{PROJECT}: project.{key} is not what {CITATION} says; run: make names"
            for key, value in project_tables(known).items()
            if project.get(key) != value
        ]
    versions = {
        CITATION: known.version,
        "Cargo.toml": _toml(root / "Cargo.toml")["workspace"]["package"]["version"],
        "the tag": tag.removeprefix("v") if tag else version,
    }
    found += [
        f"{where} has version {other}, {PROJECT} {version}"
        for where, other in versions.items()
        if other != version
    ]
    if tag and not tag.startswith("v"):
        found.append(f"the tag {tag} does not begin with v")
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    if not re.search(rf"^## \[{re.escape(version)}\] - \d{{4}}-\d\d-\d\d$", changes, re.MULTILINE):
        found.append(f"CHANGELOG.md has no section `## [{version}] - YYYY-MM-DD`")
    series = version.rpartition(".")[0]
    if not (root / "tests" / "archive" / series).is_dir():
        found.append(f"no tests/archive/{series}; run: python tests/make_archive.py {series}")
    return found


def _toml(path: Path) -> dict:
    return tomllib.loads(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    sys.exit(main())
