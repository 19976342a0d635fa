"""The live part of a page put together: the kernel for browsers, a machine as data, and scripts."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.language import say, spoken
from truepose.reporting.figures._json import as_json
from truepose.reporting.figures._outline import is_planar, outline
from truepose.reporting.figures._style import COLOUR_SCALE
from truepose.reporting.live.labels import labels, sources_said

if TYPE_CHECKING:
    from truepose.machine import Machine

KERNEL = "_kernel.wasm.gz"
"""The kernel for browsers, a file of the package that `make web` builds."""

SHARED = ("kernel.js",)
WORKER = (*SHARED, "worker.js")
PAGE = (
    *SHARED,
    "numbers.js", "controls.js", "canvas.js", "machine.js", "map.js", "distribution.js",
    "verdict.js", "cards.js", "ranking.js", "live.js", "start.js",
)  # fmt: skip

FRAMED = ("framed.js",)


@dataclass(frozen=True)
class LivePart:
    """What stands in a page: the kernel in base85, a setting as JSON, and scripts.

    `script`: what the page runs, `worker`: what its worker does; `style`: what it looks like.
    `beside`: the address of a script that brings the kernel, which several pages share; the page
    then has none of its own.
    """

    kernel: str
    beside: str | None
    setting: str
    worker: str
    planar: bool
    script: str
    style: str


def kernel_file() -> Traversable:
    """Where the kernel for browsers is, if it was built."""
    return files("truepose").joinpath(KERNEL)


def is_built() -> bool:
    """Whether there is a kernel for browsers."""
    return kernel_file().is_file()


def packed_kernel(file: Traversable | None = None) -> str:
    """The kernel for browsers in base85. Raises `RequestError` (no-live-kernel) without one."""
    there = kernel_file() if file is None else file
    try:
        # A sixteenth shorter than base64; "<" could begin a comment in a page, and is a full stop.
        return base64.b85encode(there.read_bytes()).decode("ascii").replace("<", ".")
    except OSError as failure:
        raise RequestError(
            Problem(
                "no-live-kernel",
                "the kernel for browsers was not built",
                found=f"no {there.name}",
                expected="a file of the package, as every wheel has it",
                hint="make web",
            )
        ) from failure


def shared_kernel() -> str:
    """The script that brings the kernel to pages it stands beside.

    A script, for a page that is opened from disk may fetch nothing. Raises `RequestError`
    (no-live-kernel).
    """
    return f'document.getElementById("live-kernel").textContent = "{packed_kernel()}";\n'


def live_of(machine: Machine, beside: str | None = None, *, in_frame: bool = False) -> LivePart:
    """The live part of a machine in its file's condition; the kernel in it, or in `beside`.

    `in_frame`: of a page in a frame, which says how high it is.

    Raises `RequestError` (no-live-kernel), and as `truepose.live.bundle` does.
    """
    from truepose.live import bundle

    return live_part(machine, bundle(machine), beside, in_frame=in_frame)


def live_or_why_not(machine: Machine) -> LivePart | str:
    """The same, or where there is none, a sentence that says why."""
    if not is_built():
        return say(
            "This page has no live part: the kernel for browsers, {file}, was not built "
            "(`make web`).",
            file=KERNEL,
        )
    try:
        return live_of(machine)
    except RequestError as failure:
        (problem, *_) = failure.problems
        return say("This page has no live part: {reason}.", reason=problem.message)


def live_part(
    machine: Machine,
    bundle: Mapping[str, Any],
    beside: str | None = None,
    *,
    in_frame: bool = False,
) -> LivePart:
    """The live part of a machine, whose data for the kernel is `bundle`; as `live_of`.

    Raises `RequestError` (no-live-kernel).
    """
    kernel = packed_kernel() if beside is None else ""
    setting = machine_in_page(machine, bundle)
    if in_frame:
        return assembled(kernel, setting, _together(FRAMED), "startFramed", beside=beside)
    return assembled(kernel, setting, beside=beside)


def machine_in_page(machine: Machine, bundle: Mapping[str, Any]) -> dict[str, Any]:
    """What of a page's setting follows from the machine."""
    return {
        "bundle": bundle,
        "drawing": drawing(machine, bundle["workspace"]["home"]),
        "planar": is_planar(machine),
        "sources": sources_said(bundle["sources"]),
    }


def assembled(
    kernel: str,
    setting: Mapping[str, Any],
    more: str = "",
    start: str = "startLive",
    css: str = "",
    beside: str | None = None,
) -> LivePart:
    """A live part with a setting, which has words, marks and colours besides.

    `more`: a script behind the live one, and `css` behind its style; `start` is called at the end.
    `beside`: as a `LivePart` has it.
    """
    language = spoken()
    colours = [str(colour) for _, colour in COLOUR_SCALE]
    whole = {
        **setting,
        "words": labels(),
        "marks": {"decimal": language.decimal_mark, "group": language.group_mark},
        "scale": [[int(colour[at : at + 2], 16) for at in (1, 3, 5)] for colour in colours],
    }
    return LivePart(
        kernel,
        beside,
        as_json(whole),
        _together(WORKER),
        bool(setting.get("planar", False)),
        script(more, start),
        _together(["live.css"]) + css,
    )


def script(more: str = "", start: str = "startLive") -> str:
    """What the page runs. It says by `liveStarted`, a promise, when it is through."""
    whole = "\n".join(part for part in (_together(PAGE), more) if part)
    return f"const liveStarted = (() => {{\n{whole}\nreturn {start}();\n}})();\n"


def drawing(machine: Machine, home: Sequence[float]) -> dict[str, Any]:
    """What of the picture the kernel does not say: paths of drives, frame, what hangs together.

    `arms`: numbers of the struts that a drive carries, and the pivot that an arm turns about.
    `platform`: numbers of struts in the order of its outline. `points`: how far it all reaches.
    """
    shape = outline(machine, np.asarray(home))
    drawn = {drive.name: drive.drawing for drive in machine.drives if drive.drawing != "none"}
    arms = []
    pivots = iter([arm for arm in shape.arms if len(arm) == 2])
    for name, drawing in drawn.items():
        struts = [at for at, strut in enumerate(machine.struts) if strut.drive == name]
        if not struts:
            continue
        pivot = None
        if drawing == "circle":
            middle = shape.struts[struts, 0].mean(axis=0)
            pivot = next(arm[0] for arm in pivots if np.allclose(arm[1], middle)).tolist()
        arms.append({"struts": struts, "pivot": pivot})
    return {
        "paths": [path.tolist() for path in shape.paths],
        "frame": shape.frame.tolist(),
        "arms": arms,
        "platform": _numbers(shape.platform[:-1], shape.struts[:, 1]),
        "points": [*shape.struts.reshape(-1, 3).tolist(), shape.tool.tolist()],
    }


def _numbers(points: Floats, among: Floats) -> list[int]:
    """Which of the points `among` (n, 3) each is."""
    apart = np.linalg.norm(points[:, np.newaxis] - among[np.newaxis], axis=2)
    return [int(at) for at in apart.argmin(axis=1)]


@cache
def _script(name: str) -> str:
    return files("truepose.reporting.live").joinpath(name).read_text(encoding="utf-8")


def _together(names: Iterable[str]) -> str:
    return plain_text(_script(name) for name in names)


def plain_text(texts: Iterable[str]) -> str:
    """Scripts or styles one after the other, without indentation and lines of comments."""
    lines = (line.strip() for text in texts for line in text.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith("//"))


__all__ = [
    "LivePart",
    "assembled",
    "drawing",
    "is_built",
    "live_of",
    "live_or_why_not",
    "live_part",
    "machine_in_page",
    "packed_kernel",
    "plain_text",
    "script",
    "shared_kernel",
]
