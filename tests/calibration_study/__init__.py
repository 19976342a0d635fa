"""Calibrations of machines that are known, with blunders made in their data: what becomes of them.

    PYTHONPATH=tests python -m calibration_study run --count 150 --output build/study.jsonl
    PYTHONPATH=tests python -m calibration_study power --count 50 --output build/power.jsonl
    PYTHONPATH=tests python -m calibration_study follow --count 50 --output build/follow.jsonl
    PYTHONPATH=tests python -m calibration_study use --output build/use.jsonl

A *set* is a machine drawn at random, an instrument, its readings and a blunder in them. The truth
is plain NumPy (`truth.py`): the kernel that fits neither makes the readings nor judges the tool.
`blunders.py` spoils a table of readings, `judge.py` holds the answer against the truth, `advice.py`
does what the answer asks for, `in_use.py` commands the machine with what was written for it.
"""
