"""How much of anything is taken: what is longer, deeper or more is refused with a sentence.

No input that people write comes near one of these. `docs/limits.md` states them for users.
"""

from __future__ import annotations

LONGEST_QUANTITY = 200
"""Characters of one value that is written as text, such as "12.5 mm"."""

LONGEST_UNIT = 60
"""Characters of a unit."""

HIGHEST_POWER = 12
"""Of a unit, powers of powers multiplied: a second moment of area has 4, and (m^2)^3 has 6."""

LARGEST_QUANTITY = 1e50
"""Of any quantity, in SI units: beyond it, products and squares of quantities are no numbers."""

MOST_DIGITS = 400
"""Digits of one number in a TOML file; Python refuses to read some thousands."""

DEEPEST_NESTING = 50
"""Lists and tables in each other, and parts of one dotted key, of a TOML file."""

LARGEST_FILE = 100_000_000
"""Bytes of a file that is read whole: every one but programs of G-code."""

LONGEST_TOML = 4_000_000
"""Characters of a machine file, or of what a file of measurements states at its head."""

LONGEST_MOVE = 10_000
"""Characteristic lengths of the machine that the path of one move of a program is long."""

MOST_PIECES = 500_000
"""Pieces into which the moves of a program are cut that are divided together, some thousands."""

MOST_TURNS = 1000
"""Turns of one arc of a program."""

MOST_THREADS = 1024
"""Threads that share the work, however many are asked for."""

MOST_WORKERS = 1024
"""Processes on this computer that share the work."""

MOST_SAMPLES = 10**9
"""Samples at one pose."""

LONGEST_NAME = 200
"""Characters of the name of a machine or of a part."""

MOST_COLUMNS = 2000
"""Columns of a data file or of a file of measurements."""

MOST_INCLUDED = 200
"""Files that a controller's file includes, with those that these include."""
