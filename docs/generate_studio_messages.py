"""Write docs/studio_messages.schema.json, the schema of what the studio's page and server say.

Run `python docs/generate_studio_messages.py` after a message changed; a test refuses a file that
is not what this writes.
"""

from __future__ import annotations

from pathlib import Path

from truepose.studio.messages import schema_text

FILE = Path(__file__).parent / "studio_messages.schema.json"

if __name__ == "__main__":
    FILE.write_text(schema_text(), encoding="utf-8")
    print(f"docs/{FILE.name}")
