"""Which dimension to tighten first: exact derivatives to every parameter of a hexapod."""

from pathlib import Path

import numpy as np

import truepose as tp

MACHINES = Path(__file__).parent.parent / "machines"

m = tp.load(MACHINES / "hexapod.toml")
sensitivity = m.sensitivity(m.poses())  # (pose, component, parameter)
amplification = np.linalg.norm(sensitivity[:, :3], axis=1).max(axis=0)

lengths = [index for index, unit in enumerate(m.units) if unit == "m"]
for index in sorted(lengths, key=lambda index: -amplification[index])[:5]:
    print(f"{m.parameters[index]:22} 1 µm moves the tool by up to {amplification[index]:.2f} µm")

# The same from the exact model: one strut 10 µm longer than it should be.
name = m.parameters[lengths[0]]
other = m.replace({name: m.nominal[lengths[0]] + 10e-6})
home = m.poses()[0]
print(name, "10 µm off:", 1e6 * (other.forward(m.inverse(home), home) - home)[:3], "µm")
