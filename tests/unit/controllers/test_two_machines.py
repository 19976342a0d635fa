"""Exported C beside other C: two machines in one program, and flags that would undo its checks."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from built_once import built_once
from c_program import EXACT, STRICT, compiler
from machine_texts import PLANAR, load_text
from sweeps import thinned
from truepose.compensation.commands import ActualMachine
from truepose.controllers import export
from truepose.errors import RequestError
from truepose.machine import Machine

Floats = NDArray[np.float64]
POSES = 20
KELVIN = 8.0
"""By how much all parts are warmer than the reference temperature."""

FAST = ("-ffast-math", "-ffinite-math-only", "-Ofast")


def compile_and_run(files: Mapping[str, str], flags: tuple[str, ...], folder: Path) -> list[str]:
    """What a program of these files prints; every file with a C ending is compiled by itself."""
    sources = [name for name in files if name.endswith(".c")]
    gcc = compiler()
    command = [gcc, *STRICT, *flags]

    def build(scratch: Path) -> None:
        for name, text in files.items():
            (scratch / name).write_text(text)
        for name in sources:
            subprocess.run([*command, "-c", name], check=True, cwd=scratch)
        objects = [f"{name[:-2]}.o" for name in sources]
        subprocess.run([gcc, *objects, "-lm", "-o", "program"], check=True, cwd=scratch)

    program = built_once(folder, [*command, *files, *files.values()], build) / "program"
    return subprocess.run([program], check=True, capture_output=True, text=True).stdout.split()


def of_the_same_name(folder: Path, stem: str) -> Machine:
    """A machine of the library from a file that is called as others are: `machine.toml`."""
    folder.mkdir()
    path = folder / "machine.toml"
    path.write_text((MACHINES / f"{stem}.toml").read_text(encoding="utf-8"), encoding="utf-8")
    return tp.load(path)


def asked(machine: Machine) -> Floats:
    """(n, 6) poses of the workspace, SI; what is not commanded is 0."""
    poses = np.random.default_rng(4).permutation(machine.poses())[:POSES]
    full = np.zeros((len(poses), 6))
    full[:, ["xyzabc".index(name) for name in machine.commanded]] = poses
    return full


def truth(machine: Machine, poses: Floats) -> tuple[Floats, Floats]:
    """Nominal and compensated joints, (n, n_joint), of the library, warm and without a load."""
    warm = machine.condition.replace(
        temperature=machine.condition.reference_temperature + KELVIN,
        force=[0.0] * 3,
        moment=[0.0] * 3,
    )
    commanded = poses[:, ["xyzabc".index(name) for name in machine.commanded]]
    actual = ActualMachine(machine, warm)
    command = actual.command(actual.deviations_at(commanded))
    assert not command.status.any()
    return machine.inverse(commanded), command.joints


def program_part(prefix: str, poses: Floats) -> str:
    """A C function `PREFIX_all` that prints nominal and compensated joints at `poses`."""
    rows = ",\n".join("{" + ", ".join(repr(float(v)) for v in row) + "}" for row in poses)
    return f"""
static void {prefix}_all(void)
{{
    static const double pose[{len(poses)}][6] = {{ {rows} }};
    double warm[{prefix.upper()}_TEMPERATURES + 1], wrench[6] = {{ 0.0 }};
    double nominal[{prefix.upper()}_JOINTS], joints[{prefix.upper()}_JOINTS];
    {prefix}_machine machine;
    int i, k;
    {prefix}_init(&machine);
    for (k = 0; k < {prefix.upper()}_TEMPERATURES; k++)
        warm[k] = machine.reference_temperature + {KELVIN!r};
    for (i = 0; i < {len(poses)}; i++) {{
        if ({prefix}_inverse(&machine, pose[i], nominal) != {prefix.upper()}_OK)
            continue;
        if ({prefix}_compensate(&machine, pose[i], warm, wrench, joints) != {prefix.upper()}_OK)
            continue;
        for (k = 0; k < {prefix.upper()}_JOINTS; k++)
            printf("%.17g %.17g\\n", nominal[k], joints[k]);
    }}
}}
"""


def test_two_machines_of_one_name_in_one_program(tmp_path: Path, builds: Path) -> None:
    machines = {
        "left": of_the_same_name(tmp_path / "a", "hexapod"),
        "right_2": of_the_same_name(tmp_path / "b", "rotary_delta"),
    }
    files: dict[str, str] = {}
    main = "#include <stdio.h>\n"
    for prefix, machine in machines.items():
        exported = export(machine, "c", [f"prefix={prefix}"]).files
        assert set(exported) == {f"{prefix}.h", f"{prefix}.c"}
        assert not set(files) & set(exported)
        files |= exported
        main += f'#include "{prefix}.h"\n' + program_part(prefix, asked(machine))
    calls = "".join(f"    {prefix}_all();\n" for prefix in machines)
    files["main.c"] = main + f"int main(void)\n{{\n{calls}    return 0;\n}}\n"

    printed = np.array([float(word) for word in compile_and_run(files, EXACT, builds)])
    for machine in machines.values():
        nominal, compensated = truth(machine, asked(machine))
        count = 2 * nominal.size
        found, printed = printed[:count].reshape(*nominal.shape, 2), printed[count:]
        size = np.abs(nominal).max()
        assert np.abs(found[..., 0] - nominal).max() <= 1e-12 * size
        assert np.abs(found[..., 1] - compensated).max() <= 1e-12 * size
        assert np.abs(compensated - nominal).max() > 1e-6
    assert printed.size == 0


def test_the_prefix_is_of_every_name() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    for text in export(machine, "c", ["prefix=left"]).files.values():
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        assert "planar_two_slider" not in code.lower()
        for name in re.findall(r"^(?:static )?(?:\w+ )+(\w+)\(", code, re.MULTILINE):
            assert name.startswith("left_")
        for name in re.findall(r"^#define (\w+)", code, re.MULTILINE):
            assert name.startswith("LEFT_")


@pytest.mark.parametrize("controller", ["c", "linuxcnc"])
@pytest.mark.parametrize(
    "prefix", ["Left", "2nd", "_left", "le-ft", "left.x", "lé", "a b", "x" * 25, "left\n"]
)
def test_a_prefix_that_begins_no_name(controller: str, prefix: str, tmp_path: Path) -> None:
    with pytest.raises(RequestError) as refused:
        export(load_text(tmp_path, PLANAR), controller, {"prefix": prefix})
    (problem,) = refused.value.problems
    assert problem.code == "bad-option"
    assert "prefix" in problem.message
    assert str(problem.found) in (repr(prefix), f"{len(prefix)} characters")


def test_a_prefix_as_a_header_of_c(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="header of C"):
        export(load_text(tmp_path, PLANAR), "c", {"prefix": "math"})


def test_the_longest_prefix(tmp_path: Path, builds: Path) -> None:
    machine, prefix = load_text(tmp_path, PLANAR), "l" * 24
    files = dict(export(machine, "c", {"prefix": prefix}).files)
    poses = asked(machine)
    call = program_part(prefix, poses)
    main = f'#include <stdio.h>\n#include "{prefix}.h"\n{call}'
    files["main.c"] = main + f"int main(void)\n{{\n    {prefix}_all();\n    return 0;\n}}\n"
    assert len(compile_and_run(files, EXACT, builds)) == 2 * len(poses) * len(machine.joints)


@pytest.mark.parametrize("flag", thinned(FAST))
def test_flags_that_leave_out_checks_are_refused(flag: str, tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    for name, text in export(machine, "c", ["prefix=left"]).files.items():
        (tmp_path / name).write_text(text)

    def compiled_with(*flags: str) -> subprocess.CompletedProcess[str]:
        command = [compiler(), "-std=c99", "-O2", *flags, "-c", "left.c", "-o", "left.o"]
        return subprocess.run(command, check=False, capture_output=True, text=True, cwd=tmp_path)

    assert compiled_with().returncode == 0
    assert compiled_with(flag, "-fno-finite-math-only").returncode == 0
    refused = compiled_with(flag)
    assert refused.returncode != 0
    assert (
        "this source checks for numbers that are none: compile without -ffast-math"
        in refused.stderr
    )
    assert not compiled_with().returncode


def test_the_linuxcnc_module_refuses_them_too(tmp_path: Path) -> None:
    texts = export(load_text(tmp_path, PLANAR), "linuxcnc").files
    (module,) = [text for name, text in texts.items() if name.endswith(".c")]
    check = module.index("#if (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)")
    assert module.index("#error", check) < module.index(
        "pkm_inverse(const pkm_machine *machine", check
    )


def _hash_of(module: str) -> str:
    found = re.search(r'#define HASH "(\w+)"', module)
    assert found
    return found[1]


def test_pins_and_module_of_linuxcnc(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    stem = Path(machine.file).stem
    plain = export(machine, "linuxcnc").files
    files = export(machine, "linuxcnc", ["prefix=left"]).files
    assert set(files) == {name.replace("truepose_", "left_") for name in plain}
    assert set(files) == {f"left_{stem}.{ending}" for ending in ("c", "ini", "hal")}
    assert f'hal_init("left_{stem}")' in files[f"left_{stem}.c"]
    own, other = _hash_of(files[f"left_{stem}.c"]), _hash_of(plain[f"truepose_{stem}.c"])
    assert own != other
    assert f"KINEMATICS = left_{stem} ini={own}\n" in files[f"left_{stem}.ini"]
    for name, text in files.items():
        assert not re.search(r"truepose[.-]\w", text), name
        as_ever = plain[name.replace("left_", "truepose_")]
        renamed = re.sub(rf"truepose(?=[.-]|_{stem})", "left", as_ever)
        # Another export, and so another hash.
        assert text == renamed.replace(other, own)
    pins = "".join(text for name, text in files.items() if not name.endswith("ini"))
    assert re.search(r"\bleft\.update\b", pins)
    assert re.search(r"\bleft\.strut-0-temperature\b", pins)
