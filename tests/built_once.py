"""What tests compile is compiled once a run, whichever of the workers asks first."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path


def built_once(folder: Path, made_of: Iterable[str], build: Callable[[Path], object]) -> Path:
    """The folder under `folder` (the fixture `builds`) that `build` has filled.

    It is named after a hash of `made_of`, which has to hold all that the result depends on: sources
    and command. It appears whole or not at all.
    """
    name = hashlib.sha256("\0".join(made_of).encode()).hexdigest()[:24]
    place = folder / name
    if not place.exists():
        scratch = Path(tempfile.mkdtemp(dir=folder))
        build(scratch)
        try:
            scratch.rename(place)
        except OSError:  # another worker was first, with the same
            if not place.exists():
                raise
    return place
