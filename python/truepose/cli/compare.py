"""`truepose compare`: whether a machine changed between two files of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from truepose.cli._options import InputFile, format_option, output_option_of, takes
from truepose.cli._verbose import verbose_option

_FILE = InputFile(".toml")


@click.command("compare")
@click.argument("old_file", metavar="OLD.toml", type=_FILE)
@click.argument("new_file", metavar="NEW.toml", type=_FILE)
@takes(format_option, output_option_of(".json or .csv"), verbose_option)
def command(old_file: Path, new_file: Path, **options: Any) -> int:
    """Tell whether a machine changed between two files of it.

    Is it still the same? Exit code 0: it did not change beyond what both files say of their
    uncertainty. Exit code 1: it did. Compares parameter by parameter, all parameters together, and
    where the tool goes. Two calibrations of an unchanged machine are told apart by chance in at
    most 5 % of cases, and in far fewer where both rest on the same tolerances: then small changes
    are missed.
    """
    from truepose.cli import _steps
    from truepose.cli._verbose import step
    from truepose.files.writing import replacing, require_writable
    from truepose.reporting.compare import compare, text

    form, output = options["format"], options["output"]
    if output is not None:
        require_writable(output, [".json", ".csv"], [old_file, new_file])
    old, new = _steps.load_machine(old_file), _steps.load_machine(new_file)
    with step("comparison"):
        comparison = compare(old, new)
    if form == "table":
        from truepose.cli._show import show_tables

        show_tables(comparison.tables)
        click.echo(comparison.verdict)
    else:
        click.echo("".join(text(comparison, form)), nl=False)
    if output is not None:
        with replacing(output) as temporary:
            ending = output.suffix.lower().removeprefix(".")
            temporary.write_text("".join(text(comparison, ending)), encoding="utf-8")
        _steps.note_written(output)
    return int(comparison.changed)
