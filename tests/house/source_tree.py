"""The package's source as syntax trees: modules, imports, classes, functions and names bound.

Everything is read from the files as they stand; nothing is imported and no layout is assumed.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "truepose"

COMPILED = frozenset({"truepose._kernel"})
"""Modules that no Python file is."""

EMPTY_NAMES = ("each", "found")
"""Names that say nothing of what they are of."""

Function = ast.FunctionDef | ast.AsyncFunctionDef
Scope = Function | ast.Lambda


@dataclass(frozen=True)
class Import:
    """One name that a module imports: `from target import name`, or `import target` (name None)."""

    target: str
    """Full name of the module behind `from` or `import`; relative ones are made absolute."""
    name: str | None
    line: int
    for_types: bool
    """Under `if TYPE_CHECKING:`, so that it is never run."""
    in_function: bool
    """Run when a function is called, not when the module is imported."""

    def module(self, every: Collection[str]) -> str:
        """The module that is meant: of `from package import name` the name itself, if it is one."""
        whole = f"{self.target}.{self.name}"
        return whole if whole in every or whole in COMPILED else self.target


@dataclass(frozen=True)
class Binding:
    """A name that a statement, a comprehension or a signature binds."""

    name: str
    line: int
    kind: str
    """`assigned` (loops, comprehensions, `with`, `:=` and `except` too), `argument`, `field`."""


@dataclass(frozen=True)
class Module:
    """A file of the package."""

    name: str
    path: Path
    is_package: bool
    text: str = field(repr=False)

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text, str(self.path))

    @property
    def last_name(self) -> str:
        return self.name.rpartition(".")[2]

    def imports(self) -> Iterator[Import]:
        """What it imports, whatever the depth."""
        yield from _imports(self.tree, self, for_types=False, in_function=False)

    def modules_named(self) -> Iterator[str]:
        """Strings `a.b` or `a.b:name` that may name a module, as registries do: all of them.

        But for the argument of `importlib.resources.files`, which names a package for its data.
        """
        data = {
            id(argument)
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Call) and _last_word(node.func) == "files"
            for argument in node.args
        }
        for node in ast.walk(self.tree):
            if id(node) in data:
                continue
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                module, _, name = node.value.partition(":")
                if "." in module and f"{module}.{name}".replace(".", "").isidentifier():
                    yield module

    def classes(self) -> Iterator[ast.ClassDef]:
        """Classes of the module itself, not those inside functions or classes."""
        return (node for node in self.tree.body if isinstance(node, ast.ClassDef))

    def functions(self) -> Iterator[Function]:
        """Functions of the module itself."""
        return (node for node in self.tree.body if isinstance(node, Function))

    def methods(self) -> Iterator[tuple[ast.ClassDef, Function]]:
        for node in ast.walk(self.tree):
            if isinstance(node, ast.ClassDef):
                yield from ((node, method) for method in node.body if isinstance(method, Function))

    def bindings(self) -> Iterator[Binding]:
        """Every place where a name is bound, but for imports, definitions and type parameters."""
        fields = {
            id(target)
            for node in ast.walk(self.tree)
            if isinstance(node, ast.ClassDef)
            for statement in node.body
            for target in _targets(statement)
        }
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield Binding(node.id, node.lineno, "field" if id(node) in fields else "assigned")
            elif isinstance(node, ast.arg):
                yield Binding(node.arg, node.lineno, "argument")
            elif isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar) and node.name:
                yield Binding(node.name, node.lineno, "assigned")


@cache
def modules(package: Path = PACKAGE) -> dict[str, Module]:
    """Every module of the package by its full name, `__init__` by that of its folder."""
    every = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        is_package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if is_package else parts)
        every[name] = Module(name, path, is_package, path.read_text(encoding="utf-8"))
    return every


def empty_names(every: Iterable[Module]) -> Counter[str]:
    """How often each of `EMPTY_NAMES` is bound, but for fields of classes."""
    return Counter(
        binding.name
        for module in every
        for binding in module.bindings()
        if binding.name in EMPTY_NAMES and binding.kind != "field"
    )


def docstrings(tree: ast.AST) -> Iterator[ast.Expr]:
    """Strings that stand alone as a statement: of modules, classes, functions and attributes."""
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            yield node


def _targets(statement: ast.stmt) -> list[ast.expr]:
    if isinstance(statement, ast.AnnAssign):
        return [statement.target]
    return list(statement.targets) if isinstance(statement, ast.Assign) else []


def _imports(
    node: ast.AST, module: Module, *, for_types: bool, in_function: bool
) -> Iterator[Import]:
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield Import(alias.name, None, node.lineno, for_types, in_function)
    elif isinstance(node, ast.ImportFrom):
        target = _absolute(node, module)
        for alias in node.names:
            yield Import(target, alias.name, node.lineno, for_types, in_function)
    inside = in_function or isinstance(node, Scope)
    if isinstance(node, ast.If) and _last_word(node.test) == "TYPE_CHECKING":
        for statement in node.body:
            yield from _imports(statement, module, for_types=True, in_function=inside)
        for statement in node.orelse:
            yield from _imports(statement, module, for_types=for_types, in_function=inside)
        return
    for child in ast.iter_child_nodes(node):
        yield from _imports(child, module, for_types=for_types, in_function=inside)


def _absolute(node: ast.ImportFrom, module: Module) -> str:
    if not node.level:
        return node.module or ""
    parts = module.name.split(".")
    kept = parts[: len(parts) - node.level + module.is_package]
    return ".".join([*kept, node.module] if node.module else kept)


def _last_word(node: ast.expr) -> str:
    """Of `word` or `a.b.word`."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""
