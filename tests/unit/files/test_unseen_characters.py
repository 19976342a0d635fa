"""Names that write other text than is read are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import truepose
from truepose.errors import MachineFileError

PLANAR = Path(__file__).parents[3] / "machines" / "planar_two_slider.toml"


@pytest.mark.parametrize("code", [0x00, 0x1B, 0x7F, 0x9B, 0x200B, 0x202E, 0x2028, 0x2066, 0xFEFF])
def test_name_with_what_is_not_seen(tmp_path: Path, code: int) -> None:
    text = PLANAR.read_text(encoding="utf-8")
    before = f'name = "{truepose.load(PLANAR).name}"'
    assert before in text
    file = tmp_path / "machine.toml"
    file.write_text(text.replace(before, f'name = "a\\u{code:04X}b"', 1), encoding="utf-8")
    with pytest.raises(MachineFileError) as raised:
        truepose.load(file)
    (problem,) = raised.value.problems
    assert problem.code == "bad-name"
    assert problem.found is not None
    assert f"U+{code:04X}" in problem.found
    assert problem.found.isprintable()


def test_name_in_another_script_is_good(tmp_path: Path) -> None:
    text = PLANAR.read_text(encoding="utf-8")
    before = f'name = "{truepose.load(PLANAR).name}"'
    file = tmp_path / "machine.toml"
    file.write_text(text.replace(before, 'name = "Fräse 并联 מכונה"', 1), encoding="utf-8")
    assert truepose.load(file).name == "Fräse 并联 מכונה"
