"""`[family]`: the few parameters from which all joint centres follow."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable


class FamilyTable(FileTable):
    """A machine in the parameters that its owner knows.

    Drives, struts and guides with their joint centres, and `dof` and `commanded` of `[machine]`,
    follow from it, named as below, so that no row need stand in the file. One that does, by its
    `name`, adds what is no geometry (`travel`, `stiffness`, `material`, ...), as does `[each.*]`;
    geometry that it repeats has to be that of the family. `--set family.KEY=...` acts before the
    joint centres are made, every other setting after it. `[tolerance]` takes the parameters too:
    `"family.KEY"` moves all joint centres that follow from it together.
    """

    kind: str = Field(description="The kind of machine, such as `linear_delta`.")
