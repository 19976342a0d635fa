"""C99 of a machine: inverse and forward kinematics, and compensated joints.

The formulas are the kernel's own, recorded and printed (`crates/kernel/src/code`); the templates
beside this file are what is no formula: loops, pivoting, status.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from truepose.controllers._export import Export, Option, geometry_compensated
from truepose.controllers._prefix import prefix_of, prefix_option
from truepose.controllers.c._program import HEADERS, Program, program_of
from truepose.machine import Machine

WITHOUT = Option("", "error sources to leave out, by name, with commas between", dimension=None)


class C:
    """The kinematics of one machine as a C99 header and source."""

    name: ClassVar[str] = "c"
    doc: ClassVar[str] = "C99 header and source: inverse, forward and compensated joints"
    options: ClassVar[Mapping[str, Option]] = {
        "without": WITHOUT,
        "prefix": prefix_option("without it, with the machine file's name"),
    }

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """Header and source, named as the machine file, or by `prefix`.

        Raises `RequestError` (controller-cannot, bad-option, no-workspace).
        """
        prefix = prefix_of("c", options["prefix"], HEADERS)
        program = program_of(machine, prefix, without=names_of(options["without"]))
        return Export(
            {f"{program.prefix}.h": program.header, f"{program.prefix}.c": program.source},
            (*program.statement, *geometry_compensated(machine)),
        )


def names_of(listed: float | str) -> tuple[str, ...]:
    """The names in a list with commas."""
    return tuple(name.strip() for name in str(listed).split(",") if name.strip())


__all__ = ["WITHOUT", "C", "Program", "names_of", "program_of"]
