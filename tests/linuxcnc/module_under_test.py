"""An exported module, compiled by halcompile and loaded into this process, in the user's units."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

import truepose as tp
from benchmarks.kinematics_host import NEEDED, available, compiled, parameters_of, the_host
from system_package import missing
from truepose.controllers._export import options_of
from truepose.controllers.linuxcnc import LinuxCNC
from truepose.machine import Machine

Floats = NDArray[np.float64]

CYCLE = 1_000_000
"""ns of a servo cycle."""
DEGREE = np.pi / 180.0


@cache
def _folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="truepose-modules-"))


@cache
def _source(file: Path, options: tuple[tuple[str, str], ...]) -> str:
    return exported(tp.load(file), **dict(options))["c"]


@cache
def _compiled(text: str) -> Path:
    place = Path(tempfile.mkdtemp(dir=_folder()))
    source = place / "kins.c"
    source.write_text(text)
    return compiled(source)


def clean() -> None:
    """Remove what was compiled."""
    if _folder.cache_info().currsize:
        shutil.rmtree(_folder())


def exported(machine: Machine, **options: str) -> Mapping[str, str]:
    """The files of the export by their endings."""
    files = LinuxCNC.export(machine, options_of(LinuxCNC, machine, options)).files
    return {name.rpartition(".")[2]: text for name, text in files.items()}


class Rig:
    """A freshly started module of a machine. Poses and joints in mm and degrees, as LinuxCNC's."""

    def __init__(
        self, file: Path, change: Callable[[str], str] = lambda text: text, **options: str
    ) -> None:
        """Skips the test without LinuxCNC's headers. `change` edits the module's C."""
        if not available():
            missing(f"no LinuxCNC headers: apt-get install --no-install-recommends {NEEDED}")
        self.machine = tp.load(file)
        source = change(_source(file, tuple(options.items())))
        library = _compiled(source)
        # A copy is another library to the loader: with a state of its own.
        copy = Path(tempfile.mkdtemp(dir=_folder())) / "kins.so"
        shutil.copy(library, copy)
        self.host = the_host()
        self.module = self.host.load(copy, len(self.machine.joints), parameters_of(source))
        self.columns = ["xyzabc".index(name) for name in self.machine.commanded]
        self.units = np.where(np.array(self.columns) < 3, 1e-3, DEGREE)
        turning = [drive.coordinate == "angle" for drive in self.machine.drives]
        self.joint_units = np.where(turning, DEGREE, 1e-3)
        self.parts = {
            f"truepose.{family}-{number}-temperature": f"{family}.{row.name}"
            for family, rows in (
                ("strut", self.machine.struts),
                ("drive", self.machine.drives),
                ("carriage", self.machine.drives),
            )
            for number, row in enumerate(rows)
            if self._has(f"truepose.{family}-{number}-temperature")
        }
        for part in ("platform", "frame", "tool"):
            if self._has(f"truepose.{part}-temperature"):
                self.parts[f"truepose.{part}-temperature"] = part

    def _has(self, name: str) -> bool:
        return name in self.names

    @property
    def names(self) -> list[str]:
        """Of the module's own pins and parameters: those added last."""
        names = self.host.names
        last = len(names) - names[::-1].index("truepose.moment-max")
        first = last - names[:last][::-1].index("truepose.moment-max") - 1
        earlier = [k for k, name in enumerate(names[:first]) if name == "truepose.moment-max"]
        return names[earlier[-1] + 1 if earlier else 0 : last]

    # ---- pins ----

    def get(self, name: str) -> float:
        return self.host.get(f"truepose.{name}")

    def set(self, name: str, value: float) -> None:
        self.host.set(f"truepose.{name}", value)

    def connect(self) -> None:
        """Give every temperature pin a signal, at the reference temperature."""
        for pin in self.parts:
            self.host.connect(pin)

    def celsius(self, temperatures: Mapping[str, float]) -> None:
        """Write temperatures by pin, degrees Celsius."""
        for pin, value in temperatures.items():
            self.host.set(pin, value)

    def update(self, times: int = 1) -> None:
        for _ in range(times):
            self.host.run("truepose.update", CYCLE)

    def let_go(self) -> None:
        """No limits: what the pins say holds from the next cycle on."""
        self.set("rate-limit", 1e9)
        self.set("clamp", 1e9)
        self.set("force-max", 0.0)
        self.set("moment-max", 0.0)
        self.update(2)

    @property
    def compensation(self) -> Floats:
        """(n_joint,) mm or degrees, as the pins say."""
        return np.array([self.get(f"compensation-{n}") for n in range(len(self.machine.joints))])

    # ---- kinematics ----

    def emc(self, pose: ArrayLike) -> list[float]:
        """The six coordinates of a commanded pose; the others zero."""
        six = np.zeros(6)
        six[self.columns] = pose
        return six.tolist()

    def inverse(self, pose: ArrayLike) -> Floats | None:
        joints = self.module.inverse(self.emc(pose))
        return None if joints is None else np.array(joints)

    def forward(self, joints: ArrayLike, start: ArrayLike) -> Floats | None:
        """All nine coordinates."""
        pose = self.module.forward(np.asarray(joints).tolist(), self.emc(start))
        return None if pose is None else np.array(pose)

    @property
    def home(self) -> Floats:
        names = [self.machine.dof.index(name) for name in self.machine.commanded]
        return np.asarray(self.machine.home[names] / self.units)

    def poses(self, count: int, seed: int = 1) -> Floats:
        """(count, n_commanded) of the workspace's box."""
        grid = self.machine.poses() / self.units
        low, high = grid.min(axis=0), grid.max(axis=0)
        shares = np.random.default_rng(seed).uniform(0.02, 0.98, (count, len(low)))
        return np.asarray(low + shares * (high - low))

    # ---- the kernel ----

    def nominal(self, poses: Floats) -> Floats:
        """(n, n_joint) of the kernel."""
        return np.asarray(self.machine.inverse(poses * self.units) / self.joint_units)

    def corrected(
        self, poses: Floats, temperatures: Mapping[str, float], wrench: ArrayLike = (0.0,) * 6
    ) -> Floats:
        """(n, n_joint) of `truepose.compensate`; temperatures by pin, the rest at the reference."""
        reference = self.machine.condition.reference_temperature
        kelvin = {self.parts[pin]: value + 273.15 for pin, value in temperatures.items()}
        given = np.asarray(wrench, float).tolist()
        condition = self.machine.condition.replace(
            temperature={**dict.fromkeys(self.machine.parts, reference), "default": reference}
            | kelvin,
            force=given[:3],
            moment=given[3:],
        )
        result = tp.compensate(self.machine, poses * self.units, condition)
        assert result.sizes["pose"] == len(poses)
        return np.asarray(result["joint_corrected"].values / self.joint_units)
