"""Parts a second time: machines drawn, driven along a path, and what they make evaluated.

Plain NumPy and SciPy, from the pages of the documentation; nothing is shared with truepose but the
description of a machine (tests/build_machine.py), which the tests read themselves.

    closed_struts.py    where a machine with struts alone goes: Newton's method, many at once
    on_the_way.py       what errors do along a path: ripple, rounding, play, forces, visits
    shapes.py           what drawings tolerate: sizes, minimum zones, datums, by other means
"""
