"""Which files of a Rust crate import which, read with regular expressions.

Enough for this project's Rust: one module a file, no `#[path]`, no `macro_use`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from house.source_tree import ROOT

CRATES = ROOT / "crates"

RustPath = tuple[str, ...]
"""A path in a crate without the leading `crate`: ("kinematics", "forward", "chord")."""

_COMMENTS_AND_TEXT = re.compile(
    r"""//[^\n]*|/\*.*?\*/|b?r(\#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?'(?:\\.[^']*|[^'\\])'""", re.DOTALL
)
_TESTS = re.compile(r"#\[cfg\(test\)\]\s*mod\s+\w+\s*\{")
_USE = re.compile(r"(?P<public>pub(?:\([^)]*\))?\s+)?\buse\s+(?P<tree>[^;]+);")
_MODULE = re.compile(r"\bmod\s+\w+\s*;")
_LIST = re.compile(r"^\w+! \{\n((?: +\w+ => [\w:]+,\n)+)\}", re.MULTILINE)
_PATH = re.compile(r"(?<![\w:$])[a-z_]\w*(?:::\w+)+")


@dataclass(frozen=True)
class RustFile:
    """A file of a crate as a module."""

    path: Path
    module: RustPath
    used: tuple[RustPath, ...]
    """Absolute paths that its own code uses."""
    exported: dict[str, RustPath] = field(hash=False)
    """Names that it passes on by `pub use` -> the path behind each; "*" is not followed."""


def crates() -> list[Path]:
    return sorted(path.parent for path in CRATES.glob("*/Cargo.toml"))


def without_comments(text: str) -> str:
    """Rust without its comments, texts and characters."""
    return _COMMENTS_AND_TEXT.sub(" ", text)


def list_members(crate: Path) -> dict[str, str]:
    """File of what a list such as `drives! { Slider => slider::Slider, }` names -> its list's file.

    Paths below the crate's parent; a member's file stands beside that of the list.
    """
    members = {}
    for path in sorted((crate / "src").rglob("*.rs")):
        for lines in _LIST.findall(without_comments(path.read_text(encoding="utf-8"))):
            for line in lines.splitlines():
                module = line.strip(" ,").split("::")[-2]
                member = path.with_name(f"{module.split()[-1]}.rs").relative_to(crate.parent)
                members[member.as_posix()] = path.relative_to(crate.parent).as_posix()
    return members


def rust_imports(crate: Path) -> dict[str, set[str]]:
    """File -> files of the same crate that it imports, as paths below the crate's parent."""
    source = crate / "src"
    paths = {_module_of(path.relative_to(source)): path for path in sorted(source.rglob("*.rs"))}
    files = {module: _read(path, module, set(paths)) for module, path in paths.items()}
    shown = {module: path.relative_to(crate.parent).as_posix() for module, path in paths.items()}
    graph = {}
    for module, file in files.items():
        targets = {_resolved(path, files) for path in file.used} - {module}
        graph[shown[module]] = {shown[target] for target in targets if target is not None}
    return graph


def _module_of(path: Path) -> RustPath:
    parts = path.with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib", "main") else parts


def _read(path: Path, module: RustPath, modules: set[RustPath]) -> RustFile:
    text = _without_tests(without_comments(path.read_text(encoding="utf-8")))
    used: list[RustPath] = []
    exported: dict[str, RustPath] = {}
    code = _MODULE.sub(" ", _USE.sub(" ", text))
    for use in _USE.finditer(text):
        for name, written in _leaves(use["tree"]):
            target = _absolute(written, module, modules)
            if target is None:
                continue
            if not use["public"]:
                used.append(target)
                continue
            exported[name] = target
            if re.search(rf"\b{re.escape(name)}\b", code):
                used.append(target)
    for match in _PATH.finditer(code):
        target = _absolute(tuple(match[0].split("::")), module, modules)
        if target is not None:
            used.append(target)
    return RustFile(path, module, tuple(used), exported)


def _without_tests(text: str) -> str:
    while match := _TESTS.search(text):
        depth, end = 1, match.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[: match.start()] + text[end:]
    return text


def _leaves(tree: str) -> Iterator[tuple[str, RustPath]]:
    """`a::{b, c::d as e}` -> (b, a::b), (e, a::c::d): the name that is bound, and its path."""
    tree = tree.strip().removesuffix("::self")
    head, brace, rest = tree.partition("{")
    if not brace:
        written, _, other = tree.partition(" as ")
        parts = tuple(part.strip() for part in written.split("::"))
        yield other.strip() or parts[-1], parts
        return
    depth, item = 0, ""
    start = tuple(part.strip() for part in head.split("::") if part.strip())
    for letter in rest[: rest.rindex("}")] + ",":
        if letter == "," and not depth:
            if item.strip():
                for name, path in _leaves(item):
                    yield (start[-1], start) if path == ("self",) else (name, start + path)
            item = ""
            continue
        depth += {"{": 1, "}": -1}.get(letter, 0)
        item += letter


def _absolute(written: RustPath, module: RustPath, modules: set[RustPath]) -> RustPath | None:
    """The path from the crate's root, or None where it leads out of the crate."""
    if written[0] == "crate":
        return written[1:]
    base = module
    rest = written
    if rest[0] == "self":
        return base + rest[1:]
    if rest[0] == "super":
        while rest and rest[0] == "super":
            base, rest = base[:-1], rest[1:]
        return base + rest
    return base + rest if (*base, rest[0]) in modules else None


def _resolved(path: RustPath, files: dict[RustPath, RustFile]) -> RustPath | None:
    """The module whose file defines what the path names, re-exports followed."""
    for _ in range(8):  # re-exports of re-exports
        module = next((path[:n] for n in range(len(path), -1, -1) if path[:n] in files), None)
        if module is None or len(module) == len(path):
            return module
        behind = files[module].exported.get(path[len(module)])
        if behind is None:
            return module
        path = behind + path[len(module) + 1 :]
    return None
