"""Every code block of README and docs is run; what it shows of an output is compared.

`document_blocks` says what a block is run as, and how a page prepares or leaves out one.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import jsonschema
import pytest

import truepose as tp
from document_blocks import INLINE, LANGUAGES, ROOT, Block, blocks_of, pages
from truepose.calibration import read_measurements
from truepose.cli import cli, run
from truepose.machine.families import REGISTRY
from truepose.workpiece.read import read_part

pytestmark = pytest.mark.timeout(1200)

CODE_PAGES = [page for page in pages() if any(block.is_code for block in blocks_of(page))]
QUESTIONS = {"check", "calibrate", "compare"}
"""Commands whose exit code 1 is the answer no."""
MEASURED = ROOT / "machines" / "linear_delta.toml"


def short(page: Path) -> str:
    return str(page.relative_to(ROOT).with_suffix(""))


class Workshop:
    """A folder in which the blocks of one page are run, one after the other."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self.capsys = folder, capsys
        for name in ("machines", "examples"):
            shutil.copytree(ROOT / name, folder / name)
        self.runs: dict[str, Callable[[Block], None]] = {
            "sh": self.shell,
            "python": self.python,
            "toml": self.toml,
            "csv": self.csv,
            "text": self.printed,
        }

    def run(self, block: Block) -> None:
        """Prepare and run one block; raises AssertionError with its place."""
        for name, text in block.files.items():
            (self.folder / name).write_text(text, encoding="utf-8")
        for line in block.first:
            self.command(line, block)
        self.runs[block.language](block)

    def command(self, line: str, block: Block) -> str:
        """Run a line of a shell, which begins with `truepose`, and return what it printed."""
        words = shlex.split(line, comments=True)
        if not words:
            return ""
        assert words[0] == "truepose", f"{block.place}: only truepose can be run: {line}"
        self.capsys.readouterr()
        code = run(words[1:])
        printed = self.capsys.readouterr()
        allowed = {0, 1} if words[1] in QUESTIONS else {0}
        assert code in allowed, f"{block.place}: {line}\nexit code {code}\n{printed.err}"
        return printed.out

    def shell(self, block: Block) -> None:
        for line in block.text.replace("\\\n", " ").splitlines():
            self.command(line, block)

    def printed(self, block: Block) -> None:
        """`$ command` and the beginning of what it prints, wherever lines are broken."""
        line, _, shown = block.text.removeprefix("$ ").partition("\n")
        out = " ".join(self.command(line, block).split())
        for part in shown.split("...\n"):
            wanted = " ".join(part.split())
            assert wanted in out, f"{block.place}: not printed: {wanted}\nbut: {out[:2000]}"

    def python(self, block: Block) -> None:
        exec(compile(block.text, block.place, "exec"), {"__name__": "page"})  # noqa: S102

    def toml(self, block: Block) -> None:
        """A whole machine file is loaded; of a part of one every key and value is checked.

        A features file is read with the program of the examples.
        """
        content = tomllib.loads(block.text)
        if "feature" in content:
            features = self.folder / "features.toml"
            features.write_text(block.text, encoding="utf-8")
            delta = tp.load(ROOT / "machines" / "linear_delta.toml")
            read_part(delta, ROOT / "examples" / "part" / "square.ngc", features)
            return
        if {"schema", "drive", "strut"} <= set(content):
            whole = self.folder / "whole.toml"
            whole.write_text(block.text, encoding="utf-8")
            tp.load(whole)
            return
        wrong = [
            error.message for error in jsonschema.Draft202012Validator(PARTS).iter_errors(content)
        ]
        assert not wrong, f"{block.place}: {wrong}"

    def csv(self, block: Block) -> None:
        """Measurements of the linear delta, a temperature log, or a table of an actuator."""
        table = self.folder / "shown.csv"
        table.write_text(block.text, encoding="utf-8")
        lines = [line for line in block.text.splitlines() if not line.startswith("#")]
        if lines[0].startswith("time ("):
            setting = f"condition.temperature_log={table}"
            series = tp.over_time(tp.load(ROOT / "machines" / "planar_two_slider.toml", [setting]))
            assert series.sizes["time"] == len(lines) - 1
        elif lines[0].startswith("target ("):
            text = (ROOT / "machines" / "hexaglide.toml").read_text("utf-8")
            made = self.folder / "with_table.toml"
            made.write_text(
                text.replace('name = "d1"', 'name = "d1"\nactuator = { table = "shown.csv" }', 1),
                encoding="utf-8",
            )
            assert "actuator" in tp.budget(tp.load(made))["source"].values
        else:
            assert read_measurements(table, tp.load(MEASURED)).n_row > 0


def without_required(schema: Any) -> Any:
    """The machine file's schema for a part of a file: nothing has to be there."""
    if isinstance(schema, dict):
        kept = {key: part for key, part in schema.items() if key != "required"}
        return {key: without_required(part) for key, part in kept.items()}
    return [without_required(part) for part in schema] if isinstance(schema, list) else schema


PARTS = without_required(
    json.loads((ROOT / "docs" / "machine_file.schema.json").read_text("utf-8"))
)


@pytest.mark.parametrize("page", CODE_PAGES, ids=short)
def test_the_code_of_a_page_runs(
    page: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    workshop = Workshop(tmp_path, capsys)
    for block in blocks_of(page):
        if block.is_code and block.not_run is None:
            workshop.run(block)


def test_at_most_a_tenth_of_the_blocks_is_left_out() -> None:
    blocks = [block for page in pages() for block in blocks_of(page) if block.is_code]
    left_out = [block for block in blocks if block.not_run is not None]
    print(f"{len(blocks)} blocks, not run: {[(b.place, b.not_run) for b in left_out]}")
    assert len(blocks) > 50
    assert len(left_out) <= 0.1 * len(blocks)
    assert all(len(block.not_run or "") > 10 for block in left_out)


def test_every_block_says_what_it_is() -> None:
    blocks = [block for page in pages() for block in blocks_of(page)]
    assert [b.place for b in blocks if b.language not in LANGUAGES] == []


def test_commands_in_sentences_exist() -> None:
    """`truepose NAME --option` in a sentence names a command and options that it has."""
    context = click.Context(cli)
    seen, wrong = 0, []
    for page in pages():
        for said in INLINE.findall(page.read_text("utf-8")):
            if said == "truepose pose map 1":  # the first line of a file
                continue
            name, *words = said.split()[1:]
            command = cli.get_command(context, name)
            kinds = REGISTRY if name == "init" else ()
            of_families = {f"--{key}".replace("_", "-") for k in kinds for key in k.model_fields}
            known = of_families | {
                word for each in (command.params if command else ()) for word in each.opts
            }
            options = {word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)}
            seen += 1
            if command is None or not options <= known | {"--help"}:
                wrong.append(f"{short(page)}: {said}")
    assert seen > 40
    assert not wrong


def test_make_targets_in_the_documents_exist() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.M))
    for page in pages():
        text = page.read_text("utf-8")
        named = re.findall(r"`make ([a-z-]+)", text)
        named += [
            word
            for block in blocks_of(page)
            if block.language == "sh"
            for word in re.findall(r"^make ([a-z-]+)", block.text, re.M)
        ]
        assert set(named) <= targets, short(page)


def test_a_wrong_block_would_be_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    workshop = Workshop(tmp_path, capsys)
    good = {
        "sh": "truepose check machines/five_bar.toml\n",
        "toml": '[[strut]]\nmaterial = "steel"\n',
        "text": "$ truepose check machines/planar_two_slider.toml\nNOT met  position before\n",
    }
    wrong = {
        "sh": "truepose check machines/none.toml\n",
        "toml": '[[strut]]\nmateriel = "steel"\n',
        "text": "$ truepose check machines/planar_two_slider.toml\nmet  orientation\n",
    }
    page = tmp_path / "page.md"
    for language, text in good.items():
        workshop.run(Block(ROOT / "README.md", 1, language, text))
        with pytest.raises(AssertionError):
            workshop.run(Block(ROOT / "README.md", 1, language, wrong[language]))
    page.write_text("<!-- not run: because -->\n```sh\na\n```\n\n```sh\nb\n```\n", encoding="utf-8")
    assert [block.not_run for block in blocks_of(page)] == ["because", None]
