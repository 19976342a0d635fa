"""Write docs/picture.svg, the picture of the README: a machine and the errors of its tool.

Run `python docs/generate_picture.py` after a change that moves them; a test refuses an old picture.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from drawing import machine_and_errors  # noqa: E402 it stands beside this file

import truepose as tp  # noqa: E402


def picture() -> str:
    """The text of docs/picture.svg."""
    return machine_and_errors(tp.load(HERE.parent / "machines" / "planar_two_slider.toml"))


if __name__ == "__main__":
    (HERE / "picture.svg").write_text(picture(), encoding="utf-8")
    print("docs/picture.svg")
