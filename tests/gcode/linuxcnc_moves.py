#!/usr/bin/python3
"""The moves of programs as LinuxCNC's own interpreter makes them, for tests to compare with.

Runs in the system's Python, whose `gcode` module comes with linuxcnc-uspace, and needs nothing of
this project: `linuxcnc_moves.py PARAMETERS < LIST > MOVES`, with a file of numbered parameters (the
offsets, in inches) that every program starts with, one path a line, and native doubles out.

Each program gives a row (number of moves, line of the error or 0), then its moves, each a row
(line, plane 17 18 19 of an arc or 0, 1 at feed, end X Y Z A B C U V W, centre on the plane's two
axes, turns): mm and degrees, machine coordinates. What it says of an error goes to stderr.
"""

import math
import os
import sys
import tempfile
from array import array
from pathlib import Path

import gcode

INCH = 25.4  # the module speaks inches, whatever the program does
PLANES = {1: (17, (0, 1, 2)), 2: (19, (1, 2, 0)), 3: (18, (2, 0, 1))}
LENGTHS = (0, 1, 2, 6, 7, 8)


class Canon:
    """What the interpreter calls for every canonical command."""

    def __init__(self, parameter_file):
        self.parameter_file = parameter_file
        self.line = 0
        self.plane = 1
        self.g5x = self.g92 = (0.0,) * 9
        self.turn = 0.0
        self.moves = []

    def get_tool(self, pocket):
        return (pocket,) + (0.0,) * 12 + (0,)

    def get_external_angular_units(self):
        return 1.0

    def get_external_length_units(self):
        return 1.0 / INCH

    def get_axis_mask(self):
        return 0x1FF

    def get_block_delete(self):
        return 0

    def next_line(self, state):
        self.line = state.sequence_number

    def check_abort(self):
        return False

    def set_plane(self, plane):
        self.plane = plane

    def set_g5x_offset(self, index, *offset):
        self.g5x = offset

    def set_g92_offset(self, *offset):
        self.g92 = offset

    def set_xy_rotation(self, angle):
        self.turn = math.radians(angle)

    def _turned(self, x, y):
        """X and Y after G92, turned: what the controller does before it adds the offset of G54."""
        sine, cosine = math.sin(self.turn), math.cos(self.turn)
        return (cosine * x - sine * y, sine * x + cosine * y) if self.turn else (x, y)

    def _end(self, position):
        end = [p + b for p, b in zip(position, self.g92, strict=True)]
        end[:2] = self._turned(*end[:2])
        end = [p + a for p, a in zip(end, self.g5x, strict=True)]
        for axis in LENGTHS:
            end[axis] *= INCH
        return end

    def straight_traverse(self, *position):
        self.moves.append([self.line, 0, 0, *self._end(position), 0, 0, 0])

    def straight_feed(self, *position):
        self.moves.append([self.line, 0, 1, *self._end(position), 0, 0, 0])

    def arc_feed(self, first, second, centre_first, centre_second, turns, third, *others):
        plane, axes = PLANES[self.plane]
        position = [0.0] * 3
        for axis, value in zip(axes, (first, second, third), strict=True):
            position[axis] = value
        middle = [0.0] * 9
        middle[axes[0]], middle[axes[1]] = centre_first, centre_second
        middle = self._end(middle)
        centre = [middle[axis] for axis in axes[:2]]
        self.moves.append([self.line, plane, 1, *self._end((*position, *others)), *centre, turns])

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *arguments: None


def main():
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # (PRINT, ...) prints
    parameters = Path(sys.argv[1]).read_bytes()
    folder = tempfile.TemporaryDirectory()
    parameter_file = Path(folder.name, "parameters")
    for path in sys.stdin.read().splitlines():
        parameter_file.write_bytes(parameters)  # the interpreter keeps its state there
        canon = Canon(str(parameter_file))
        result, line = gcode.parse(path, canon, "G21", "")
        failed = result > gcode.MIN_ERROR
        if failed:
            sys.stderr.write(f"{path}: {gcode.strerror(result)}\n")
        numbers = array("d", (len(canon.moves), line if failed else 0))
        for move in canon.moves:
            numbers.extend(move)
        out.write(numbers.tobytes())
        out.flush()  # what is known should the interpreter crash on the next one
    folder.cleanup()


if __name__ == "__main__":
    main()
