"""Command output and the report's text, word for word.

Refresh with `pytest tests/golden --update-golden` and read the difference. Tables hold rounded
numbers and are compared as text; JSON and CSV hold every digit, whose last ones depend on the
processor's instructions, so their numbers are compared to 1e-9 of the largest in the file's units.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from command_line import MACHINES, call
from truepose.reporting.live import part

Golden = Callable[[str, str], str]
NUMBER = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?")
VERSION = re.compile(r"(truepose |truepose_version\": \")\d+\.\d+\.\d+")
HASH = re.compile(r"[0-9a-f]{64}")
# Left out: a small machine says it all, and the file stays short.
SMALL = {
    "planar_two_slider": ["--set", "workspace.grid.x=[0, 400, 3]"],
    "rotary_delta": [
        f"--set=workspace.grid.{axis}=[{ends}]"
        for axis, ends in (("x", "-40, 40, 2"), ("y", "0, 0, 1"), ("z", "0, 60, 2"))
    ],
}


def stable(text: str) -> str:
    """Text without what changes from release to release or with a comment in the machine file."""
    return HASH.sub("<hash>", VERSION.sub(r"\g<1><version>", text))


def same(found: str, expected: str) -> None:
    """Words equal, numbers with a decimal point within 1e-9 of the largest."""
    assert NUMBER.sub("<n>", found) == NUMBER.sub("<n>", expected)
    numbers, wanted = (np.array([*map(float, NUMBER.findall(t))]) for t in (found, expected))
    np.testing.assert_allclose(numbers, wanted, rtol=1e-9, atol=1e-9)


# What would be longer than all others together is left out, such as all quantiles as JSON.
COMMANDS = {
    "check": ("table", "json", "csv"),
    "budget": ("table", "json", "csv"),
    "compensate": ("table", "json", "csv"),
    "montecarlo": ("table", "csv"),
    "bounds": ("table", "csv"),
    "shares": ("table",),
}
QUICK = {"montecarlo": ["--samples", "20000"], "shares": ["--samples", "128"]}


@pytest.mark.parametrize("machine", SMALL)
@pytest.mark.parametrize(
    ("command", "form"), [(command, form) for command in COMMANDS for form in COMMANDS[command]]
)
def test_output(
    command: str, form: str, machine: str, capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    file = MACHINES / f"{machine}.toml"
    asked = [*SMALL[machine], *QUICK.get(command, [])]
    found = stable(call(capsys, command, file, *asked, "--format", form).out)
    ending = "txt" if form == "table" else form
    expected = golden(f"{command}_{machine}.{ending}", found)
    if form == "table":
        assert found == expected
    else:
        same(found, expected)


class PageText(HTMLParser):
    """The words of a page, one line for each block; not its scripts and styles."""

    inline = frozenset({"span", "code", "a", "b"})

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = [""]
        self.silent = 0

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.silent += tag in ("script", "style")
        if tag in ("td", "th"):
            self.lines[-1] += " | "
        elif tag not in self.inline:
            self.lines.append("")

    def handle_endtag(self, tag: str) -> None:
        self.silent -= tag in ("script", "style")

    def handle_data(self, data: str) -> None:
        if not self.silent:
            self.lines[-1] += " ".join(data.split()) + (" " if data.endswith((" ", "\n")) else "")


@pytest.mark.parametrize("machine", SMALL)
def test_report(
    machine: str,
    capsys: pytest.CaptureFixture[str],
    golden: Golden,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Whether the kernel for browsers is built or not, the words are those of a static report.
    monkeypatch.setattr(part, "kernel_file", lambda: Path("not-built"))
    page = tmp_path / "page.html"
    code = call(capsys, "report", MACHINES / f"{machine}.toml", *SMALL[machine], "-o", page).code
    assert code == 0
    reader = PageText()
    reader.feed(page.read_text(encoding="utf-8"))
    text = "\n".join(line.strip() for line in reader.lines if line.strip()) + "\n"
    text = stable(text)
    # The machine file stands in the page as it is; the copy in machines/ is the one to read.
    head, _, tail = text.partition("schema = 1")
    found = head + "<machine file>\n" + tail[tail.index("What this report does not say") :]
    assert found == golden(f"report_{machine}.txt", found)
