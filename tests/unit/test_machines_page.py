"""docs/machines.md names every machine, and what it shows is what the loader reads."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from build_machine import machine_files
from truepose.machine.library import machines

PAGE = (Path(__file__).parents[2] / "docs" / "machines.md").read_text("utf-8")


def test_every_machine_is_in_the_table_with_its_freedoms() -> None:
    rows = dict(
        re.findall(r"^\| \[(\w+)\]\(\.\./machines/\1\.toml\) \|(.*)\|$", PAGE, re.MULTILINE)
    )
    assert sorted(rows) == [path.stem for path in machine_files()]
    for machine in machines():
        _, commanded, parasitic, closures = (cell.strip() for cell in rows[machine.kind].split("|"))
        said = "x y z a b c" if commanded == "all six" else commanded
        assert said.split() == list(machine.commanded)
        assert parasitic.split() == list(machine.parasitic)
        file = tomllib.loads(machine.text)
        assert closures.startswith(str(len(file["strut"])))
        kinds = [guide["kind"] for guide in file.get("guide", [])]
        assert sorted(set(kinds)) == sorted(re.findall(r"`(\w+)`", closures))


def test_what_the_page_shows_is_in_the_files() -> None:
    texts = {machine.kind: tomllib.loads(machine.text) for machine in machines()}
    shown = [tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)]
    guides = [guide for block in shown for guide in block.get("guide", [])]
    assert len(guides) == 3
    for guide in guides:
        kind = "3prs" if guide["kind"] == "plane" else "tricept"
        written = [{"origin": [0, 0, 0], **each} for each in texts[kind]["guide"]]
        assert {"origin": [0, 0, 0], **guide} in written
    for block in shown:
        if "machine" in block:
            assert any(
                block["machine"]["commanded"] == text["machine"].get("commanded")
                for text in texts.values()
            )
