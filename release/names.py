"""The names of the project: repository, contact and authors stand in CITATION.cff, and there alone.

`python -m release.names` writes them into pyproject.toml, once none is a placeholder any more;
until then the package has no authors and no addresses.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit
import yaml

from release import ROOT

CITATION = "CITATION.cff"
PROJECT = "pyproject.toml"
PLACEHOLDER = "placeholder"
"""What a value has in it, in whatever case, that stands for a name to come."""
KEYS = ("authors", "contact", "repository-code")
"""What has to be there."""


@dataclass(frozen=True)
class Names:
    """The names, and what of them is missing."""

    authors: tuple[str, ...]
    """Given and family names."""
    email: str
    """Of the contact."""
    repository: str
    """Its address, without a slash at the end."""
    version: str
    """That the file says is cited."""
    missing: tuple[str, ...]
    """Keys that are not there or have a placeholder, such as `authors[0].family-names`."""


def names(root: Path = ROOT) -> Names:
    """Read CITATION.cff of a checkout."""
    citation = yaml.safe_load((root / CITATION).read_text(encoding="utf-8"))
    absent = [key for key in KEYS if not citation.get(key)]
    people = citation.get("authors") or []
    contacts = citation.get("contact") or [{}]
    return Names(
        tuple(
            f"{one.get('given-names', '')} {one.get('family-names', '')}".strip() for one in people
        ),
        str(contacts[0].get("email", "")),
        str(citation.get("repository-code", "")).rstrip("/"),
        str(citation["version"]),
        (*absent, *_placeholders(citation, "")),
    )


def project_tables(known: Names) -> dict[str, Any]:
    """What `[project]` of pyproject.toml has of them."""
    return {
        "authors": [{"name": author} for author in known.authors],
        "maintainers": [{"name": "truepose", "email": known.email}],
        "urls": {
            "Repository": known.repository,
            "Issues": f"{known.repository}/issues",
            "Changelog": f"{known.repository}/blob/main/CHANGELOG.md",
        },
    }


def write(root: Path = ROOT) -> None:
    """Write them into pyproject.toml of a checkout.

    Raises `ValueError` while a placeholder stands.
    """
    known = names(root)
    if known.missing:
        raise ValueError(f"{CITATION} has no {', '.join(known.missing)} yet")
    path = root / PROJECT
    document = tomlkit.parse(path.read_text(encoding="utf-8"))
    project: Any = document["project"]
    for key, value in project_tables(known).items():
        project[key] = value
    path.write_text(tomlkit.dumps(document), encoding="utf-8")


def _placeholders(value: object, place: str) -> Iterator[str]:
    if isinstance(value, dict):
        for key, content in value.items():
            yield from _placeholders(content, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list):
        for index, content in enumerate(value):
            yield from _placeholders(content, f"{place}[{index}]")
    elif PLACEHOLDER in str(value).lower():
        yield place


def main() -> int:
    """0, or 2 with what is missing."""
    try:
        write()
    except ValueError as error:
        print(f"release.names: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
