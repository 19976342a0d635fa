"""What a release is made and tried with: wheels, sdist, names, recipe, and reports of changes.

Most modules are programs, `python -m release.<module> --help`; release/README.md says in which
order, and what of it was never run.
"""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parent.parent
DIST = ROOT / "dist"
BUILD = ROOT / "build" / "release"
"""What is made on the way: environments, an ARM system's files."""
