"""Who may ask the studio anything: token, `Host` and `Origin`, looked at before all else.

A page of another site can send requests to this computer from its visitor's browser, under a name
that leads here too; it knows no token, and its `Origin` or `Host` is another one.
"""

from __future__ import annotations

import ipaddress
import secrets
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from urllib.parse import parse_qs

Headers = Iterable[tuple[bytes, bytes]]

READING = frozenset({"GET", "HEAD"})
"""Methods of which a browser sends no `Origin` where somebody types the address."""

EVERYWHERE = ("0.0.0.0", "::", "")  # noqa: S104 that is what is looked for
HERE = ("127.0.0.1", "localhost", "[::1]")


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(32)


@dataclass(frozen=True)
class Access:
    """What a request has to have. `host` and `port`: where the studio listens."""

    token: str
    host: str
    port: int

    def refuses(self, method: str, headers: Headers, query: bytes) -> str | None:
        """Why a request is refused; None where it is not. `method` of a WebSocket: "WEBSOCKET"."""
        values: dict[bytes, list[str]] = {}
        for name, value in headers:
            values.setdefault(name.lower(), []).append(value.decode("latin-1"))
        hosts = values.get(b"host", [])
        if len(hosts) != 1 or not self._is_here(hosts[0]):
            return "the Host is not this studio's"
        origins = values.get(b"origin", [])
        if origins != [f"http://{hosts[0]}"] and (origins or method not in READING):
            return "the Origin is not this studio's"
        if not self._knows(query):
            return "no token, or a wrong one"
        return None

    def address(self, path: str = "/") -> str:
        """Where a browser finds the studio."""
        return f"http://{self._name()}:{self.port}{path}?token={self.token}"

    def _name(self) -> str:
        host = "127.0.0.1" if self.host in EVERYWHERE else self.host
        return f"[{host}]" if ":" in host else host

    def _knows(self, query: bytes) -> bool:
        try:
            given = parse_qs(query.decode("ascii"), max_num_fields=20).get("token", [])
        except (UnicodeDecodeError, ValueError):
            return False
        # Compared as bytes: a text with other letters than ASCII is refused with an exception.
        return len(given) == 1 and secrets.compare_digest(
            given[0].encode("utf-8", "replace"), self.token.encode()
        )

    def _is_here(self, host: str) -> bool:
        """Whether a `Host` names this studio, its port included."""
        name, colon, port = host.rpartition(":")
        if not colon or port != str(self.port):
            return False
        name = name.lower()
        if name in HERE or name == self._name().lower():
            return True
        # Who listens everywhere is asked by any address; only a name can be somebody else's.
        return self.host in EVERYWHERE and (
            _is_address(name.strip("[]")) or name == socket.gethostname().lower()
        )


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


__all__ = ["Access", "new_token"]
