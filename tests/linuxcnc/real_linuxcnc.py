"""The real LinuxCNC, headless: an exported module in a throw-away configuration, driven by a plan.

It needs Debian's linuxcnc-uspace and linuxcnc-uspace-dev. As root every run has process, IPC,
network and mount namespaces of its own, in which the module lies among LinuxCNC's other modules, so
that nothing is installed and nothing can be left behind. Where namespaces are not to be had (a
container without the right to make any, which is one itself), the module is put there and removed.

LinuxCNC 2.9: rtapi_app does not run as root; `[EMC]VERSION` keeps it from asking; an NML file
without TCP keeps it from listening; RUNTESTS keeps its output where it can be read.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from system_package import missing

MODULES = Path("/usr/lib/linuxcnc/modules")
DRIVER = Path(__file__).with_name("driver.py")
NOBODY = 65534
SYSTEM_PATH = "/usr/sbin:/usr/bin:/sbin:/bin"
TIME_LIMIT = 100.0

Step = Mapping[str, Any]

_UNSHARE = [
    "unshare", "--pid", "--ipc", "--net", "--mount", "--fork", "--kill-child", "--mount-proc",
]  # fmt: skip

# In the namespaces: the run's folder at a place that every user may enter, /tmp empty, for
# LinuxCNC's lock file, and the module among the others in a copy of their folder.
_INSIDE = """set -e
mount --bind "$1" /mnt
mount -t tmpfs tmpfs /tmp
mkdir /tmp/modules
cp -a {modules}/. /mnt/modules/. /tmp/modules
mount --bind /tmp/modules {modules}
cd /mnt
exec setpriv --reuid {uid} --regid {uid} --clear-groups env HOME=/mnt linuxcnc /mnt/machine.ini
"""

_BUFFERS = {
    "emcCommand": (8192, 1), "emcStatus": (20480, 2), "emcError": (8192, 3),
    "toolCmd": (1024, 4), "toolSts": (1024, 5),
}  # fmt: skip
_PROCESSES = {
    "emc": "emcCommand:R:0:1.0:0:0 emcStatus:W:0:1.0:0:0 emcError:W:0:1.0:0:0 "
    "toolCmd:W:0:1.0:0:0 toolSts:R:0:1.0:0:0",
    "emcsvr": "emcCommand:W:1:1.0:1:2 emcStatus:R:1:1.0:1:2 emcError:R:1:1.0:1:2 "
    "toolCmd:W:1:1.0:1:2 toolSts:R:1:1.0:1:2",
    "tool": "emcError:W:0:1.0:0:3 toolCmd:R:0:1.0:0:3 toolSts:W:0:1.0:0:3",
    "xemc": "emcCommand:W:0:10.0:0:10 emcStatus:R:0:10.0:0:10 emcError:R:0:10.0:0:10",
}

_INI = """[EMC]
VERSION = 1.1
MACHINE = test
DEBUG = 0
NML_FILE = machine.nml
[DISPLAY]
DISPLAY = ./driver.py
[RS274NGC]
PARAMETER_FILE = machine.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 4.0
SERVO_PERIOD = 1000000
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[HAL]
HALFILE = {module}.hal
HALFILE = test.hal
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.1
TOOL_TABLE = machine.tbl
"""

# What the export leaves to the user, by section: the drives and the tool of a quick machine.
ANSWERS = {
    "TRAJ": {
        "MAX_LINEAR_VELOCITY": "400",
        "DEFAULT_LINEAR_VELOCITY": "50",
        "MAX_LINEAR_ACCELERATION": "2000",
    },
    "AXIS": {"MAX_VELOCITY": "400", "MAX_ACCELERATION": "2000"},
    "JOINT": {"MAX_VELOCITY": "3000", "MAX_ACCELERATION": "20000", "FERROR": "0.05"},
}
BESIDES = {
    "TRAJ": "DEFAULT_ANGULAR_VELOCITY = 20\nMAX_ANGULAR_VELOCITY = 60\n"
    "MAX_ANGULAR_ACCELERATION = 300\n",
    "JOINT": "MIN_FERROR = 0.05\nHOME_SEARCH_VEL = 0\nHOME_LATCH_VEL = 0\n",
}
DRIVE = {"maxv": 3000.0, "maxa": 20000.0}
"""mm/s and mm/s^2 that a simulated drive can do."""


@dataclass(frozen=True)
class Run:
    """What came of a plan: the driver's report, and what was sampled every servo cycle."""

    report: Mapping[str, Any]
    traces: Mapping[str, NDArray[np.float64]]

    def __getitem__(self, label: str) -> Any:
        return self.report["readings"][label]


def required() -> None:
    """Skip the test where LinuxCNC is missing; in CI, fail."""
    for name in ("linuxcnc", "halcompile", "gcc"):
        if shutil.which(name, path=SYSTEM_PATH) is None:
            missing(
                f"{name} is not installed: apt-get install --no-install-recommends "
                "linuxcnc-uspace linuxcnc-uspace-dev gcc"
            )
    if not (_namespaces() or os.access(MODULES, os.W_OK)):
        missing(f"neither namespaces nor {MODULES} are for this user: run the test as root")


def _namespaces() -> bool:
    return os.geteuid() == 0 and not subprocess.run([*_UNSHARE, "true"], check=False).returncode


def run(
    folder: Path,
    files: Mapping[str, str],
    steps: Sequence[Step],
    *,
    axes: str,
    joints: int,
    programs: Mapping[str, str] | None = None,
    hal: str = "",
    time_limit: float = TIME_LIMIT,
) -> Run:
    """Compile the exported module, start LinuxCNC with the exported snippets, and do the steps.

    `files` are those of the export; `hal` is added after the connections that every run has:
    `limit3` drives with finite speed and acceleration, and the sampler. `time_limit`, s, is that of
    the whole run. Fails with LinuxCNC's log.
    """
    module = next(name for name in files if name.endswith(".c")).removesuffix(".c")
    (folder / "modules").mkdir()
    for name, text in {**files, **(programs or {})}.items():
        (folder / name).write_text(text)
    subprocess.run(
        ["/usr/bin/halcompile", "--compile", f"{module}.c"],
        cwd=folder,
        check=True,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "PATH": SYSTEM_PATH},
    )
    (folder / f"{module}.so").rename(folder / "modules" / f"{module}.so")
    (folder / "machine.ini").write_text(
        _INI.format(module=module) + answered(files[f"{module}.ini"])
    )
    (folder / "machine.nml").write_text(_nml())
    (folder / "machine.tbl").write_text("T1 P1 D1 Z0\n")
    (folder / "test.hal").write_text(_hal(joints) + hal)
    plan = {"axes": axes, "joints": joints, "steps": list(steps)}
    (folder / "plan.json").write_text(json.dumps(plan))
    shutil.copy(DRIVER, folder)
    (folder / "driver.py").chmod(0o755)
    log = _linuxcnc(folder, module, time_limit)
    report = folder / "report.json"
    assert report.exists(), f"LinuxCNC did not come to its end:\n{log}"
    found = json.loads(report.read_text())
    assert found["failed"] is None, f"{found}\n{log}"
    assert log.endswith("(exit code 0)"), log
    return Run(found, {path.stem: _trace(path) for path in folder.glob("*.trace")})


def _trace(path: Path) -> NDArray[np.float64]:
    """(n_cycle, n_pin) what was sampled, without a cycle missing."""
    # The first line of a later halsampler: it missed what was not sampled between two of them.
    lines = path.read_text().removeprefix("overrun\n").splitlines()
    return np.array([[float(word) for word in line.split()] for line in lines])


def answered(ini: str) -> str:
    """The exported sections with everything filled in that the user is asked for."""
    lines = []
    section = ""
    for line in ini.splitlines():
        key = line.removeprefix("# ").removesuffix(" =")
        if line.startswith("["):
            section = line.strip("[]").partition("_")[0]
            lines += [line, BESIDES.get(section, "").rstrip("\n")]
        elif line == f"# {key} =":
            lines.append(f"{key} = {ANSWERS[section][key]}")
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"


def _hal(joints: int) -> str:
    names = [f"drive{number}" for number in range(joints)]
    lines = [
        f"loadrt sampler depth=16000 cfg={'f' * joints}b",
        f"loadrt limit3 names={','.join(names)}",
        "net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in",
        "net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared",
        "net change iocontrol.0.tool-change => iocontrol.0.tool-changed",
        "setp sampler.0.enable 0",
    ]
    for number, name in enumerate(names):
        lines += [
            f"addf {name} servo-thread",
            *(f"setp {name}.{key} {value}" for key, value in DRIVE.items()),
            f"net motor{number} joint.{number}.motor-pos-cmd => {name}.in",
            f"net back{number} {name}.out => joint.{number}.motor-pos-fb",
            f"net command{number} joint.{number}.pos-cmd => sampler.0.pin.{number}",
        ]
    lines += [f"net fault truepose.fault => sampler.0.pin.{joints}", "addf sampler.0 servo-thread"]
    return "\n".join(lines) + "\n"


def _nml() -> str:
    lines = []
    for name, (size, number) in _BUFFERS.items():
        wait = " confirm_write serial" if name == "emcCommand" else ""
        queue = " queue" if name in ("emcCommand", "emcError") else ""
        lines.append(
            f"B {name} SHMEM localhost {size} 0 0 {number} 16 {1000 + number} xdr{queue}{wait}"
        )
    for process, rows in _PROCESSES.items():
        for row in rows.split():
            lines.append(
                f"P {process} {row.split(':')[0]} LOCAL localhost {' '.join(row.split(':')[1:])}"
            )
    return "\n".join(lines) + "\n"


def _linuxcnc(folder: Path, module: str, time_limit: float) -> str:
    """Run LinuxCNC in the folder to its end, and return its log."""
    environment = {
        key: value
        for key, value in os.environ.items()
        if key not in ("DISPLAY", "WAYLAND_DISPLAY", "PYTHONPATH", "PYTHONHOME")
    } | {"PATH": SYSTEM_PATH, "LANG": "C", "RUNTESTS": "1"}
    if _namespaces():
        _give(folder)
        inside = _INSIDE.format(modules=MODULES, uid=NOBODY)
        command = [*_UNSHARE, "sh", "-c", inside, "sh", str(folder)]
        return _to_its_end(command, folder, environment, time_limit)
    with _alone(), _installed(folder, module) as place:
        environment["HOME"] = str(place)
        as_nobody = ["setpriv", "--reuid", str(NOBODY), "--regid", str(NOBODY), "--clear-groups"]
        start = ["linuxcnc", str(place / "machine.ini")]
        command = [*as_nobody, *start] if os.geteuid() == 0 else start
        return _to_its_end(command, place, environment, time_limit)


@contextmanager
def _alone() -> Iterator[None]:
    """No other worker runs LinuxCNC: without namespaces they would share its memory and modules."""
    with (Path(tempfile.gettempdir()) / "truepose-linuxcnc.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@contextmanager
def _installed(folder: Path, module: str) -> Iterator[Path]:
    """The folder where everybody may read it, and the module among LinuxCNC's own; then neither."""
    installed = MODULES / f"{module}.so"
    assert not installed.exists(), f"{installed} is there already, and is not this test's"
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary) / "run"
        shutil.copytree(folder, place)
        Path(temporary).chmod(0o755)
        if os.geteuid() == 0:
            _give(place)
        try:
            shutil.copy(folder / "modules" / installed.name, installed)
            yield place
        finally:
            installed.unlink(missing_ok=True)
            for name in [*place.glob("*.trace"), *place.glob("report.json")]:
                shutil.copy(name, folder)


def _give(folder: Path) -> None:
    """Let the user under whom LinuxCNC runs write there."""
    for path in [folder, *folder.rglob("*")]:
        os.chown(path, NOBODY, NOBODY)


def _to_its_end(
    command: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    time_limit: float = TIME_LIMIT,
) -> str:
    log = folder / "log.txt"
    with log.open("w") as output:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            process.wait(time_limit)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGTERM)  # LinuxCNC's script catches it and cleans up
            try:
                process.wait(15)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    text = log.read_text(errors="replace")
    return f"{text}\n(exit code {process.returncode})"


def in_namespaces(folder: Path, inside: str, *arguments: str) -> str | None:
    """The log of a shell script in namespaces of its own; None where there are none to be had.

    `inside` gets `folder`, whose files every user may then write, and the `arguments`.
    """
    if not _namespaces():
        return None
    _give(folder)
    command = [*_UNSHARE, "sh", "-c", inside, "sh", str(folder), *arguments]
    return _to_its_end(command, folder, {"PATH": SYSTEM_PATH, "LANG": "C"})
