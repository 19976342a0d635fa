"""What truepose costs: ratios against the same work in NumPy, SciPy and the kernel's scalar path.

`python -m benchmarks` runs everything, each benchmark in a process of its own, and writes
RESULTS.md; `python -m benchmarks NAME ...` runs some and only prints. To add one: a module here
with `measure()`, which returns rows, and its name in `BENCHMARKS`.
"""

from benchmarks.rows import Benchmark

BENCHMARKS = (
    Benchmark("forward_batch"),
    Benchmark("sensitivity"),
    Benchmark("forward_call"),
    Benchmark("two_threads", cores=2),
    Benchmark("start_up"),
    Benchmark("all_sources"),
    Benchmark("million_poses", cores=2),
    Benchmark("largest_error", cores=2),
    Benchmark("over_time"),
    Benchmark("monte_carlo"),
    Benchmark("memory"),
    Benchmark("bounds"),
    Benchmark("containment", cores=2),
    Benchmark("linuxcnc_module"),
    Benchmark("gcode", cores=2),
    Benchmark("calibration"),
)
