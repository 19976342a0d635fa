"""Write docs/machine_file.md and .schema.json, and the table of docs/sources/README.md.

Run `python docs/generate_machine_file.py` after a change of a table, an element or a source; a test
refuses files that are not what this writes.
"""

from __future__ import annotations

import re
from pathlib import Path

from truepose.machine.reference import page, schema_text
from truepose.sources import REGISTRY

SOURCES = Path(__file__).parent / "sources"
IN_FILE = "In the file: "


def list_of_sources() -> str:
    """docs/sources/README.md with its table of sources: each page says what stands in the file."""
    rows = []
    for source in REGISTRY:
        lines = (SOURCES / f"{source.name}.md").read_text(encoding="utf-8").splitlines()
        in_file = next(line for line in lines if line.startswith(IN_FILE)).removeprefix(IN_FILE)
        rows.append(f"| [{source.name}]({source.name}.md) | {source.doc} | {in_file} |")
    before, after = re.split(
        r"(?:^\| \[.*\n)+", (SOURCES / "README.md").read_text("utf-8"), flags=re.M
    )
    return before + "\n".join(rows) + "\n" + after


def pages() -> dict[str, str]:
    """File name in docs/ -> its text."""
    return {
        "machine_file.md": page(REGISTRY),
        "machine_file.schema.json": schema_text(REGISTRY),
        "sources/README.md": list_of_sources(),
    }


if __name__ == "__main__":
    for name, text in pages().items():
        (Path(__file__).parent / name).write_text(text, encoding="utf-8")
        print(f"docs/{name}")
