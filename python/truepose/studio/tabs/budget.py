"""The tab of the error budget: the sources ranked, and which poses were left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from truepose.error_budget.evaluate import evaluate
from truepose.studio.answers import CONDITION, EDITS, Question, Value, finite

NAME = "budget"
FOLLOWS = frozenset({EDITS, CONDITION})


def give(question: Question) -> Iterator[Value]:
    """The ranking of `truepose budget`, the first rank first. Raises as `truepose.budget`."""
    result = evaluate(question.machine, None, question.condition, question.progress).dataset()
    kinds = [str(kind) for kind in result["quantity"].values]
    rows = []
    for row in np.argsort(result["rank"].values, kind="stable").tolist():
        of = {
            name: dict(zip(kinds, map(finite, result[name].values[row]), strict=True))
            for name in ("highest", "rms")
        }
        rows.append(
            {
                "name": str(result["source"].values[row]),
                "rank": int(result["rank"].values[row]),
                "share": finite(result["share"].values[row]),
                "verdict": str(result["verdict"].values[row]),
                **of,
            }
        )
    left_out = Counter(str(status) for status in result["left_out_status"].values)
    yield {"rows": rows, "left_out": dict(left_out)}


__all__ = ["FOLLOWS", "NAME", "give"]
