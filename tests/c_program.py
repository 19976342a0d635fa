"""Build a machine's exported C and run it on many poses at once."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from built_once import built_once
from system_package import missing
from truepose.controllers.c import Program

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
"""What the exported C promises to compile with."""

EXACT = ("-O2", "-ffp-contract=off")
FUSED = ("-O2", "-march=haswell", "-ffp-contract=fast")

_DRIVER = """
void drive(long n, const double *poses, const double *starts, const double *temperatures,
    const double *wrench, double *nominal, double *joints, int *status, double *back,
    int *steps, int *found);
void drive(long n, const double *poses, const double *starts, const double *temperatures,
    const double *wrench, double *nominal, double *joints, int *status, double *back,
    int *steps, int *found)
{
    @p@_machine machine;
    long i;
    int k;
    @p@_init(&machine);
    for (i = 0; i < n; i++) {
        double *q = nominal + i * @P@_JOINTS, *pose = back + 6 * i, alone[@P@_JOINTS];
        int same;
        status[i] = (int)@p@_compensate_from(&machine, poses + 6 * i, temperatures, wrench, q,
            joints + i * @P@_JOINTS);
        same = (int)@p@_inverse(&machine, poses + 6 * i, alone);
        for (k = 0; k < @P@_JOINTS && same <= (int)@P@_JOINT_LIMIT
            && status[i] <= (int)@P@_JOINT_LIMIT; k++)
            if (!(alone[k] - q[k] < 1e-12 && q[k] - alone[k] < 1e-12))
                status[i] = -1;
        for (k = 0; k < 6; k++)
            pose[k] = starts[6 * i + k];
        found[i] = -2;
        if (status[i] <= (int)@P@_JOINT_LIMIT)
            found[i] = (int)@p@_forward(&machine, q, pose, steps + i);
    }
}
"""


def compiler(name: str = "gcc") -> str:
    """The path of a compiler, or the test is skipped (in CI: fails)."""
    found = shutil.which(name)
    return found if found is not None else missing(f"no {name} on this system")


def compiled(
    program: Program,
    folder: Path,
    flags: Sequence[str],
    *,
    more: str = "",
    to: str = "shared",
    by: str = "gcc",
) -> Path:
    """The program compiled with the strict flags and `flags`; `more` is C that comes after it.

    Once a run: `folder` is the fixture `builds`.
    """
    kind = {"shared": ["-shared", "-fPIC"], "object": ["-c"]}[to]
    files = {f"{program.prefix}.h": program.header, f"{program.prefix}.c": program.source + more}
    source, target = f"{program.prefix}.c", f"{program.prefix}.{to}"
    command = [compiler(by), *STRICT, *flags, *kind, source, "-o", target, "-lm"]

    def build(scratch: Path) -> None:
        for name, text in files.items():
            (scratch / name).write_text(text)
        done = subprocess.run(command, check=False, capture_output=True, text=True, cwd=scratch)
        assert done.returncode == 0, done.stderr

    return built_once(folder, [*command, *files.values()], build) / target


@dataclass(frozen=True)
class Answers:
    """What the C gives at n poses: joints (n, n_joint), poses back (n, 6), steps and statuses."""

    nominal: NDArray[np.float64]
    joints: NDArray[np.float64]
    status: NDArray[np.int32]
    back: NDArray[np.float64]
    steps: NDArray[np.int32]
    found: NDArray[np.int32]


Run = Callable[..., Answers]


def driver(program: Program, folder: Path, flags: Sequence[str]) -> Run:
    """A function (poses, starts, temperatures, wrench) of the compiled program.

    Inverse, compensated joints and the forward solution from `starts`; both (n, 6), SI.
    """
    more = _DRIVER.replace("@p@", program.prefix).replace("@P@", program.prefix.upper())
    library = ctypes.CDLL(str(compiled(program, folder, flags, more=more)))
    count = len(program.joints)

    def run_at(
        poses: NDArray[np.float64],
        starts: NDArray[np.float64],
        temperatures: NDArray[np.float64],
        wrench: NDArray[np.float64],
    ) -> Answers:
        n = len(poses)
        given = [np.ascontiguousarray(a, np.float64) for a in (poses, starts, temperatures, wrench)]
        answers = Answers(
            np.full((n, count), np.nan),
            np.full((n, count), np.nan),
            np.zeros(n, np.int32),
            np.full((n, 6), np.nan),
            np.zeros(n, np.int32),
            np.zeros(n, np.int32),
        )
        arrays = [*given, *vars(answers).values()]
        library.drive(ctypes.c_long(n), *(a.ctypes.data_as(ctypes.c_void_p) for a in arrays))
        return answers

    return run_at
