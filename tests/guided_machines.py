"""Machine files of the library whose guides are of no limb: nothing says what they are made of."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from build_machine import MACHINES

_FOLDER = TemporaryDirectory(prefix="guided_machines")
_SECTIONS = {"3prs": "829 mm^2", "3rps": "5027 mm^2"}
"""Of struts whose limbs say it."""


@cache
def guided(name: str) -> Path:
    """The file of a machine without its limbs, its struts as stiff along themselves as before."""
    text = (MACHINES / f"{name}.toml").read_text(encoding="utf-8")
    text, found = re.subn(r"^\[(each\.|\[)limb\]+.*?(?=^\[)", "", text, flags=re.M | re.S)
    while found:
        text, found = re.subn(r"^\[(each\.|\[)limb\]+.*?(?=^\[)", "", text, flags=re.M | re.S)
    if name in _SECTIONS:
        line = f'section_area = "{_SECTIONS[name]}"\nbase_joint'
        text = text.replace("base_joint", line, 1)
    assert "limb]" not in text
    path = Path(_FOLDER.name) / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def rigidly_guided(path: Path) -> Path:
    """The file itself, or, of the library's machines with limbs, the one without."""
    return guided(path.stem) if "[[limb]]" in path.read_text(encoding="utf-8") else path
