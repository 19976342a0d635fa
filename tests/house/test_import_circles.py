"""Files that import each other in a circle: each is explained in a decision, or is opened.

A circle is a set of files of which each leads to each other one. What counts as an import:

* Python: every `import`, those inside functions too, but none under `if TYPE_CHECKING`. A string
  that is a module's full name counts as well, registries and `import_module` import by such, unless
  `files` is called with it, which opens a package's data. What
  is imported is the file that is named: `from package import module` and `import package.module`
  are the module, not the `__init__` above it, although Python runs it on the way; `from package
  import name` is the package's `__init__`, and its re-exports are imports of its own. So an
  `__init__` that re-exports its members makes no circle, until a member takes a name back from it.
* Rust, within a crate: every path that starts with `crate::`, `super::`, `self::` or a module that
  is a child, in `use` and elsewhere, but for test modules. What is imported is the file of the
  module that the path names. A name that a module re-exports is followed to the file that defines
  it, and `pub use` by itself is no import: it is one where the file also uses the name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from house.rust_tree import crates, list_members, rust_imports
from house.source_tree import ROOT, Module, modules

DECISIONS = ROOT / "docs" / "decisions"

PYTHON_CIRCLES: dict[tuple[str, ...], str] = {}
"""Modules of a circle, in order of their names -> the page of docs/decisions that explains it.

"" where none does yet: the circle is to be opened or explained.
"""

RUST_CIRCLES: dict[tuple[str, ...], str] = {
    ("kernel/src/dispatch.rs", "kernel/src/scalar/lanes.rs"): "one-module-with-unsafe-code",
}
"""The same of Rust: paths of files below crates/; what a list of elements names is one node."""

Graph = Mapping[str, set[str]]


def python_graph(every: Mapping[str, Module]) -> Graph:
    """Module -> the modules that it imports."""
    graph: dict[str, set[str]] = {name: set() for name in every}
    for name, module in every.items():
        for statement in module.imports():
            if not statement.for_types:
                graph[name].add(statement.module(every))
        graph[name].update(module.modules_named())
        graph[name] &= every.keys() - {name}
    return graph


def rust_graph() -> Graph:
    """File -> the files that it imports; a list's members are one: a new one is no new circle."""
    graph: dict[str, set[str]] = {}
    for crate in crates():
        node = {file: f"members of {at}" for file, at in list_members(crate).items()}
        for file, targets in rust_imports(crate).items():
            name = node.get(file, file)
            graph.setdefault(name, set()).update(node.get(target, target) for target in targets)
            graph[name].discard(name)
    return graph


def circles(graph: Graph) -> set[tuple[str, ...]]:
    """The strongly connected components of more than one node (Tarjan), each in order."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    path: list[str] = []
    on_path: set[str] = set()
    result: set[tuple[str, ...]] = set()

    def visit(node: str) -> None:
        order[node] = lowest[node] = len(order)
        path.append(node)
        on_path.add(node)
        for target in graph[node]:
            if target not in order:
                visit(target)
                lowest[node] = min(lowest[node], lowest[target])
            elif target in on_path:
                lowest[node] = min(lowest[node], order[target])
        if lowest[node] == order[node]:
            component = path[path.index(node) :]
            del path[-len(component) :]
            on_path.difference_update(component)
            if len(component) > 1:
                result.add(tuple(sorted(component)))

    for node in graph:
        if node not in order:
            visit(node)
    return result


def shown(graph: Graph, circle: tuple[str, ...]) -> str:
    """The circle with its imports, to see which of them to turn round."""
    inside = {node: sorted(graph[node] & set(circle)) for node in circle}
    return "\n".join(f"  {node} -> {', '.join(targets)}" for node, targets in inside.items())


def refuse_unlisted(graph: Graph, listed: Iterable[tuple[str, ...]]) -> None:
    present = circles(graph)
    new = sorted(present - set(listed))
    gone = sorted(set(listed) - present)
    assert not new, "circles that no decision explains:\n" + "\n\n".join(
        shown(graph, circle) for circle in new
    )
    assert not gone, f"listed circles that are open now: take them out of the list: {gone}"


def test_circles_of_python_files_are_listed() -> None:
    refuse_unlisted(python_graph(modules()), PYTHON_CIRCLES)


def test_circles_of_rust_files_are_listed() -> None:
    refuse_unlisted(rust_graph(), RUST_CIRCLES)


@pytest.mark.parametrize("page", sorted({*PYTHON_CIRCLES.values(), *RUST_CIRCLES.values()}))
def test_a_circle_is_explained(page: str) -> None:
    assert (DECISIONS / f"{page}.md").is_file()


def test_a_circle_is_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d"}, "f": {"a"}}
    assert circles(graph) == {("a", "b", "c"), ("d", "e")}
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == set()


def test_python_imports_are_seen(tmp_path: Path) -> None:
    sources = {
        "__init__": "NAMES = {'c': 'truepose.c:Thing'}\n",
        "a": "from truepose import b\nfrom importlib.resources import files\nfiles('truepose.e')\n",
        "b": "def late():\n    from truepose.c import thing\n    from . import d, unknown\n",
        "c": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import truepose.a\n",
        "d": "import truepose.c\nimport numpy\n",
        "e": "",
    }
    written(tmp_path / "truepose", {f"{name}.py": text for name, text in sources.items()})
    graph = python_graph(modules(tmp_path / "truepose"))
    assert graph == {
        "truepose": {"truepose.c"},
        "truepose.a": {"truepose.b"},
        "truepose.b": {"truepose", "truepose.c", "truepose.d"},
        "truepose.c": set(),
        "truepose.d": {"truepose.c"},
        "truepose.e": set(),
    }


def test_rust_imports_are_seen(tmp_path: Path) -> None:
    sources = {
        "lib.rs": "mod a; mod b; pub mod deep; pub use a::Thing; pub use b::other;\n"
        "fn f() { other() }\n",
        "a.rs": "use crate::deep::{self, inner::{Deep, Second as S}, Passed}; // crate::b\n",
        "b.rs": "use super::Thing;\n#[cfg(test)]\nmod tests { use crate::deep; }\n",
        "deep/mod.rs": 'mod inner; mod last; pub use inner::Passed; const TEXT: &str = "crate::b";',
        "deep/inner.rs": "use std::fmt; fn f() -> super::last::Last { self::g() }",
        "deep/last.rs": "use crate::b::other as another;",
    }
    written(tmp_path / "kernel" / "src", sources)
    inside = "kernel/src/"
    graph = {
        name.removeprefix(inside): {target.removeprefix(inside) for target in targets}
        for name, targets in rust_imports(tmp_path / "kernel").items()
    }
    assert graph == {
        "lib.rs": {"b.rs"},
        "a.rs": {"deep/mod.rs", "deep/inner.rs"},
        "b.rs": {"a.rs"},
        "deep/mod.rs": set(),
        "deep/inner.rs": {"deep/last.rs"},
        "deep/last.rs": {"b.rs"},
    }


def test_members_of_a_rust_list_are_seen(tmp_path: Path) -> None:
    sources = {
        "mod.rs": "mod a; mod b;\nlist! {\n    A => a::First,\n    B => super::b::Second,\n}\n"
    }
    written(tmp_path / "kernel" / "src" / "part", sources)
    folder = "kernel/src/part"
    members = {f"{folder}/a.rs": f"{folder}/mod.rs", f"{folder}/b.rs": f"{folder}/mod.rs"}
    assert list_members(tmp_path / "kernel") == members


def written(folder: Path, sources: Mapping[str, str]) -> None:
    for name, text in sources.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
