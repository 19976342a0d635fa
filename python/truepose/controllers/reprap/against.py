"""Which lines of a config.g are to change."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.controllers._against import Edit
from truepose.controllers._export import Export
from truepose.controllers._reader import ControllerFile
from truepose.controllers._word_lines import printed_words, word_edits

NOT_FITTED = ("M665 B",)
"""The workspace's radius: that of the file stays."""


def edits(file: ControllerFile, export: Export) -> Iterator[Edit]:
    """M665 and M666."""
    yield from word_edits(file, printed_words(export), NOT_FITTED)


__all__ = ["edits"]
