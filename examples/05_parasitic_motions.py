"""What a 3-PRS head does besides what it is told: its parasitic motions over the tilt."""

from pathlib import Path

import numpy as np

import truepose as tp

MACHINES = Path(__file__).parent.parent / "machines"

m = tp.load(MACHINES / "3prs.toml")
tilts = np.radians([5.0, 10.0, 15.0, 20.0])
print(f"{m.name}: commanded {' '.join(m.commanded)} of {' '.join(m.dof)}")

# The joints of a commanded pose, and from them the whole platform: all six freedoms.
for a in tilts:
    for b in (0.0, a):
        joints = m.inverse([0.04, a, b])
        pose = dict(zip(m.dof, m.forward(joints), strict=True))
        print(
            f"  a {np.degrees(a):4.1f}°, b {np.degrees(b):4.1f}°: "
            f"x {1e3 * pose['x']:7.2f} mm, y {1e3 * pose['y']:7.2f} mm, "
            f"c {np.degrees(pose['c']):6.2f}°"
        )

# They are known and repeat. What the parts make of them is an error like any other.
budget = tp.budget(m)
for component in budget["component"].values:
    worst = float(np.abs(budget["overall_error_upper"].sel(component=component)).max())
    print(f"  {component}: up to {1e6 * worst:6.1f} µm or µrad off, at the upper edges")
