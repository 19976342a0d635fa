"""Which dimension of a pocket with four bores will be out, and is compensation enough?"""

from pathlib import Path

import truepose as tp

ROOT = Path(__file__).parent.parent
PART = ROOT / "examples" / "part"

m = tp.load(ROOT / "machines" / "hexapod.toml")
answers = tp.part(m, PART / "pocket.ngc", PART / "pocket.toml", samples=1000)

for name in answers["characteristic"].values:
    told = answers.sel(characteristic=name)
    before, after = told["verdict"].values
    if before == after == "met":
        continue
    # Sizes are told as what they are off from nominal; forms and zones have a nominal value of 0.
    known = 1e6 * (told["known"] - told["nominal"]).values
    out = 100 * told["probability_out"].values
    print(f"{name}: {before}, after compensation {after}")
    for state, off, share in zip(answers["state"].values, known, out, strict=True):
        print(f"    {state}: {off.round(1) + 0.0:+.1f} µm, {share:.1f} % of the machines are out")
    of_source = 1e6 * told["source_known"].sel(state="before compensation")
    worst = abs(of_source).idxmax("source").item()
    print(f"    most is {worst}: {of_source.sel(source=worst).item():+.1f} µm")
