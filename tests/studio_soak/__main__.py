"""A long soak, with the figures of each minute; exit code 1 where the studio does not hold."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from browser import CHROMIUM
from studio_soak import broken, grown, soak
from studio_soak.course import HEXAPOD
from studio_soak.memory import HEAD
from truepose.reporting.live import part


def main() -> int:
    """Run and print each reading as it is taken; 2 where what it needs is missing."""
    parser = argparse.ArgumentParser(prog="studio_soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--machine", type=Path, default=HEXAPOD, help="a machine file")
    options = parser.parse_args()
    if not part.is_built() or not Path(CHROMIUM).exists():
        print("a soak needs chromium, and the kernel for browsers: make web", file=sys.stderr)
        return 2
    print(HEAD, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        outcome = soak(
            Path(folder),
            60.0 * options.minutes,
            options.seed,
            machine=options.machine,
            told=lambda reading: print(reading, flush=True),
        )
    print(outcome, flush=True)
    failures = [
        *broken(outcome), *(f"{name} grew by {by:.1f} MB" for name, by in grown(outcome).items()),
    ]  # fmt: skip
    for failure in failures:
        print(failure, flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
