"""`[[guide]]`, what every kind has: the rest is in the kernel's table of elements."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable, PartName


class GuideTable(FileTable):
    """A passive limb: what holds the platform beside the struts, without a drive."""

    name: PartName = Field(description="Name of the guide and of its closures.")
    kind: str = Field(description="The kind of guide, such as `plane`.")
