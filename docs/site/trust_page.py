"""The page of what was checked: published cases, laws, benchmarks and limits."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from test_results import PLACE, Results

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests"
MACHINES = {
    path.stem
    for folder in ("machines", "tests/machines")
    for path in (ROOT / folder).glob("*.toml")
}

HEAD = """# Why trust it

What truepose says of machines is held against numbers that others published, against second
programs that know nothing of it, and against laws that every machine must obey. This page is
written from what the tests found when they last ran, never by hand.
"""
NUMBERS = """A published number is compared entry by entry. The table has the entry that is
farthest off for what is allowed: half of the last digit published, or what the source's
own rounding makes of it.
*Reference* is a number that nobody published: it was computed independently.
"""
LAWS = """A law is written once and runs on every machine file of the library and of the tests, many
also on machines drawn at random. The number of machines is that of the last run.
"""
END = """## Benchmarks

[Benchmark results](../benchmarks/RESULTS.md): what is fast, against what, and what was missed;
[against an earlier commit](../benchmarks/AGAINST.md).

## Known limits

[Limits](limits.md): what is not modelled, and how much of anything is taken. What a proof proves,
and where it gives no number, stands in [How sure](how_sure.md#what-a-bound-proves); why things are
as they are in the [decisions](decisions/README.md).
"""


def page(results: Results) -> str:
    """The text of the page."""
    parts = [HEAD, _state(results)]
    by_file: dict[str, list[dict[str, Any]]] = {}
    for test in results.tests:
        by_file.setdefault(test["test"].partition("::")[0], []).append(test)
    parts.append(f"## Published cases and second programs\n\n{NUMBERS}")
    parts += [_case(path, by_file) for path in sorted((TESTS / "oracles").glob("test_*.py"))]
    parts.append(f"## Laws\n\n{LAWS}")
    parts += [_laws(path, by_file) for path in sorted((TESTS / "laws").glob("test_*.py"))]
    parts.append(END)
    return "\n".join(parts)


def _state(results: Results) -> str:
    """Of which commit the numbers are, or why there are none."""
    if results.refusal:
        return (
            f"```{{warning}}\nNot run for this commit: {results.refusal}. Numbers below are missing"
            f" or not complete. `make test-all` writes `{PLACE}`, from which they come.\n```\n"
        )
    counts = ", ".join(f"{number} {name}" for name, number in results.counts.items())
    return (
        f"Commit `{results.commit[:12]}`, Python {results.python}, {results.system}: {counts}.\n"
        "A test is skipped where what it compares with is not installed.\n"
    )


def _docstring(path: Path) -> tuple[str, str]:
    """First line and the rest of a test module's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or path.stem
    first, _, rest = text.partition("\n\n")
    return " ".join(first.split()).rstrip("."), rest


def _source(path: Path) -> str:
    """What the case's file says of where its numbers come from."""
    name = re.match(r"test_([dpc]\d\d)_", f"{path.stem}_")
    found = sorted((TESTS / "oracles" / "cases").glob(f"{name[1]}_*.json")) if name else []
    for case in found:
        stated = json.loads(case.read_text("utf-8"))
        if "source" in stated:
            return f"Source: {stated['source']}.\n"
    return ""


def _digits(value: float, within: float) -> str:
    """A number to one digit more than what is compared."""
    size = max(abs(value), 1e-300)
    needed = 1 + max(0, round(len(str(int(size / within))) if within < size else 1))
    return f"{value:.{min(needed, 15)}g}"


def _numbers(tests: list[dict[str, Any]]) -> Iterator[str]:
    """Rows of a table: of every quantity compared the entry that is farthest off."""
    worst: dict[tuple[str, str], dict[str, Any]] = {}
    count: dict[tuple[str, str], int] = {}
    for test in tests:
        for number in test.get("published", ()):
            key = number["what"], number["by"]
            count[key] = count.get(key, 0) + number["numbers"]
            share = number["difference"] / number["within"]
            if key not in worst or share > worst[key]["difference"] / worst[key]["within"]:
                worst[key] = number
    for key, number in worst.items():
        unit = f" {number['unit']}" if number["unit"] else ""
        theirs = _digits(number["theirs"], number["within"])
        ours = _digits(number["ours"], number["within"])
        by = "" if number["by"] == "source" else " (reference)"
        yield (
            f"| {number['what']}{by} | {count[key]} | {theirs}{unit} | {ours}{unit} "
            f"| {number['difference']:.1e} | {number['within']:.1e} |"
        )


def _passed(tests: list[dict[str, Any]]) -> str:
    """How many tests passed, were skipped or failed."""
    if not tests:
        return "Not run."
    outcomes = [test["outcome"] for test in tests]
    return ", ".join(f"{outcomes.count(name)} {name}" for name in sorted(set(outcomes))) + "."


def _case(path: Path, by_file: dict[str, list[dict[str, Any]]]) -> str:
    name = str(path.relative_to(ROOT))
    title, more = _docstring(path)
    tests = by_file.get(name, [])
    rows = list(_numbers(tests))
    table = ""
    if rows:
        head = "| quantity | numbers | theirs | ours | apart | allowed |\n|---|---|---|---|---|---|"
        table = "\n".join([head, *rows, ""])
    return (
        f"### {title}\n\n{more}\n\n{_source(path)}\n{table}\n{_passed(tests)} Again:\n\n"
        f"```sh\n.venv/bin/python -m pytest {name}\n```\n"
    )


def _machines(members: list[str]) -> tuple[set[str], set[str]]:
    """Machine files and drawn machines named in the ids of a law's tests."""
    files, drawn = set(), set()
    for member in members:
        words = member.split("-")
        if "drawn" in words:
            drawn.add("-".join(words[words.index("drawn") : words.index("drawn") + 2]))
        files |= MACHINES & set(words) if "drawn" not in words else set()
    return files, drawn


def _laws(path: Path, by_file: dict[str, list[dict[str, Any]]]) -> str:
    name = str(path.relative_to(ROOT))
    title, _ = _docstring(path)
    laws: dict[str, list[str]] = {}
    for test in by_file.get(name, []):
        function, _, member = test["test"].rpartition("::")[2].partition("[")
        laws.setdefault(function, []).append(member.removesuffix("]"))
    rows = []
    for function, members in laws.items():
        files, drawn = _machines(members)
        words = function.removeprefix("test_").replace("_", " ")
        rows.append(f"| {words} | {len(files)} | {len(drawn)} | {len(members)} |")
    head = "| law | machine files | machines drawn | tests |\n|---|---|---|---|"
    table = "\n".join([head, *rows, ""]) if rows else ""
    return f"### {title}\n\n{table}\n{_passed(by_file.get(name, []))} `{name}`\n"
