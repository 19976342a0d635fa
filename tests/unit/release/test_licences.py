"""What the kernel is linked with has licences that deny.toml allows; `cargo deny` says the same."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tomllib

import pytest

from release import ROOT
from system_package import missing

ALLOWED = set(tomllib.loads((ROOT / "deny.toml").read_text("utf-8"))["licenses"]["allow"])


def is_allowed(expression: str) -> bool:
    """Of an SPDX expression, where `/` is the old way to write OR."""
    terms = expression.replace("/", " OR ").strip()
    if inside := re.search(r"\(([^()]*)\)", terms):
        known = "Apache-2.0" if is_allowed(inside[1]) else "none"
        return is_allowed(terms.replace(inside[0], known))
    if " OR " in terms and " AND " in terms:
        return any(is_allowed(term) for term in terms.split(" OR "))
    if " AND " in terms:
        return all(is_allowed(term) for term in terms.split(" AND "))
    return any(term.strip() in ALLOWED for term in terms.split(" OR "))


@pytest.mark.parametrize(
    ("expression", "allowed"),
    [
        ("MIT", True),
        ("MIT/Apache-2.0", True),
        ("Unlicense OR MIT", True),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", True),
        ("GPL-3.0-only", False),
        ("MIT AND GPL-3.0-only", False),
        ("(MIT OR Apache-2.0) AND GPL-3.0-only", False),
        ("(GPL-3.0-only OR LGPL-3.0-only) AND MIT", False),
    ],
)
def test_expressions(expression: str, allowed: bool) -> None:
    assert is_allowed(expression) == allowed


def test_every_crate_has_a_licence_that_is_allowed() -> None:
    cargo = shutil.which("cargo")
    if not cargo:
        missing("no cargo")
    command = [cargo, "metadata", "--format-version", "1", "--locked", "--offline"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    crates = {crate["name"]: crate["license"] for crate in json.loads(run.stdout)["packages"]}
    assert len(crates) > 10
    assert {name: said for name, said in crates.items() if not is_allowed(said or "none")} == {}
