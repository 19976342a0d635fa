"""Put the formulas of a machine and the templates together into one C program."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from truepose.controllers._template import fill, template
from truepose.controllers.c._known_shifts import KnownShifts, known_shifts
from truepose.machine import Machine
from truepose.version import version

MOST_STEPS = 1000
"""Steps of a forward solution, before it gives up."""

SINGULAR = 1e-6
"""Smallest singular value of a pose that holds, relative to the largest, as in the kernel."""

OWN_STACK = 8192
"""Bytes of stack that the templates' own variables take, in all their functions together."""

_FREEDOMS = "xyzabc"

HEADERS = ("assert", "complex", "errno", "fenv", "float", "limits", "math", "stdint", "tgmath")
"""C's own headers that a file of the same name would hide from a program or from math.h."""

_ACTING = " || ".join(f"wrench[{k}] != 0.0" for k in range(6))


@dataclass(frozen=True)
class Program:
    """A machine in C.

    `prefix` begins every name; `temperature_parts` are the parts whose temperature counts, in the
    order of the C function's argument; `left_out` the sources that are not in it.
    """

    prefix: str
    header: str
    source: str
    joints: tuple[str, ...]
    temperature_parts: tuple[str, ...]
    wrench_matters: bool
    left_out: tuple[str, ...]
    most_steps: int = MOST_STEPS

    @property
    def in_one(self) -> str:
        """Header and source in one text, to stand inside another C file."""
        return self.header + self.source.replace(f'#include "{self.prefix}.h"\n', "")

    @property
    def statement(self) -> tuple[str, ...]:
        """What the user must know."""
        lines = []
        if self.left_out:
            lines.append(f"left out, and not compensated: {', '.join(self.left_out)}")
        if not self.wrench_matters:
            lines.append("the wrench has no effect")
        if not self.temperature_parts:
            lines.append("temperatures have no effect")
        return tuple(lines)


def program_of(machine: Machine, prefix: str | None = None, without: Sequence[str] = ()) -> Program:
    """The C program of a machine; `prefix` is by default the machine file's name.

    Raises `RequestError` as `known_shifts`.
    """
    return _Writer(machine, prefix or _name_of(machine), known_shifts(machine, without)).program()


def _name_of(machine: Machine) -> str:
    """The machine file's name as a C identifier."""
    name = re.sub(r"\W", "_", Path(machine.file).stem, flags=re.ASCII).lower()
    usual = re.match(r"[a-z]", name) and name not in HEADERS
    return name if usual else f"machine_{name}"


class _Writer:
    """Fills the templates for one machine."""

    def __init__(self, machine: Machine, prefix: str, known: KnownShifts) -> None:
        self.machine, self.prefix, self.known = machine, prefix, known
        self.control: dict[str, Any] = machine.kernel.control
        self.parts = [part for part, terms in known.per_kelvin.items() if terms]
        loaded = {term.parameter for term in known.compliance}
        loaded |= {parameter for *pair, _ in known.shared for parameter in pair}
        loaded |= set(machine.kernel.limb_parameters) if known.limbs else set()
        self.compliant = len(loaded)
        self.functions = machine.kernel.c_functions(
            list(map(astuple, known.at_reference)),
            [list(map(astuple, known.per_kelvin[part])) for part in self.parts],
            list(map(astuple, known.compliance)),
            list(known.shared),
            known.limbs,
        )
        self.strained = "compliance" in self.functions
        commanded, dof = self.control["commanded"], self.control["dof"]
        self.parasitic = [k for k in range(6) if dof[k] and not commanded[k]]
        self.by_angle = any(commanded[3:]) and any(k > 2 for k in self.parasitic)
        self.straight = "compensated" in self.functions and not any(self.control["turns"])

    def program(self) -> Program:
        """Header and source."""
        pieces = ["linear", "joints"]
        if self.strained:
            pieces += ["strained"]
            pieces += ["strained_loads"] if self.compliant else []
        else:
            pieces += ["parasitic" if self.parasitic else "direct", "forward"]
            pieces += ["loads"] if self.compliant else []
        pieces += ["compensate"]
        source = "\n".join(
            [
                f'#include "{self.prefix}.h"\n#include <math.h>\n',
                self._filled("arithmetic"),
                self._tables(),
                *(self._function(name) for name in self._needed()),
                *(self._filled(piece) for piece in pieces),
            ]
        )
        return Program(
            self.prefix,
            self._filled("machine", ".h.in"),
            source,
            self.machine.joints,
            tuple(self.parts),
            self.compliant > 0,
            self.known.left_out,
        )

    def _filled(self, piece: str, ending: str = ".c.in") -> str:
        """A template with its places filled: `@name@`."""
        text = template(__package__, piece + ending)
        if piece == "linear" and (self.strained or not self.parasitic):
            text = _without_function(text, "regular")
        if piece == "linear" and (self.strained or not self.compliant):
            text = _without_function(text, "solve_transposed")
        return fill(text, self._places)

    def _needed(self) -> list[str]:
        """The formulas that the templates call."""
        return [
            name
            for name in self.functions
            if {
                "load": bool(self.compliant),
                "angle_axes": self.by_angle and not self.strained,
                "angle_rates": self.strained,
                "squared": not self.strained,
                "place": not self.strained,
                "compensated": self.straight,
            }.get(name, True)
        ]

    def _function(self, name: str) -> str:
        arguments, body, _ = self.functions[name]
        taken = [
            re.sub(r"\W", "", words.split()[-1].partition("[")[0])
            for words in arguments.split(", ")
        ]
        unused = [word for word in taken if not re.search(rf"\b{word}\[", body)]
        notes = "".join(f"    (void){word};\n" for word in unused)
        return f"static void {self.prefix}_{name}({arguments})\n{{\n{body}{notes}}}\n"

    @cached_property
    def _places(self) -> dict[str, str]:
        machine, control = self.machine, self.control
        count = control["closures"]
        stack = sum(8 * values for *_, values in self.functions.values()) + OWN_STACK
        stack += 16 * len(machine.parameters) + 56 * len(machine.struts)
        return {
            "p": self.prefix,
            "P": self.prefix.upper(),
            "title": _in_comment(machine.name),
            "version": version(),
            "file": _in_comment(Path(machine.file).name),
            "changed": "".join(
                f",\n * with {_in_comment(f'{key} = {value}')}"
                for key, value in (*machine.settings.items(), *machine.replaced.items())
            ),
            "hash": machine.file_hash,
            "commanded": " ".join(machine.commanded),
            "stack": str(stack),
            "joints": _lines(self._joint_lines()),
            "temperatures": _lines(self._temperature_lines()),
            "known": _lines(self._known_lines()),
            "n_joint": str(len(machine.joints)),
            "n_parameter": str(len(machine.parameters)),
            "n_temperature": str(len(self.parts)),
            "n_temperature_room": str(max(len(self.parts), 1)),
            "temperature_macros": "\n".join(
                f"#define {self.prefix.upper()}_TEMPERATURE_{word} {number}"
                for number, word in enumerate(_words(self.parts))
            ),
            "most_steps": str(MOST_STEPS),
            "SINGULAR": repr(SINGULAR),
            "LENGTH": repr(machine.characteristic_length),
            "STRUTS": str(len(machine.struts)),
            "CLOSURES": str(count),
            "ROWS": str(max(count, 6)),
            "CARRYING": str(len(control["carrying"])),
            "FREEDOMS": str(sum(control["dof"])),
            "PARASITIC": str(len(self.parasitic)),
            "parasitic": ", ".join(_FREEDOMS[k] for k in self.parasitic),
            "held_rows": self._held_rows("row"),
            "held_of_factors": self._held_rows("f.m"),
            "LOADED": str(max(self.compliant, 1)),
            "proven": self._proven(),
            "turns": self._turns(),
            "leaning": self._leaning(),
            "before_system": self._before_system(),
            "columns": self._columns(),
            "apply": self._apply(),
            "rise": self._rise(),
            "find_loads": self._find_loads(),
            "of_pose": "placed.at, placed.r, " if self.known.limbs else "",
            "straight": self._straight() if self.straight else "",
            "parameters": "\n".join(
                f"        {value!r}, /* {_in_comment(name)} */"
                for name, value in zip(machine.parameters, machine.nominal.tolist(), strict=True)
            ),
            "reference_temperature": repr(machine.condition.reference_temperature),
        }

    # ---- what the header says ----

    def _joint_lines(self) -> Iterable[str]:
        yield "Joints:"
        for number, name in enumerate(self.machine.joints):
            low, high = self.control["travel"][number]
            unit = "rad" if self.control["turns"][number] else "m"
            yield f"  {number}  {_in_comment(name)}, {unit}, travel {low!r} to {high!r}"

    def _temperature_lines(self) -> Iterable[str]:
        yield "Temperatures:" if self.parts else "Temperatures have no effect."
        for number, part in enumerate(self.parts):
            yield f"  {number}  {_in_comment(part)}"

    def _known_lines(self) -> Iterable[str]:
        if not self.compliant:
            yield "The wrench has no effect."
        if self.known.left_out:
            yield f"Left out, and not compensated: {', '.join(self.known.left_out)}."
        yield "Loads are those of the nominal machine at the pose asked for."
        if self.machine.calibration is not None:
            yield "Compensated joints hold the calibrated geometry: programs that are corrected as"
            yield "well are corrected twice."

    # ---- tables and pieces of code ----

    def _tables(self) -> str:
        control, p = self.control, self.prefix
        freedoms = [k for k in range(6) if control["dof"][k]]
        tables = [
            _table("double", f"{p}_home[6]", [repr(float(v)) for v in control["home"]]),
            _table("int", f"{p}_moves[6]", map(_flag, control["dof"])),
            _table("int", f"{p}_commanded[6]", map(_flag, control["commanded"])),
            _table("int", f"{p}_freedom[{len(freedoms)}]", map(str, freedoms)),
            _table(
                "double",
                f"{p}_travel[{len(control['travel'])}][2]",
                [f"{{{low!r}, {high!r}}}" for low, high in control["travel"]],
            ),
        ]
        if self.parasitic or self.strained:
            drives = [-1 if d is None else d for d in control["strut_drive"]]
            drives += [-1] * (control["closures"] - len(drives))
            length = repr(self.machine.characteristic_length)
            lengths = [length if turns else "1.0" for turns in control["turns"]]
            count = len(control["travel"])
            tables += [
                _table("int", f"{p}_drive[{len(drives)}]", map(str, drives)),
                _table("double", f"{p}_joint_length[{count}]", lengths),
            ]
        if self.strained:
            asked = [k for k in range(6) if control["commanded"][k]]
            carrying = control["carrying"]
            tables += [
                _table("int", f"{p}_asked[{len(asked)}]", map(str, asked)),
                _table("int", f"{p}_carrying[{len(carrying)}]", map(str, carrying)),
            ]
        elif self.parasitic:
            first = [struts[0] for struts in control["strut_drives"]]
            tables.append(_table("int", f"{p}_strut[{len(first)}]", map(str, first)))
        return "\n".join(tables)

    def _held_rows(self, row: str) -> str:
        """Identity rows of what the frame holds, after the closures'."""
        count = self.control["closures"]
        held = [k for k in range(6) if not self.control["dof"][k]]
        lines = []
        for number, freedom in enumerate(held, count):
            lines += [
                "    for (k = 0; k < 6; k++)",
                f"        {row}[{number}][k] = k == {freedom} ? 1.0 : 0.0;",
            ]
            if row == "row":
                lines.append(f"    residual[{number}] = 0.0;")
        return "\n".join(lines)

    def _proven(self) -> str:
        """A cheap proof that a pose holds, where all closures are struts between plain joints."""
        plain = self.control["closures"] == len(self.machine.struts) and not any(
            name.endswith("ring_radius") for name in self.machine.parameters
        )
        if not plain:
            return "    (void)limb;\n    (void)determinant;"
        count, length = self.control["closures"], self.machine.characteristic_length
        asked = 2.0 * SINGULAR * self.control["regularity_scale"]
        return f"""    {{
        /* A lower bound of the smallest singular value, by determinant and Frobenius norm. */
        double asked = {asked!r}, square = {float(count)!r};
        for (i = 0; i < {count}; i++) {{
            for (j = 3; j < 6; j++)
                square += limb[7 * i + j] * limb[7 * i + j] / {length * length!r};
            asked *= limb[7 * i + 6];
        }}
        if (fabs(determinant) > asked * pow(square, {0.5 * count!r}))
            return 1;
    }}"""

    def _leaning(self) -> str:
        """How far struts lean at joints that have a limit."""
        count, p, P = self.control["joint_limits"], self.prefix, self.prefix.upper()
        if not count:
            return "    (void)p;\n    (void)placed;"
        return f"""    {{
        double beyond[{count}];
        {p}_lean(p, joints, placed->at, placed->r, beyond);
        for (k = 0; k < {count}; k++)
            if (!(beyond[k] <= 0.0))
                return {P}_JOINT_LIMIT;
    }}"""

    def _turns(self) -> str:
        """An angle is moved by whole turns to the one nearest mid-travel."""
        lines = []
        for number, turns in enumerate(self.control["turns"]):
            if not turns:
                continue
            low, high = self.control["travel"][number]
            scale = self.control["scale"][number]
            divided = "" if scale is None else f" / p[{scale}]"
            middle = repr(0.5 * (low + high))
            lines += [
                "    {",
                f"        const double turn = 6.283185307179586{divided};",
                f"        joints[{number}] += turn * round(({middle} - joints[{number}]) / turn);",
                "    }",
            ]
        return "\n".join(lines)

    def _before_system(self) -> str:
        if not self.by_angle:
            return ""
        return f"""        double angle[3], axis[9];
        {self.prefix}_angles(now.r, angle);
        {self.prefix}_angle_axes(angle, axis);"""

    def _columns(self) -> str:
        """A closure's derivatives to the parasitic freedoms."""
        length = repr(self.machine.characteristic_length)
        lines = []
        for column, freedom in enumerate(self.parasitic):
            if freedom < 3:
                value = f"row[i][{freedom}]"
            elif self.by_angle:
                terms = (f"row[i][{3 + k}] * axis[{3 * (freedom - 3) + k}]" for k in range(3))
                value = f"({' + '.join(terms)}) / {length}"
            else:
                value = f"row[i][{freedom}] / {length}"
            lines.append(f"            system[i][{column}] = {value};")
        return "\n".join(lines)

    def _apply(self) -> str:
        """The step of the parasitic freedoms."""
        length = repr(self.machine.characteristic_length)
        lines = []
        for column, freedom in enumerate(self.parasitic):
            if freedom < 3:
                lines.append(f"        twist[{freedom}] = step[{column}];")
            elif self.by_angle:
                lines.append(f"        angle[{freedom - 3}] += step[{column}] / {length};")
            else:
                lines.append(f"        twist[{freedom}] = step[{column}] / {length};")
        if self.by_angle:
            lines.append(f"        {self.prefix}_attitude(angle, now.u);")
        return "\n".join(lines)

    def _rise(self) -> str:
        if not self.parts:
            return "    (void)temperatures;\n    rise[0] = 0.0;"
        return f"""    for (k = 0; k < {self.prefix.upper()}_TEMPERATURES; k++)
        rise[k] = temperatures[k] - machine->reference_temperature;"""

    def _find_loads(self) -> str:
        if not self.compliant:
            return "    (void)wrench;"
        return f"""    if ({_ACTING})
        {self.prefix}_loads(machine->parameter, q, &placed, wrench, load);"""

    def _straight(self) -> str:
        """Both joints in one go, unless the order of elimination does not serve at the pose."""
        p, P = self.prefix, self.prefix.upper()
        return f"""    if ({_ACTING}) {{
        double margin[{P}_JOINTS], left[{P}_JOINTS], found[{P}_JOINTS], growth;
        {p}_compensated(machine->parameter, placed.at, placed.r, rise, wrench, q, margin, found,
            left, &growth);
        if (growth < 100.0) {{
            double checked[{P}_JOINTS];
            status = {p}_judged(machine->parameter, &placed, {p}_least(margin), q, checked);
            if (status > {P}_JOINT_LIMIT)
                return status;
            status = {p}_judged(machine->parameter, &placed, {p}_least(left), found, joints);
            for (k = 0; k < {P}_JOINTS && status <= {P}_JOINT_LIMIT; k++)
                nominal[k] = q[k];
            return status;
        }}
    }}"""


def _without_function(text: str, name: str) -> str:
    """A template without one function and the comment before it."""
    pieces = re.split(r"(?m)^(?=/\*)", text)
    return "".join(piece for piece in pieces if f"@p@_{name}(" not in piece)


def _table(kind: str, name: str, values: Iterable[str]) -> str:
    return f"static const {kind} {name} = {{{', '.join(values)}}};"


def _flag(value: bool) -> str:
    return "1" if value else "0"


def _in_comment(text: str) -> str:
    """Text that may stand in a C comment."""
    for broken in ("*/", "/*", "??"):
        text = text.replace(broken, " ".join(broken))
    return " ".join(text.split())


def _words(parts: Sequence[str]) -> list[str]:
    """Parts as words of macros, each once: `STRUT_1`, and `STRUT_1_2` for one that is alike."""
    words: list[str] = []
    for part in parts:
        word = plain = re.sub(r"\W", "_", part, flags=re.ASCII).upper()
        number = 1
        while word in words:
            number += 1
            word = f"{plain}_{number}"
        words.append(word)
    return words


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(f" * {line}" for line in lines)


__all__ = ["Program", "program_of"]
