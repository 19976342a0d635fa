"""A delta printer calibrated by heights alone, which is refused, and by x, y and z.

The measurements are simulated, by data/simulate_delta_printer.py: eleven points of the bed, 10 µm
of noise. Heights alone give a flat bed and rods that nobody cut.
"""

from pathlib import Path

import numpy as np

import truepose as tp

DATA = Path(__file__).parent / "data"

m = tp.load(DATA / "delta_printer.toml")
rods = [name for name in m.parameters if name.endswith(".length")]

# What firmware does: heights alone decide, and nothing else is known.
heights = tp.calibrate(m, DATA / "delta_heights.csv", use_prior=False)
found = heights.calibrated()
lengths = [1e3 * found.nominal[m.parameters.index(name)] for name in rods]
left = 1e6 * np.std(heights.dataset["residual_after"].values)
print(f"heights: {left:.1f} µm are left of the residuals, and yet the rods")
print("would be", ", ".join(f"{length:.2f} mm" for length in lengths))
print(heights.gate.words, "\n")

positions = tp.calibrate(m, DATA / "delta_positions.csv")
print(positions.gate.words)
shown = positions.dataset
for at, label in enumerate(shown["unknown_label"].values):
    value, sure = 1e3 * shown["value"].values[at], 1e3 * shown["standard_uncertainty"].values[at]
    print(f"{label:18} {value:+.3f} mm, known to {sure:.3f} mm")
