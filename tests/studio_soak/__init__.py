"""A studio at random work for as long as asked: values, tabs, files, in a page and by the socket.

`python -m studio_soak --minutes 60 --seed 1` with tests/ on the path, or `make soak`. What it holds
the studio to: `outcome`.
"""

from __future__ import annotations

from studio_soak.course import soak
from studio_soak.outcome import LARGEST_GROWTH, Outcome, broken, grown

__all__ = ["LARGEST_GROWTH", "Outcome", "broken", "grown", "soak"]
