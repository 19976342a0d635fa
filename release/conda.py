"""Writes dist/recipe.yaml, a recipe for conda-forge: `python -m release.conda`.

Made of pyproject.toml, CITATION.cff and the sdist in dist/, whose hash it has; it is proposed to
conda-forge once, whose robot then follows the releases. No conda channel was in reach when this was
written: the recipe was never built.
"""

from __future__ import annotations

import hashlib
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import yaml

from release import DIST, ROOT
from release.names import PROJECT, names

SCHEMA = "# yaml-language-server: $schema=https://raw.githubusercontent.com/prefix-dev/recipe-format/main/schema.json\n"
SDIST = "/releases/download/v${{ version }}/truepose-${{ version }}.tar.gz"
CRATES = "cargo-bundle-licenses --format yaml --output THIRDPARTY.yml"
"""Conda-forge asks for the licences of all that is linked in."""


def main() -> int:
    """0, or 2 where something is missing."""
    try:
        text = recipe_text()
    except (ValueError, OSError) as error:
        print(f"release.conda: {error}", file=sys.stderr)
        return 2
    path = DIST / "recipe.yaml"
    path.write_text(text, encoding="utf-8")
    print(path.relative_to(ROOT))
    return 0


def recipe_text(root: Path = ROOT, dist: Path = DIST) -> str:
    """The recipe.

    Raises `ValueError` while a name is a placeholder, `OSError` where there is no sdist.
    """
    project = tomllib.loads((root / PROJECT).read_text(encoding="utf-8"))
    known = names(root)
    if known.missing:
        raise ValueError(f"CITATION.cff has no {', '.join(known.missing)} yet")
    sdist = dist / f"truepose-{project['project']['version']}.tar.gz"
    content = recipe(project, known.repository, hashlib.sha256(sdist.read_bytes()).hexdigest())
    return SCHEMA + yaml.safe_dump(content, sort_keys=False, width=100)


def recipe(pyproject: dict[str, Any], repository: str, sha256: str) -> dict[str, Any]:
    """The recipe as data, from the tables of pyproject.toml."""
    project = pyproject["project"]
    version = project["version"]
    python = f"python {project['requires-python']}"
    (maturin,) = pyproject["build-system"]["requires"]
    return {
        "schema_version": 1,
        "context": {"version": version},
        "package": {"name": "truepose", "version": "${{ version }}"},
        "source": {"url": repository + SDIST, "sha256": sha256},
        "build": {
            "number": 0,
            "script": [
                CRATES,
                "${{ PYTHON }} -m pip install . -vv --no-deps --no-build-isolation",
            ],
            "python": {"entry_points": [f"truepose = {project['scripts']['truepose']}"]},
        },
        "requirements": {
            "build": [
                "${{ stdlib('c') }}",
                "${{ compiler('c') }}",
                "${{ compiler('rust') }}",
                "cargo-bundle-licenses",
            ],
            "host": ["python", "pip", spaced(maturin)],
            "run": [python, *(spaced(one) for one in project["dependencies"])],
        },
        "tests": [
            {"python": {"imports": ["truepose", "truepose._kernel"], "pip_check": True}},
            {
                "script": [
                    "truepose init linear_delta --output machine.toml",
                    "truepose budget machine.toml",
                ]
            },
        ],
        "about": {
            "homepage": repository,
            "summary": project["description"],
            "license": project["license"],
            "license_file": [*project["license-files"], "THIRDPARTY.yml"],
        },
        "extra": {"recipe-maintainers": [repository.split("/")[-2]]},
    }


def spaced(requirement: str) -> str:
    """A requirement as conda writes it: the name, a space, the versions."""
    name, versions = re.fullmatch(r"([\w-]+)(.*)", requirement).groups()  # type: ignore[union-attr]
    return f"{name} {versions}".strip()


if __name__ == "__main__":
    sys.exit(main())
