"""Error over a temperature log of one hour at 1 Hz."""

from __future__ import annotations

import time

import numpy as np

import truepose
from benchmarks.hexapod import load
from benchmarks.rows import Row
from truepose.machine.temperature_log import TemperatureLog

COUNT = 3600
ASKED_SECONDS = 1.0
TIME_CONSTANT = 900.0


def measure() -> list[Row]:
    """CPU time of the first `truepose.over_time` of a process, at one pose and all moments."""
    machine = load()
    times = np.arange(float(COUNT))
    share = 1.0 - np.exp(-times / TIME_CONSTANT)
    struts = {strut.part: 293.15 + (10.0 + i) * share for i, strut in enumerate(machine.struts)}
    log = TemperatureLog(times, struts)
    condition = machine.condition.replace(temperature_log=log)
    start = time.process_time()
    found = truepose.over_time(machine, condition=condition)
    seconds = time.process_time() - start
    if found["error"].shape[:2] != (COUNT, 1) or not np.isfinite(found["error"].values).all():
        raise RuntimeError("the error over time is not the one meant")
    detail = f"hexapod, home, {COUNT:,} moments of a first-order heat-up, exact, with its imports"
    return [Row("error over time, CPU time", seconds, "s", "at most", ASKED_SECONDS, detail)]
