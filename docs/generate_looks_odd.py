"""Write docs/looks_odd.md from the rules of `truepose.plausibility`.

Run `python docs/generate_looks_odd.py` after a change of a rule; a test refuses a page that is not
what this writes.
"""

from __future__ import annotations

from pathlib import Path

from truepose.plausibility import RULES

HEAD = """# What looks odd

<!-- Written by `python docs/generate_looks_odd.py`. Do not edit. -->

A machine file may be valid and still not be the machine that was meant: metres for millimetres,
308 °C, base and platform exchanged. `truepose check` says so above its answer:

    looks odd[odd-temperature]: strut.1, strut.2, drive.d1 and 4 more: a temperature of 308 °C;
    usual is from -90 °C, the coldest air on Earth, to 120 °C, from which on bearings grow for
    good. Look at the unit of temperatures: 35 °C is 308 K and 95 °F. If it is meant, leave it, but
    expansion is taken as the same at all temperatures

None of it is an error: answers, numbers and the exit code are the same, and nothing is repaired.
Where `check` can give no answer, as no pose is reached, it stands on stderr above the error, and
is often why. `--format json` has it as `oddities`, each with `code`, `sentence` and `parts` (the
paths that are meant); `truepose report` has a table of it; in Python:

```python
import truepose as tp

machine = tp.load("machines/hexapod.toml", ["condition.temperature=308"])
for oddity in tp.oddities(machine):
    print(oddity.code, oddity.sentence)
```

`truepose explain CODE` shows an example of each ([errors.md](errors.md#what-looks-odd)).

## The rules

A rule looks at the nominal machine at its home pose, in the base frame, and at which poses of the
workspace can be used. It judges by physics, or by ratios of the machine's own sizes, and is not
tuned to any machine. Where the machine is not at home, for home is out of reach, rules that need
it say nothing.

The tests hold them against blunders made in the library's machines, each of which has to be named
by its rule, and against the library itself and 1000 machines drawn at random, of twelve families
from 50 mm to 5 m, about which nothing may be said (`tests/made_oddities.py`,
`tests/sound_machines.py`).

| code | what is odd | why there |
|---|---|---|
"""


def page() -> str:
    """The text of docs/looks_odd.md."""
    rows = [f"| [`{r.code}`](errors.md#{r.code}) | {r.doc} | {r.basis} |" for r in RULES]
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    (Path(__file__).parent / "looks_odd.md").write_text(page(), encoding="utf-8")
    print("docs/looks_odd.md")
