"""A printer.cfg cut down to what kinematics and calibration read, for Klipper's own code."""

from __future__ import annotations

import configparser

KEYS = {
    "printer": ("kinematics", "delta_radius", "print_radius", "minimum_z_position",
                "shoulder_radius", "shoulder_height"),
    "stepper_a": ("position_endstop", "arm_length", "angle", "upper_arm_length",
                  "lower_arm_length"),
}  # fmt: skip
STEPS = ("microsteps", "rotation_distance", "gear_ratio", "full_steps_per_rotation")


def kinematics_of(text: str, *, steps: bool = False, measured: bool = False) -> str:
    """The sections of the printer and its three drives.

    `steps`: with what says how far they go for a step; `measured`: with [delta_calibrate].
    """
    parsed = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
    saved = "#*#"
    lines = [
        line[len(saved) + 1 :] if line.startswith(saved) else line for line in text.split("\n")
    ]
    parsed.read_string("\n".join(line.partition("#")[0] for line in lines))
    lines = []
    for section in ("printer", "stepper_a", "stepper_b", "stepper_c"):
        wanted = KEYS.get(section, KEYS["stepper_a"])
        if steps and section != "printer":
            wanted += STEPS
        lines.append(f"[{section}]")
        lines += [f"{k}: {v}" for k, v in parsed.items(section) if k in wanted]
    if measured:
        lines.append("[delta_calibrate]")
        lines += [f"{k}: {v}" for k, v in parsed.items("delta_calibrate")]
    return "\n".join(lines) + "\n"
