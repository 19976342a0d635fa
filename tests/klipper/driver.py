"""Klipper's kinematics of a printer.cfg: JSON on standard input, JSON on standard output.

Runs in the environment that `install.py` makes, with the folder of Klipper's sources as its
argument, and knows nothing of truepose. Klipper reads the configuration, homes, computes and
calibrates by its own code. Only what stands between it and a microcontroller is replaced, as small
as it goes: a rail keeps its endstop and its C stepper, and a printer is a box of objects.

In:  "config", text; "positions", n rows x y z, mm; "probed", m rows of stepper positions, or none;
     "extended", whether to calibrate from what the config's [delta_calibrate] has measured.
Out: "home", where the tool stands once homed, mm; "home_joints", the steppers there, mm or rad;
     "joints", n rows; "back", the positions that Klipper finds from them; "refused", numbers of the
     positions to which it would not move; "calibrated", what DELTA_CALIBRATE would save, or
     DELTA_ANALYZE CALIBRATE=extended; "steps", how far the steppers go for a step, mm or rad.
"""

import configparser
import json
import math
import sys

sys.path.insert(0, sys.argv[1])

from klippy import chelper, configfile, mathutil, stepper
from klippy.extras import delta_calibrate
from klippy.kinematics import delta, rotary_delta

STEP = 0.000005
"""mm or rad: so small that a step is no part of what is compared."""


class Rail:
    """What a rail is to kinematics: an endstop, and a stepper whose position C works out."""

    def __init__(self, config, *, default_position_endstop=None, units_in_radians=False, **_):
        self.name = config.get_name()
        self.step = STEP
        if config.fileconfig.has_option(self.name, "microsteps"):
            turn, steps = stepper.parse_step_distance(config, units_in_radians, True)
            self.step = turn / steps
        self.position_endstop = config.getfloat("position_endstop", default_position_endstop)

    def get_homing_info(self):
        return self

    def get_name(self):
        return self.name

    def get_steppers(self):
        return [self]

    def get_step_dist(self):
        return self.step

    def setup_itersolve(self, allocate, *arguments):
        ffi, self.library = chelper.get_ffi()
        self.kinematics = ffi.gc(getattr(self.library, allocate)(*arguments), self.library.free)

    def calc_position_from_coord(self, position):
        return self.library.itersolve_calc_position_from_coord(self.kinematics, *position)

    def set_position(self, position):
        pass

    def set_trapq(self, queue):
        pass

    def generate_steps(self, time):
        pass


class Coord(tuple):
    """Four numbers."""

    def __new__(cls, *values):
        return super().__new__(cls, values)


class Printer:
    """Every object that Klipper looks up, in one."""

    Coord = Coord

    def __init__(self):
        self.kinematics, self.saved = None, {}

    def lookup_object(self, name):
        return self

    def get_printer(self):
        return self

    def register_event_handler(self, *_):
        pass

    def register_command(self, *_, **__):
        pass

    def register_step_generator(self, *_):
        pass

    def respond_info(self, text):
        pass

    def get_max_velocity(self):
        return 300.0, 3000.0

    def get_trapq(self):
        return None

    def get_kinematics(self):
        return self.kinematics

    def remove_section(self, section):
        self.saved.pop(section, None)

    def set(self, section, key, value):
        self.saved.setdefault(section, {})[key] = value


class Move:
    """A short move that ends at a position."""

    move_d = 1.0

    def __init__(self, position):
        self.end_pos, self.start_pos, self.axes_d = [*position, 0.0], [*position, 0.0], [0, 0, 1.0]
        self.accel = 3000.0

    def limit_speed(self, *_):
        pass

    def move_error(self, text="Move out of range"):
        return OverflowError(text)


def allowed(kinematics, position):
    try:
        kinematics.check_move(Move(position))
    except OverflowError:
        return False
    return True


def calibrate(printer, config, positions):
    """What DELTA_CALIBRATE saves of numbers once the bed was touched at `positions`.

    Without any: what DELTA_ANALYZE does from what the configuration has.
    """
    # In Klipper the search runs in a process beside the reactor; here there is neither.
    mathutil.background_coordinate_descent = lambda _, *search: mathutil.coordinate_descent(*search)
    if positions:
        config.fileconfig.add_section("delta_calibrate")
        config.fileconfig.set("delta_calibrate", "radius", "50")
    calibration = delta_calibrate.DeltaCalibrate(config.getsection("delta_calibrate"))
    if positions:
        calibration.probe_finalize((0.0, 0.0, 0.0), positions)
    else:
        calibration.do_extended_calibration()
    printer.saved.pop("delta_calibrate")
    return printer.saved


def main(asked):
    stepper.LookupMultiRail = stepper.PrinterRail = Rail
    parsed = configparser.RawConfigParser(strict=True, inline_comment_prefixes=(";", "#"))
    parsed.read_string(asked["config"])
    printer = Printer()
    config = configfile.ConfigWrapper(printer, parsed, {}, "printer")
    kind = {"delta": delta, "rotary_delta": rotary_delta}[config.get("kinematics")]
    printer.kinematics = kinematics = kind.load_kinematics(printer, config)
    # As after G28.
    kinematics.set_position(kinematics.home_position, (0, 1, 2))

    rails = kinematics.rails
    joints = [[r.calc_position_from_coord(p) for r in rails] for p in asked["positions"]]

    def position_of(steppers):
        return kinematics.calc_position(
            {r.get_name(): q for r, q in zip(rails, steppers, strict=True)}
        )

    probed = [position_of(q) for q in asked["probed"] or []]
    calibrated = calibrate(printer, config, probed) if probed or asked["extended"] else {}
    unread = [
        f"{section}.{key}"
        for section in parsed.sections()
        for key in parsed.options(section)
        if (section, key) not in config.access_tracking
    ]
    assert not unread, f"Klipper does not read {unread}"
    return {
        "home": kinematics.home_position,
        "home_joints": [r.calc_position_from_coord(kinematics.home_position) for r in rails],
        "joints": joints,
        "back": [position_of(q) for q in joints],
        "refused": [n for n, p in enumerate(asked["positions"]) if not allowed(kinematics, p)],
        "calibrated": calibrated,
        "steps": [r.get_step_dist() for r in rails],
    }


if __name__ == "__main__":
    answer = main(json.load(sys.stdin))
    assert all(math.isfinite(q) for row in answer["joints"] for q in row)
    json.dump(answer, sys.stdout)
