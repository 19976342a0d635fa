"""Error over an hour of warming up: a temperature log through the thermal source."""

import tempfile
from pathlib import Path

import numpy as np

import truepose as tp

MACHINES = Path(__file__).parent.parent / "machines"

# A log as a data logger would write it, here made: 1 h at 1 Hz. The struts heat up to 35 degC with
# a time constant of 15 min, the frame to 24 degC with one of 45 min.
seconds = np.arange(3601)
strut = 20 + 15 * (1 - np.exp(-seconds / 900))
frame = 20 + 4 * (1 - np.exp(-seconds / 2700))
rows = [f"{t},{s:.4f},{f:.4f}" for t, s, f in zip(seconds, strut, frame, strict=True)]

with tempfile.TemporaryDirectory() as folder:
    log = Path(folder) / "warming_up.csv"
    log.write_text("\n".join(["time (s),default (degC),frame (degC)", *rows]) + "\n")
    # In a machine file: [condition] temperature_log = "warming_up.csv", [frame] material = "steel".
    m = tp.load(
        MACHINES / "linear_delta.toml",
        [f"condition.temperature_log={log}", "frame.material=steel"],
    )

found = tp.over_time(m)  # at home; SI
error = 1e6 * np.linalg.norm(found["error"].sel(component=["x", "y", "z"])[:, 0], axis=1)
print(f"{m.name}, {found.sizes['time']} moments")
for minute in (0, 5, 15, 30, 60):
    print(f"  after {minute:2} min: {error[60 * minute]:6.2f} µm")
warm = np.argmax(error > 0.9 * error[-1])
print(f"90 % of the last error are there after {warm / 60:.0f} min")
