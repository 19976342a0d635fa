"""A file of fewer than 40 lines is a member of a registry, or has a reason to be by itself.

`small_files.csv` has the reasons. Members of registries are known by their package: its `__init__`
names them in a constant, `REGISTRY = (...)`, by an import or by their full name. Left out are
`__init__.py`, `mod.rs` and `lib.rs`, which are tables of contents.
"""

from __future__ import annotations

import ast
import csv
from collections.abc import Iterator, Mapping
from pathlib import Path

from house.source_tree import ROOT, Module, modules

LIST = Path(__file__).with_name("small_files.csv")
SMALL = 40
CONTENTS = {"mod.rs", "lib.rs", "main.rs"}
TO_MERGE = "to be merged into"
"""How the reason of a file begins that has none."""


def reasons() -> dict[str, str]:
    """Path from the root -> why the file is by itself."""
    with LIST.open(encoding="utf-8", newline="") as file:
        return {row["path"]: row["reason"] for row in csv.DictReader(file)}


def members(package: Module, every: Mapping[str, Module]) -> set[str]:
    """Modules that the package's constants name."""
    origin: dict[str, str] = {}
    for statement in package.imports():
        if statement.name:
            origin[statement.name] = statement.module(every)
    named: set[str] = set()
    for node in package.tree.body:
        if _is_constant(node):
            for part in ast.walk(node):
                if isinstance(part, ast.Name) and part.id in origin:
                    named.add(origin[part.id])
                elif isinstance(part, ast.Constant) and isinstance(part.value, str):
                    named.add(part.value.partition(":")[0])
    return {name for name in named if name.startswith(f"{package.name}.")}


def _is_constant(node: ast.stmt) -> bool:
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return any(isinstance(target, ast.Name) and target.id.isupper() for target in targets)


def small_files() -> Iterator[str]:
    """Files that need a reason, as paths from the root."""
    every = modules()
    packages = [module for module in every.values() if module.is_package]
    registered = {name for package in packages for name in members(package, every)}
    for module in every.values():
        if not module.is_package and module.name not in registered and _small(module.path):
            yield module.path.relative_to(ROOT).as_posix()
    crates = ROOT / "crates"
    for path in sorted(crates.rglob("*.rs")):
        inside = path.relative_to(crates).parts
        if path.name not in CONTENTS and "target" not in inside and _small(path):
            yield path.relative_to(ROOT).as_posix()


def _small(path: Path) -> bool:
    return len(path.read_text(encoding="utf-8").splitlines()) < SMALL


def test_every_small_file_has_a_reason() -> None:
    small = set(small_files())
    listed = reasons()
    assert sorted(small - set(listed)) == [], "small files without a reason"
    assert sorted(set(listed) - small) == [], "listed, but gone, grown or registered"
    assert [path for path, reason in listed.items() if not reason.strip()] == []


def test_no_small_file_waits_to_be_merged() -> None:
    waiting = {path: why for path, why in reasons().items() if why.startswith(TO_MERGE)}
    assert waiting == {}


def test_members_of_registries_are_seen(tmp_path: Path) -> None:
    sources = {
        "truepose/kinds/__init__.py": "from truepose.kinds import a, c\n"
        "from truepose.kinds.b import KIND\n"
        "REGISTRY = {k.name: k for k in (a.KIND, KIND)}\n"
        'LAZY: dict[str, str] = {"d": "truepose.kinds.d:Kind"}\n',
        **{f"truepose/kinds/{name}.py": "KIND = 1\n" for name in "abcd"},
    }
    for name, text in sources.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    every = modules(tmp_path / "truepose")
    assert members(every["truepose.kinds"], every) == {f"truepose.kinds.{name}" for name in "abd"}
