"""What truepose costs: ratios against the same work in NumPy, SciPy and the kernel's scalar path.

`python -m benchmarks` runs all usual ones, `python -m benchmarks NAME ...` some, each in a process
of its own, and puts their rows into RESULTS.md. `python -m benchmarks.against COMMIT` compares with
an earlier commit. To add one: a module here with `measure()`, which returns rows, and its name in
`BENCHMARKS`.
"""

from benchmarks.rows import Benchmark

BENCHMARKS = (
    Benchmark("forward_batch"),
    Benchmark("peers"),
    Benchmark("sensitivity"),
    Benchmark("forward_call"),
    Benchmark("two_threads", cores=2),
    Benchmark("start_up"),
    Benchmark("all_sources"),
    Benchmark("million_poses", cores=2),
    Benchmark("over_time"),
    Benchmark("monte_carlo"),
    Benchmark("memory"),
    Benchmark("bounds"),
    Benchmark("bounds_region", cores=2, usual=False),
    Benchmark("containment", cores=2),
    Benchmark("linuxcnc_module"),
    Benchmark("gcode", cores=2),
    Benchmark("part"),
    Benchmark("calibration"),
    Benchmark("live_page", cores=2),
    Benchmark("studio", cores=2),
    Benchmark("cluster", cores=2, usual=False),
    Benchmark("scaling", cores=2),
)
