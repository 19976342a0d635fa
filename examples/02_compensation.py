"""What to command instead, and what remains: a hexaglide, warm and under load."""

from pathlib import Path

import numpy as np

import truepose as tp

MACHINES = Path(__file__).parent.parent / "machines"

m = tp.load(MACHINES / "hexaglide.toml")
poses = m.poses()[:3]
corrected = tp.compensate(m, poses)

for index in range(len(poses)):
    row = corrected.isel(pose=index)
    change = 1e6 * (row["joint_corrected"].values - row["joint_nominal"].values)
    print("command", np.round(1e3 * poses[index], 3), "change of joints, µm", np.round(change, 2))

# Known errors are gone; unknown bands remain, at most the bound (to first order).
print("left with exact knowledge, nm:", 1e9 * float(abs(corrected["residual_middle"]).max()))
position = corrected["residual_upper"].sel(component=["x", "y", "z"])
print("left at the upper edge, µm:", 1e6 * float(abs(position).max()))
