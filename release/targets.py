"""The systems that wheels are built for: one line each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A system, as Rust, maturin and pip name it."""

    triple: str
    """Rust's name."""
    compatibility: str
    """The oldest C library that the wheel runs with, as maturin takes it; empty: what there is."""
    tag: str
    """What the wheel's platform tag begins with, and auditwheel has to say of Linux."""

    @property
    def is_linux(self) -> bool:
        """Whether zig links it, so that it can be built anywhere, and auditwheel looks at it."""
        return "linux" in self.triple


TARGETS: dict[str, Target] = {
    "manylinux-x86_64": Target(
        "x86_64-unknown-linux-gnu", "manylinux_2_17", "manylinux_2_17_x86_64"
    ),
    "manylinux-aarch64": Target(
        "aarch64-unknown-linux-gnu", "manylinux_2_17", "manylinux_2_17_aarch64"
    ),
    "musllinux-x86_64": Target(
        "x86_64-unknown-linux-musl", "musllinux_1_2", "musllinux_1_2_x86_64"
    ),
    "musllinux-aarch64": Target(
        "aarch64-unknown-linux-musl", "musllinux_1_2", "musllinux_1_2_aarch64"
    ),
    "macos-arm64": Target("aarch64-apple-darwin", "", "macosx_"),
    "macos-x86_64": Target("x86_64-apple-darwin", "", "macosx_"),
    "windows-x86_64": Target("x86_64-pc-windows-msvc", "", "win_amd64"),
}
"""By the names that `make wheels ONLY=...` and the release workflow take."""
SDIST = "sdist"
DEFAULT = ("manylinux-x86_64", "manylinux-aarch64", SDIST)
"""What `make wheels` builds."""
