"""Which error source dominates, and where: the budget of the planar two-slider machine."""

from pathlib import Path

import truepose as tp

MACHINES = Path(__file__).parent.parent / "machines"

m = tp.load(MACHINES / "planar_two_slider.toml")
budget = tp.budget(m)

print(f"{m.name}: {budget.sizes['pose']} poses")
for source in budget["source"].values:
    row = budget.sel(source=source)
    worst = float(row["highest"].sel(quantity="position"))
    share, verdict = float(row["share"]), str(row["verdict"].values)
    print(f"  {source:10} at most {1e6 * worst:6.1f} µm, {100 * share:4.1f} %: {verdict}")

# The error of one source at one pose, actual minus commanded, in µm along x and y.
print(1e6 * budget["error"].sel(source="thermal").isel(pose=0).values)
