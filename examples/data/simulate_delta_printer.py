"""Makes the two files of measurements beside it: a delta printer that is not as drawn, and noise.

`python examples/data/simulate_delta_printer.py` writes the same files every time. The true printer
is drawn once from the tolerances of delta_printer.toml; it is commanded to eleven points on the
bed, and where it then stands is read with 10 µm of noise: its height alone, or x, y and z.
"""

from pathlib import Path

import numpy as np

import truepose as tp

FOLDER = Path(__file__).parent
NOISE = 10e-6
HEAD = """# Simulated by simulate_delta_printer.py, seed {seed}, noise 10 um.
# At 11 points of the bed: {what}.
#: machine = "Delta printer"
#: [instrument.{name}]
#: kind = "{kind}"
#: frame = "base"
#: uncertainty = "10 um"
"""


def bed() -> np.ndarray:
    """(11, 3) two rings of points and the middle, m, as the firmware of printers probes them."""
    outer = np.deg2rad(np.arange(0, 360, 60))
    inner = np.deg2rad(np.arange(15, 375, 90))
    rings = [(0.105, outer), (0.052, inner)]
    points = [(r * np.cos(a), r * np.sin(a), 0.0) for r, angles in rings for a in angles]
    return np.array([*points, (0.0, 0.0, 0.0)])


def true_printer(machine: tp.Machine, rng: np.random.Generator) -> tp.Machine:
    """The printer as it is: every tolerance somewhere within its band, groups together."""
    (bands,) = (source.bands for source in machine.sources if source.name == "tolerance")
    drawn = rng.uniform(-1.0, 1.0, bands.variables.max() + 1)
    change = bands.signed_half[0] * drawn[bands.variables]
    names = [machine.parameters[at] for at in bands.parameters]
    values = machine.nominal[bands.parameters] + change
    return machine.replace(dict(zip(names, values.tolist(), strict=True)))


def main(seed: int = 1) -> None:
    """Write both files."""
    rng = np.random.default_rng(seed)
    machine = tp.load(FOLDER / "delta_printer.toml")
    commanded = bed()
    actual = true_printer(machine, rng).forward(machine.inverse(commanded))
    read = 1e3 * (actual + rng.normal(0.0, NOISE, actual.shape))
    for name, kind, what, axes in (
        ("probe", "coordinate", "heights", "z"),
        ("camera", "position", "x, y and z", "xyz"),
    ):
        lines = [HEAD.format(seed=seed, what=what, name=name, kind=kind)]
        header = [f"command.{axis} (mm)" for axis in "xyz"] + [f"{axis} (mm)" for axis in axes]
        lines.append(", ".join(header) + "\n")
        for command, reading in zip(1e3 * commanded, read, strict=True):
            cells = [f"{value:.3f}" for value in command]
            cells += [f"{reading['xyz'.index(axis)]:.4f}" for axis in axes]
            lines.append(", ".join(cells) + "\n")
        (FOLDER / f"delta_{'heights' if axes == 'z' else 'positions'}.csv").write_text(
            "".join(lines)
        )


if __name__ == "__main__":
    main()
