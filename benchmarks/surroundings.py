"""On what a benchmark ran: processor, system and packages."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("numpy", "scipy")
PEERS = ("numba", "jax")


def surroundings(instruction_set: str) -> str:
    """One line: processor, cores, the kernel's instruction set, system and packages."""
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    for name in PEERS:
        try:
            packages.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    parts = (
        processor(),
        f"{os.cpu_count()} cores",
        instruction_set,
        f"{platform.system()} {platform.machine()}",
        f"Python {platform.python_version()}",
        *packages,
    )
    return ", ".join(parts)


def processor() -> str:
    """The processor's name as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"
