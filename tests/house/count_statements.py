"""How much the source says: statements, lines, docstrings, and names that say nothing.

    python tests/house/count_statements.py [ROOT] [--by-folder]

ROOT is a checkout (default: this one), so that two can be compared. Rust is read with tree-sitter:
`pip install tree-sitter tree-sitter-rust`, best in an environment of its own; without it the Rust
rows are left out, and the exit code is 1.

Counted, comments and blank lines nowhere:

* Python statements: `ast.stmt` nodes, at any depth, but for docstrings. A docstring is any string
  that stands alone as a statement: of a module, class or function, or below an attribute.
* Rust statements: named children of `source_file`, `block` and `declaration_list` (the bodies of
  `impl`, `trait`, `mod`, `extern`), but for comments and attributes. These are the items
  (`function_item`, `function_signature_item`, `struct_item`, `enum_item`, `union_item`,
  `impl_item`, `trait_item`, `mod_item`, `foreign_mod_item`, `use_declaration`,
  `extern_crate_declaration`, `const_item`, `static_item`, `type_item`, `associated_type`,
  `macro_definition`, `macro_invocation`), `let_declaration`, `expression_statement`, and the
  expression that a block ends in. Fields, variants and match arms are none, and what stands in a
  macro's brackets is none: to tree-sitter it is tokens.
* Docstrings: their characters, quotes and comment marks included, and in per cent of all characters
  of the files. In Rust: comments that start with `///`, `//!`, `/**` or `/*!`.
* Names that say nothing: where `each` and `found` are bound in python/truepose, by an assignment,
  a loop, a comprehension, `with`, `except`, `:=` or as an argument. Fields of classes are not
  counted.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from source_tree import EMPTY_NAMES, docstrings, empty_names, modules

ROOT = Path(__file__).parents[2]
BODIES = ("source_file", "block", "declaration_list")
NO_STATEMENTS = ("line_comment", "block_comment", "attribute_item", "inner_attribute_item", "label")
SKIPPED = {"target", "__pycache__", ".venv"}


@dataclass
class Count:
    """What is counted of one file or of many."""

    files: int = 0
    lines: int = 0
    characters: int = 0
    statements: int = 0
    docstrings: int = 0

    def add(self, other: Count) -> None:
        self.files += other.files
        self.lines += other.lines
        self.characters += other.characters
        self.statements += other.statements
        self.docstrings += other.docstrings


def python_count(path: Path) -> Count:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text, str(path))
    alone = list(docstrings(tree))
    length = sum(len(ast.get_source_segment(text, node) or "") for node in alone)
    statements = sum(isinstance(node, ast.stmt) for node in ast.walk(tree)) - len(alone)
    return Count(1, len(text.splitlines()), len(text), statements, length)


def rust_count(path: Path, parser: Any) -> Count:
    text = path.read_text(encoding="utf-8")
    statements = length = 0
    for node in walk(parser.parse(text.encode()).root_node):
        if node.type in BODIES:
            statements += sum(child.type not in NO_STATEMENTS for child in node.named_children)
        elif node.type in ("line_comment", "block_comment"):
            marks = {child.type for child in node.children}
            if marks & {"outer_doc_comment_marker", "inner_doc_comment_marker"}:
                length += len(node.text.decode().rstrip("\n"))
    return Count(1, len(text.splitlines()), len(text), statements, length)


def walk(node: Any) -> Iterator[Any]:
    waiting = [node]
    while waiting:
        node = waiting.pop()
        yield node
        waiting.extend(node.children)


def rust_parser() -> Any | None:
    """tree-sitter's parser of Rust, or None where it is not installed."""
    try:
        import tree_sitter_rust
        from tree_sitter import Language, Parser
    except ImportError:
        return None
    return Parser(Language(tree_sitter_rust.language()))


def files_of(folder: Path, ending: str) -> list[Path]:
    every = folder.rglob(f"*{ending}")
    return sorted(path for path in every if not SKIPPED & set(path.relative_to(folder).parts))


def python_rows(root: Path, by_folder: bool) -> dict[str, Count]:
    rows: dict[str, Count] = {}
    folder = root / "python"
    for path in files_of(folder, ".py"):
        parts = path.relative_to(folder).parts
        own = python_count(path)
        rows.setdefault("python/", Count()).add(own)
        if by_folder:
            name = "/".join(parts[:2]) if len(parts) > 2 else parts[0]
            rows.setdefault(f"  {name}/", Count()).add(own)
    for path in files_of(folder, ".pyi"):
        rows.setdefault("python/ (*.pyi)", Count()).add(python_count(path))
    return rows


def rust_rows(root: Path, by_folder: bool, parser: Any) -> dict[str, Count]:
    rows: dict[str, Count] = {}
    folder = root / "crates"
    for path in files_of(folder, ".rs"):
        crate, part, *rest = path.relative_to(folder).parts
        own = rust_count(path, parser)
        rows.setdefault("crates/", Count()).add(own)
        of_part = "crates/*/src" if part == "src" else "crates/*, tests and examples"
        rows.setdefault(of_part, Count()).add(own)
        if by_folder and part == "src":
            name = f"{crate}/src/{rest[0]}" if len(rest) > 1 else f"{crate}/src"
            rows.setdefault(f"  {name}/", Count()).add(own)
    return rows


def print_table(rows: dict[str, Count]) -> None:
    print(f"{'':32}{'files':>7}{'lines':>9}{'characters':>12}{'statements':>12}{'docstrings':>12}")
    for name, count in rows.items():
        share = 100 * count.docstrings / count.characters if count.characters else 0.0
        print(
            f"{name:32}{count.files:7}{count.lines:9}{count.characters:12}{count.statements:12}"
            f"{count.docstrings:12} = {share:.2f} %"
        )


def main() -> int:
    arguments = argparse.ArgumentParser(description="Count the statements of a checkout.")
    arguments.add_argument("root", nargs="?", type=Path, default=ROOT)
    arguments.add_argument("--by-folder", action="store_true", help="a row for each folder as well")
    asked = arguments.parse_args()
    rows = python_rows(asked.root, asked.by_folder)
    parser = rust_parser()
    if parser is not None:
        rows |= rust_rows(asked.root, asked.by_folder, parser)
    print_table(rows)
    print()
    bound = empty_names(modules(asked.root / "python" / "truepose").values())
    print(", ".join(f"`{name}` is bound {bound[name]} times" for name in EMPTY_NAMES))
    if parser is None:
        print("crates/ not counted: pip install tree-sitter tree-sitter-rust", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
