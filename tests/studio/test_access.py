"""Who is let in: token, Host and Origin, each alone enough to be refused."""

from __future__ import annotations

import secrets

import pytest

from truepose.studio.access import Access, new_token

TOKEN = "a-token-of-the-tests-which-nobody-guesses"  # noqa: S105
HERE = Access(TOKEN, "127.0.0.1", 8768)
HOST = (b"host", b"127.0.0.1:8768")
ORIGIN = (b"origin", b"http://127.0.0.1:8768")
QUERY = f"token={TOKEN}".encode()


def test_what_is_let_in() -> None:
    assert HERE.refuses("GET", [HOST], QUERY) is None
    for method in ("GET", "POST", "WEBSOCKET"):
        assert HERE.refuses(method, [HOST, ORIGIN], b"name=a&" + QUERY) is None
    for name in (b"localhost:8768", b"[::1]:8768", b"LOCALHOST:8768"):
        same = (b"origin", b"http://" + name)
        assert HERE.refuses("WEBSOCKET", [(b"Host", name), same], QUERY) is None


@pytest.mark.parametrize(
    "query",
    [
        b"",
        b"token=",
        b"token=wrong",
        QUERY[:-1],
        QUERY + b"x",
        QUERY + b"&token=" + TOKEN.encode(),
        f"token={TOKEN.upper()}".encode(),
        b"Token=" + TOKEN.encode(),
        "token=ä".encode(),
        b"token=%FF%FE",
        b"a=1&" * 1000 + QUERY,
    ],
)
def test_the_token(query: bytes) -> None:
    assert "token" in str(HERE.refuses("GET", [HOST, ORIGIN], query))


@pytest.mark.parametrize(
    "host",
    [
        b"attacker.example:8768",
        b"127.0.0.1",
        b"127.0.0.1:8769",
        b"127.0.0.1.attacker.example:8768",
        b"192.168.1.7:8768",
        b"",
        b":8768",
        b"127.0.0.1:8768.",
    ],
)
def test_the_host(host: bytes) -> None:
    """A name of somebody else's that leads to this computer, such as after DNS rebinding."""
    origin = (b"origin", b"http://" + host)
    assert "Host" in str(HERE.refuses("GET", [(b"host", host)], QUERY))
    assert "Host" in str(HERE.refuses("WEBSOCKET", [(b"host", host), origin], QUERY))


def test_hosts_that_are_none_or_two() -> None:
    assert "Host" in str(HERE.refuses("GET", [], QUERY))
    assert "Host" in str(HERE.refuses("GET", [HOST, HOST], QUERY))


@pytest.mark.parametrize(
    "origin",
    [
        b"http://attacker.example",
        b"http://127.0.0.1",
        b"http://127.0.0.1:8769",
        b"https://127.0.0.1:8768",
        b"http://localhost:8768",
        b"null",
        b"",
        b"http://127.0.0.1:8768/",
    ],
)
def test_the_origin(origin: bytes) -> None:
    for method in ("GET", "HEAD", "POST", "WEBSOCKET"):
        assert "Origin" in str(HERE.refuses(method, [HOST, (b"origin", origin)], QUERY))


def test_who_changes_anything_has_an_origin() -> None:
    for method in ("POST", "PUT", "WEBSOCKET", "OPTIONS"):
        assert "Origin" in str(HERE.refuses(method, [HOST], QUERY))
    assert "Origin" in str(HERE.refuses("GET", [HOST, ORIGIN, ORIGIN], QUERY))


def test_who_listens_everywhere_is_asked_by_addresses() -> None:
    everywhere = Access(TOKEN, "0.0.0.0", 80)  # noqa: S104
    for host in (b"192.168.1.7:80", b"[fe80::1]:80", b"localhost:80"):
        assert everywhere.refuses("GET", [(b"host", host)], QUERY) is None
    for host in (b"attacker.example:80", b"192.168.1.7.example:80", b"192.168.1.7:81"):
        assert everywhere.refuses("GET", [(b"host", host)], QUERY) is not None
    assert everywhere.address() == f"http://127.0.0.1:80/?token={TOKEN}"


def test_another_address_is_named_in_full() -> None:
    other = Access(TOKEN, "::1", 8768)
    assert other.address("/socket") == f"http://[::1]:8768/socket?token={TOKEN}"
    named = Access(TOKEN, "10.0.0.5", 8768)
    assert named.refuses("GET", [(b"host", b"10.0.0.5:8768")], QUERY) is None


def test_tokens_are_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []
    real = secrets.compare_digest
    monkeypatch.setattr(secrets, "compare_digest", lambda *a: compared.append(a) or real(*a))
    assert HERE.refuses("GET", [HOST], b"token=wrong") is not None
    assert compared == [(b"wrong", TOKEN.encode())]
    assert len(new_token()) >= 43
    assert new_token() != new_token()
