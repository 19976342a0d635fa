"""A machine file with the joint centres that follow from its `[family]` written out."""

from __future__ import annotations

from pathlib import Path

from truepose.calibration.result.toml_edits import MachineText
from truepose.errors import Problem, RequestError
from truepose.files.document import ARRAY_TABLES
from truepose.machine import Machine
from truepose.sources.tolerance import bands_of


def expanded(machine: Machine, original: str | Path) -> str:
    """The text of the file that `machine` was read from, its settings and joint centres in it.

    `[family]` stays, which tolerances may speak of, unless a setting moved a joint centre away from
    it. Raises `RequestError` (no-family where the file has none, machine-file-changed,
    excluding-keys where a tolerance is of the family that a setting contradicts).
    """
    if machine.family is None:
        raise RequestError(
            Problem(
                "no-family",
                "there are no joint centres to write out: the file has no [family]",
                machine.file,
                found="joint centres, or what is none of a family",
                expected="a [family]",
            )
        )
    changed = RequestError(
        Problem(
            "machine-file-changed",
            "the machine file is not the one that was read",
            str(original),
            found="another content than when it was read",
            expected=f"the file with the SHA-256 {machine.file_hash[:12]}...",
        )
    )
    text = MachineText(Path(original), machine, changed)
    of_rows = [key for key in machine.settings if key.split(".")[0] in ARRAY_TABLES]
    if not of_rows:
        text.write_rows()
        return text.text()
    bands = bands_of(machine)
    if bands is not None and bands.group_quantities:
        raise RequestError(
            Problem(
                "excluding-keys",
                "a joint centre that is set by itself, and a tolerance of the family",
                machine.file,
                path=of_rows[0],
                found=f"--set {of_rows[0]}={machine.settings[of_rows[0]]}",
                expected="no such setting, or tolerances of joint centres alone",
            )
        )
    text.write_rows_for_family()
    return text.text()
