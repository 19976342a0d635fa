"""A program corrected for a warm and loaded hexapod, and what the proof says of it."""

import tempfile
from pathlib import Path

import truepose as tp

MACHINES = Path(__file__).parent.parent / "machines"

m = tp.load(MACHINES / "hexapod.toml")
warm = m.condition.replace(temperature={"strut.1": 303.15, "strut.2": 305.15})

with tempfile.TemporaryDirectory() as folder:
    part, corrected = Path(folder) / "part.ngc", Path(folder) / "corrected.ngc"
    part.write_text(
        "G21 G90 G94 F600\n"
        "G0 X-40 Y-30 Z500 A0 B0 C0\n"
        "G1 X40 (80 mm in one block)\n"
        "G3 X60 Y-10 I0 J20\n"
        "M2\n"
    )
    proof = tp.correct_program(m, part, corrected, warm, interpolation="pose")
    print(corrected.read_text())

print(f"{proof.moves} moves became {proof.blocks} blocks")
for when, errors in (("before", proof.before), ("after", proof.after)):
    worst = errors.position
    if worst is not None:
        print(f"{when}: at most {1e6 * worst.value:.3f} µm, in line {worst.line}")
