"""`truepose live`: the live part of the report alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from truepose.cli._options import (
    OutputFile,
    Request,
    language_option,
    machine_argument,
    set_option,
    takes,
)
from truepose.cli._verbose import verbose_option


@click.command("live")
@takes(
    machine_argument,
    set_option,
    click.option(
        "--output",
        "-o",
        "output",
        metavar="FILE",
        type=OutputFile(".html"),
        help="Where the page goes. By default beside you, named after the machine file: "
        "hexapod-live.html (of standard input, live.html).",
    ),
    language_option,
    verbose_option,
)
def command(**options: Any) -> int:
    """Write a page on which the machine's errors follow sliders.

    The page has the kernel in it: pose, temperatures, load and tolerances are set on it, and the
    error, its sources, what tolerances leave open and a proven bound are worked out anew, without
    a network. `truepose report` has the same after its page one.
    """
    from truepose.reporting.drawing_packages import speaking_for

    with speaking_for(options.pop("language")):
        return _live(options)


def _live(options: dict[str, Any]) -> int:
    from truepose.cli import _steps
    from truepose.cli._verbose import step
    from truepose.files.one_run import is_stdin
    from truepose.reporting.drawing_packages import module_that_draws

    if options["output"] is None:
        file: Path = options["machine_file"]
        options["output"] = Path("live.html" if is_stdin(file) else f"{file.stem}-live.html")
    request = Request(**options)
    assert request.output is not None
    page: Any = module_that_draws("truepose.reporting.live.page")
    machine = _steps.read_machine(request, page.ENDINGS)
    with step("live part"):
        text = page.html(machine)
    with step(f"{request.output} written"):
        page.write_text(text, request.output)
    _steps.note_written(request.output)
    return 0
