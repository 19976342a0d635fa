"""Write docs/machine_file.md and docs/machine_file.schema.json from the package's models.

Run `python docs/generate_machine_file.py` after a change of a table, an element or a source; a test
refuses files that are not what this writes.
"""

from __future__ import annotations

import json
from pathlib import Path

from truepose.machine.reference import json_schema, page
from truepose.sources import REGISTRY


def pages() -> dict[str, str]:
    """File name in docs/ -> its text."""
    schema = json.dumps(json_schema(REGISTRY), indent=2, ensure_ascii=False) + "\n"
    return {"machine_file.md": page(REGISTRY), "machine_file.schema.json": schema}


if __name__ == "__main__":
    for name, text in pages().items():
        (Path(__file__).parent / name).write_text(text, encoding="utf-8")
        print(f"docs/{name}")
