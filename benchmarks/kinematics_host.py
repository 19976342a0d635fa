"""LinuxCNC kinematics modules loaded into this process, without LinuxCNC.

`kinematics_host.c` answers the HAL calls that a module makes, so that the very `.so` that
halcompile makes runs unchanged: its public entry points, its pins and its functions.
"""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

SOURCE = Path(__file__).with_suffix(".c")
HEADERS = Path("/usr/include/linuxcnc")
PACKAGED = Path("/usr/lib/linuxcnc/modules")
NEEDED = "linuxcnc-uspace, linuxcnc-uspace-dev and gcc"

_FLAGS = ["-O2", "-shared", "-fPIC", "-DRTAPI", "-DUSPACE", f"-I{HEADERS}"]


def available() -> bool:
    """Whether the system has LinuxCNC's headers, halcompile and a C compiler."""
    return HEADERS.is_dir() and all(shutil.which(name) for name in ("halcompile", "gcc"))


def parameters_of(source: str) -> dict[str, str]:
    """With what an exported module is loaded: the hash that its INI and HAL file state."""
    found = re.search(r'#define HASH "(\w+)"', source)
    assert found
    return {"ini": found[1], "hal": found[1]}


def _program(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        raise FileNotFoundError(f"{name} is not installed")
    return path


def compiled(source: Path) -> Path:
    """The `.so` that halcompile makes of a module's source, beside it. Raises where it fails."""
    subprocess.run(
        [_program("halcompile"), "--compile", source.name],
        cwd=source.parent,
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    return source.with_suffix(".so")


class _EmcPose(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in "xyzabcuvw"]

    @classmethod
    def of(cls, pose: Sequence[float]) -> _EmcPose:
        return cls(*pose)


class Host:
    """The HAL of this process: pins, parameters and functions by their full names."""

    def __init__(self, folder: Path) -> None:
        """Compiles the host into `folder`."""
        library = folder / "kinematics_host.so"
        subprocess.run([_program("gcc"), *_FLAGS, str(SOURCE), "-o", str(library)], check=True)
        self._library = ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
        name = ctypes.c_char_p
        self._library.host_get.argtypes = [name]
        self._library.host_get.restype = ctypes.c_double
        self._library.host_set.argtypes = [name, ctypes.c_double]
        self._library.host_name.restype = name
        self._library.host_type.argtypes = [name]
        for call in ("host_connect", "host_disconnect"):
            getattr(self._library, call).argtypes = [name]
        self._library.host_run.argtypes = [name, ctypes.c_long]
        pose, number = ctypes.POINTER(_EmcPose), ctypes.c_int
        self._library.host_time_inverse.argtypes = [ctypes.c_void_p, pose, number]
        self._library.host_time_inverse.restype = ctypes.c_double
        joints = ctypes.POINTER(ctypes.c_double)
        self._library.host_time_forward.argtypes = [ctypes.c_void_p, joints, pose, number]
        self._library.host_time_forward.restype = ctypes.c_double

    @property
    def names(self) -> list[str]:
        """Of all pins and parameters."""
        count = self._library.host_items()
        return [self._library.host_name(number).decode() for number in range(count)]

    def get(self, name: str) -> float:
        """The value of a pin or parameter. Raises `KeyError`."""
        self._require(name)
        return float(self._library.host_get(name.encode()))

    def set(self, name: str, value: float) -> None:
        """Write a pin, its signal or a parameter."""
        self._require(name)
        self._library.host_set(name.encode(), value)

    def connect(self, name: str) -> None:
        """Connect a pin to a signal of its own."""
        self._require(name)
        assert self._library.host_connect(name.encode()) == 0, name

    def disconnect(self, name: str) -> None:
        """Take a pin off its signal."""
        self._require(name)
        assert self._library.host_disconnect(name.encode()) == 0, name

    def run(self, function: str, period: int = 1_000_000) -> None:
        """Call an exported function once, as a thread of that period, ns, does."""
        assert self._library.host_run(function.encode(), period) == 0, function

    def load(
        self, module: Path, n_joint: int, parameters: Mapping[str, str] | None = None
    ) -> Module:
        """Load a kinematics module with the parameters of its `loadrt`, and start it."""
        return Module(self._library, module, n_joint, parameters or {})

    def _require(self, name: str) -> None:
        if not self._library.host_type(name.encode()):
            raise KeyError(name)


@cache
def the_host() -> Host:
    """The host of this process: modules find the first that was loaded, so there is one only."""
    with tempfile.TemporaryDirectory() as folder:
        return Host(Path(folder))


class Module:
    """One module's public entry points. Poses are x y z a b c, in the module's units."""

    def __init__(
        self, host: ctypes.CDLL, path: Path, n_joint: int, parameters: Mapping[str, str]
    ) -> None:
        self._host = host
        self._library = ctypes.CDLL(str(path))
        self._n_joint = n_joint
        self._flags = (ctypes.c_ulong(), ctypes.c_ulong())
        self._parameters = {name: value.encode() for name, value in parameters.items()}
        for name, value in self._parameters.items():  # by the address that rtapi_app asks for
            place = ctypes.c_void_p.in_dll(self._library, f"rtapi_info_address_{name}").value
            assert place is not None
            ctypes.c_char_p.from_address(place).value = value
        if self._library.rtapi_app_main() != 0:
            raise OSError(f"{path.name} does not start")

    @property
    def kind(self) -> int:
        """What kinematicsType says; both ways are 4."""
        return int(self._library.kinematicsType())

    def inverse(self, pose: Sequence[float]) -> list[float] | None:
        """Joints of a pose; None where the module has none."""
        joints = (ctypes.c_double * 16)()
        given = _EmcPose.of(pose)
        first, second = (ctypes.byref(flags) for flags in self._flags)
        if self._library.kinematicsInverse(ctypes.byref(given), joints, first, second):
            return None
        return list(joints[: self._n_joint])

    def forward(self, joints: Sequence[float], start: Sequence[float]) -> list[float] | None:
        """The pose, nine numbers x y z a b c u v w, from a start; None without one."""
        given = (ctypes.c_double * 16)(*joints)
        pose = _EmcPose.of(start)
        first, second = (ctypes.byref(flags) for flags in self._flags)
        if self._library.kinematicsForward(given, ctypes.byref(pose), first, second):
            return None
        return [getattr(pose, name) for name in "xyzabcuvw"]

    def inverse_ns(self, pose: Sequence[float], count: int) -> float:
        """Processor time of one inverse, ns, over `count` of them."""
        given = _EmcPose.of(pose)
        call = ctypes.cast(self._library.kinematicsInverse, ctypes.c_void_p)
        return _timed(self._host.host_time_inverse(call, ctypes.byref(given), count))

    def forward_ns(self, joints: Sequence[float], start: Sequence[float], count: int) -> float:
        """Processor time of one forward solution from `start`, ns, over `count` of them."""
        given = (ctypes.c_double * 16)(*joints)
        pose = _EmcPose.of(start)
        call = ctypes.cast(self._library.kinematicsForward, ctypes.c_void_p)
        return _timed(self._host.host_time_forward(call, given, ctypes.byref(pose), count))


def _timed(nanoseconds: float) -> float:
    if nanoseconds < 0.0:
        raise RuntimeError("a call failed, so its time says nothing")
    return nanoseconds
