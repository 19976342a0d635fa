"""Run before a page: a folder of its own, with the checkout's machines/, examples/ and tests/.

`drawing_of(KIND)` shows a machine of the library.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from IPython import get_ipython
from IPython.display import HTML

DOCS = Path(os.environ["TRUEPOSE_SITE_DOCS"])
sys.path.insert(0, str(DOCS))
os.chdir(tempfile.mkdtemp(prefix="truepose-page-"))
for name in ("machines", "examples", "tests"):
    Path(name).symlink_to(DOCS.parent / name, target_is_directory=True)


def run_shell(line: str) -> None:
    """What a line with `!` does here: print what the commands print, and stop where one is refused.

    Names in braces are those of the page, as in a notebook. 1 is the answer no, and 141 what a
    command says whose reader (`head`) has seen enough.
    """
    line = get_ipython().var_expand(line)
    command = ["bash", "-o", "pipefail", "-c", line]
    run = subprocess.run(  # noqa: S603 a line of our pages
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    print(run.stdout, end="")
    if run.returncode not in {0, 1, 141}:
        raise RuntimeError(f"exit code {run.returncode}: {line}")


get_ipython().system = run_shell


def drawing_of(kind: str) -> HTML:
    """The machine at the middle of its workspace, as in the gallery."""
    from drawing import machine_drawing

    import truepose

    machine = truepose.load(f"machines/{kind}.toml")
    return HTML(f'<div class="machine">{machine_drawing(machine)}</div>')
