"""What stands compressed in a page: blocks of data, and of them what its figures are drawn of."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any


def unpacked(page: str, name: str) -> bytes:
    """A block of data."""
    (block,) = re.findall(f'<script type="application/gzip" id="{name}">(.*?)</script>', page)
    return gzip.decompress(base64.b64decode(block))


def figures_of(page: str) -> Any:
    """What its figures are drawn of."""
    return json.loads(unpacked(page, "figures-data"))
