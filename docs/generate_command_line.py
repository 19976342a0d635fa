"""Write docs/command_line.md from the commands themselves.

Run `python docs/generate_command_line.py` after a change of a command or an option; a test refuses
a page that is not what this writes.
"""

from __future__ import annotations

from pathlib import Path

import click

from truepose.cli import cli

HEAD = """# Command line

Written by `python docs/generate_command_line.py` from the commands; do not edit.

`truepose COMMAND MACHINE.toml` reads one machine file ([machine_file.md](machine_file.md)) and
computes everything from it.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | answered with no: `check`, `calibrate`, `compare`, `gcode`, any with `--require-accuracy` |
| 2 | bad input; every problem is on stderr, with `--format json` on stdout too |
| 130 | interrupted (Ctrl-C): no file changed; `montecarlo`, `shares`, `bounds` give what is done |
| 141 | the reader of the output went away |

Tables speak the machine file's units, smaller ones for errors: mm and µm, or in and µin; degrees
and mdeg, or rad and µrad ([results.md](results.md#units)). `json` and `csv` have full precision in
the units that the machine file declares, and name the unit of every value: a number is within 1e-14
of the result, and 125 where rounding made 124.99999999999999 of it; a missing number is `null` or
an empty cell. The variables are those of [results.md](results.md). `json` has every variable; `csv`
has one row for each pose and source and one for all sources together (`overall`); of shares one for
each pose and parameter or source, of bounds over a region one for each component and magnitude, of
a calibration one for each unknown. A pose that cannot be used is left out, counted, and listed with
its status: in `json` under `left_out`, in `csv` as a row of its own. `.nc` files are the Dataset as
it is, in SI.

A file is written under a temporary name beside its place and then renamed, so it is whole or it
is not there. Progress, with the rate and the time left at that rate, shows on stderr, on a
terminal, when the work takes more than two seconds. What to know before the numbers are used
(`guide-taken-rigid`: [machines.md](machines.md#what-a-description-leaves-out)) is on stderr too,
once, as `warning[CODE]: ...`, and in `json`.

`-` as the name of a machine file, of measurements or of a program is standard input, for one file
of a command; problems then name `<stdin>` and its lines, and data files that a machine file names
are looked for in the current folder.

`--verbose` says on stderr what was read (with its SHA-256), what machine, poses and sources that
makes, and how long each step took; what is printed on stdout stays the same. `truepose explain
CODE` says what a code means, what to do, and shows an example: [errors.md](errors.md) has all.

`truepose completion SHELL` makes the Tab key complete commands, options, files by their endings,
kinds of machine, controllers and codes, and for `--set` the keys of the machine file that stands
before it on the line. An editor completes the keys inside a machine file by its JSON schema, with
taplo (Even Better TOML): the first line of a file that `truepose init` writes names
`truepose-schema.json`, which `truepose schema -o truepose-schema.json` puts beside it.

`montecarlo`, `bounds` and `shares` answer how sure an error is: [how_sure.md](how_sure.md) says
which of their numbers to quote to whom.
"""


def page() -> str:
    """The text of docs/command_line.md."""
    parts = [HEAD]
    width = {"max_content_width": 98, "terminal_width": 98}
    context = click.Context(cli, info_name="truepose", **(cli.context_settings | width))
    parts.append(f"```text\n{cli.get_help(context)}\n```\n")
    for name in cli.list_commands(context):
        command = cli.get_command(context, name)
        assert command is not None
        own = click.Context(command, info_name=name, parent=context, **width)
        parts.append(f"## {name}\n\n```text\n{command.get_help(own)}\n```\n")
    return "\n".join(parts)


if __name__ == "__main__":
    (Path(__file__).parent / "command_line.md").write_text(page(), encoding="utf-8")
    print("docs/command_line.md")
