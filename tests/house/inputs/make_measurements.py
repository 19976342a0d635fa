"""Makes the measurements beside it: every kind of instrument at a hexapod, with noise.

`PYTHONPATH=python python tests/house/inputs/make_measurements.py` writes the same files every
time. The hexapod is machines/hexapod.toml with every tolerance somewhere in its band; what the
instruments read of it is worked out here in NumPy.
"""

from pathlib import Path

import numpy as np

import truepose as tp

FOLDER = Path(__file__).parent
MACHINE = FOLDER.parents[2] / "machines" / "hexapod.toml"
MICRO = 1e-6
ORIGIN = np.array([0.9, -0.3, 0.2])
STRUTS = "123456"
FRAME = 'frame = "unknown"'
COMMANDS = [f"command.{axis} (mm)" for axis in "xyz"] + [f"command.{axis} (deg)" for axis in "abc"]


def turn(angles: np.ndarray) -> np.ndarray:
    """(3, 3) R = Rz(c) Ry(b) Rx(a)."""
    (ca, cb, cc), (sa, sb, sc) = np.cos(angles), np.sin(angles)
    rx = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    ry = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    return np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]]) @ ry @ rx


def written(name: str, head: str, header: list[str], rows: np.ndarray) -> None:
    """Write one file of measurements."""
    lines = [f"#: {line}" for line in head.strip().splitlines()]
    lines.append(", ".join(header))
    lines += [", ".join(f"{value:.7f}" for value in row) for row in rows]
    (FOLDER / f"{name}.csv").write_text("\n".join(lines) + "\n")


def head(kind: str, uncertainty: str, *more: str) -> str:
    """The declaration of one instrument."""
    lines = [f"[instrument.{kind}]", f'kind = "{kind}"', *more, f"uncertainty = {uncertainty}"]
    return "\n".join(lines)


def main() -> None:
    """Write all files."""
    rng = np.random.default_rng(5)
    machine = tp.load(MACHINE)
    inch = 0.0254
    bands = {"base": 2e-4 * inch, "platform": 2e-4 * inch, "length": 5e-4 * inch}
    change = {
        name: float(value + rng.uniform(-1, 1) * bands[name.split(".")[2]])
        for name, value in zip(machine.parameters, machine.nominal, strict=True)
        if name.startswith("strut.") and name.split(".")[2] in bands
    }
    actual = machine.replace(change)
    low, high = np.array([-4, -4, 18]) * inch, np.array([4, 4, 22]) * inch
    tilt = np.radians([8.0, 8.0, 3.0])
    poses = np.concatenate(
        [rng.uniform(low, high, (30, 3)), rng.uniform(-tilt, tilt, (30, 3))], axis=1
    )
    joints = machine.inverse(poses)
    true = actual.forward(joints, poses)
    points, turns = true[:, :3], np.array([turn(pose[3:]) for pose in true])
    values = dict(zip(actual.parameters, actual.nominal, strict=True))
    ends = [
        [np.array([values[f"strut.{n}.{end}.{axis}"] for axis in "xyz"]) for n in STRUTS]
        for end in ("base", "platform")
    ]
    along = np.array(
        [
            [p + r @ ends[1][k] - ends[0][k] for k in range(6)]
            for p, r in zip(points, turns, strict=True)
        ]
    )
    lengths = np.linalg.norm(along, axis=-1)
    units = along / lengths[..., np.newaxis]
    commands = np.concatenate([1e3 * poses[:, :3], np.degrees(poses[:, 3:])], axis=1)
    length_noise, angle_noise = 1e3 * 1.0 * MICRO, np.degrees(5.0 * MICRO)

    def make(name: str, text: str, header: list[str], readings: np.ndarray, noise: object) -> None:
        read = readings + rng.normal(0.0, 1.0, readings.shape) * noise
        written(name, text, COMMANDS + header, np.concatenate([commands, read], axis=1))

    axes, angles = [f"{axis} (mm)" for axis in "xyz"], [f"{axis} (deg)" for axis in "abc"]
    seen = 1e3 * (points - ORIGIN)
    turned = np.degrees(true[:, 3:])
    both = np.concatenate([1e3 * points, turned], axis=1)
    noise = np.array([length_noise] * 3 + [angle_noise] * 3)
    make("pose", head("pose", '["1 um", "5 urad"]', 'frame = "base"'), axes + angles, both, noise)
    make("position", head("position", '"1 um"', FRAME), axes, seen, length_noise)
    make("coordinate", head("coordinate", '"1 um"', FRAME), axes[2:], seen[:, 2:], length_noise)
    make("orientation", head("orientation", '"5 urad"', FRAME), angles, turned, angle_noise)
    height = seen[:, 2:]
    make("plane", head("plane", '"1 um"', FRAME), ["distance (mm)"], height, length_noise)
    centre = 'frame = { origin = ["905 mm", "-300 mm", "200 mm"], unknown = ["x", "y", "z"] }'
    apart = np.linalg.norm(seen, axis=1)[:, np.newaxis]
    make("distance", head("distance", '"1 um"', centre), ["distance (mm)"], apart, length_noise)
    scales = [f"strut.{n}.length (mm)" for n in STRUTS]
    bias = head("strut-length", '"1 um"', 'bias = "unknown"')
    make("strut-length", bias, scales, 1e3 * lengths + 0.05, length_noise)
    looks = [f"strut.{n}.direction.{axis}" for n in "13" for axis in "xyz"]
    make(
        "strut-direction",
        head("strut-direction", '"5 urad"', 'frame = "base"'),
        looks,
        units[:, [0, 2]].reshape(len(poses), 6),
        5.0 * MICRO,
    )
    across = np.cross([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    angle = np.degrees(np.arctan2(units[:, :2] @ across, units[:, :2, 2]))
    told = ('frame = "base"', "axis = [0, 1, 0]", "zero = [0, 0, 1]")
    turns_of = [f"strut.{n}.angle (deg)" for n in "12"]
    make("joint-angle", head("joint-angle", '"5 urad"', *told), turns_of, angle, angle_noise)

    # A ball held in a socket: the joints that keep the actual tool there at several tilts.
    held = np.concatenate([np.tile([0.01, 0.02, 0.5], (20, 1)), poses[:20, 3:]], axis=1)
    joints = 1e3 * (actual.inverse(held) + rng.normal(0.0, MICRO, (20, 6)))
    columns = [f"joint.{name} (mm)" for name in machine.joints]
    written("contact", head("contact", '"3 um"', FRAME), columns, joints)


if __name__ == "__main__":
    main()
