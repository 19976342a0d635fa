"""What outlives the studio of a machine file: its token, its port, its settings.

One file for each machine file, readable by its owner alone, under `$XDG_STATE_HOME`. What cannot
be read, or what others can, is no state.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import stat
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from truepose.files.one_run import real_path
from truepose.studio.access import new_token
from truepose.studio.settings import History

SCHEMA = 1
OWN_FILE, OWN_FOLDER = 0o600, 0o700
LARGEST = 20_000_000
"""Bytes of a state file that is read."""


@dataclass(frozen=True)
class KeptState:
    """What is kept: the token, the port of the last time, and the settings with their history."""

    token: str = field(default_factory=new_token)
    port: int | None = None
    history: History = field(default_factory=History)

    def to_json(self) -> dict[str, Any]:
        """As the file has it."""
        return {
            "schema": SCHEMA,
            "token": self.token,
            "port": self.port,
            "history": self.history.to_json(),
        }

    @classmethod
    def from_json(cls, value: Any) -> KeptState:
        """Of what a file has. Raises `ValueError`, `KeyError` or `TypeError` for what is none."""
        token, port = value["token"], value["port"]
        if value["schema"] != SCHEMA or not (isinstance(token, str) and len(token) >= 32):
            raise ValueError("another schema, or no token")
        if port is not None and not (isinstance(port, int) and 0 < port < 65_536):
            raise ValueError("no port")
        return cls(token, port, History.from_json(value["history"]))


def state_path(machine_file: Path) -> Path:
    """Where the state of a machine file is kept, links of it followed."""
    base = os.environ.get("XDG_STATE_HOME", "")
    folder = Path(base) if Path(base).is_absolute() else Path.home() / ".local" / "state"
    digest = hashlib.sha256(os.fsencode(real_path(machine_file))).hexdigest()[:32]
    return folder / "truepose" / "studio" / f"{digest}.json"


def read_state(path: Path) -> KeptState:
    """What was kept; a new state where nothing was, or where others could have read it."""
    try:
        with path.open("rb") as file:
            if not _is_own(os.fstat(file.fileno())):
                return KeptState()
            return KeptState.from_json(json.loads(file.read(LARGEST)))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return KeptState()


def write_state(path: Path, state: KeptState) -> None:
    """Keep it: whole, or as it was. Raises `OSError` where the folder takes none."""
    path.parent.mkdir(mode=OWN_FOLDER, parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(4)}")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, OWN_FILE)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            json.dump(state.to_json(), file)
        temporary.replace(path)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


def _is_own(status: os.stat_result) -> bool:
    """Whether a file is its owner's alone, and that we are."""
    if os.name == "nt":  # folders of a user are that user's there
        return True
    others = stat.S_IMODE(status.st_mode) & 0o077
    return not others and status.st_uid == os.getuid()


__all__ = ["KeptState", "read_state", "state_path", "write_state"]
