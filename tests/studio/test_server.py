"""The studio on the network: what is served, what is refused, what outlives it."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import stat
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import truepose as tp
from command_line import PLANAR, call
from served_studio import LIMIT, ServedStudio, Window, free_port, started, studio_of
from truepose.cli import run
from truepose.language import speaking
from truepose.reporting.live import part
from truepose.studio.server import LOOK_EVERY
from truepose.studio.shared_state import EVERY, LARGEST_FILE
from truepose.verdict.answer import BEFORE

Capture = pytest.CaptureFixture[str]


def folder_of(at: Path) -> Path:
    """A folder with a machine file in it."""
    folder = at / "machines"
    folder.mkdir()
    (folder / "m.toml").write_bytes(PLANAR.read_bytes())
    (at / "secret.toml").write_text("nobody's business")
    return folder


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedStudio]:
    """One studio for what leaves it as it was."""
    at = tmp_path_factory.mktemp("shared")
    with studio_of(folder_of(at) / "m.toml", at / "state", "--port", str(free_port())) as studio:
        yield studio
        code, err = studio.end()
        assert (code, err) == (130, ""), "quiet, and no traceback of all that was asked"


@pytest.fixture
def own(tmp_path: Path) -> Iterator[ServedStudio]:
    """A studio for one test."""
    at = folder_of(tmp_path) / "m.toml"
    with studio_of(at, tmp_path / "state", "--port", str(free_port())) as studio:
        yield studio


# --- what is served


def test_the_page_and_its_policy(shared: ServedStudio) -> None:
    status, headers, body = shared.get(f"/?token={shared.token}")
    assert status == 200
    text = body.decode()
    assert "Planar two-slider PKM" in text
    assert ('id="live-kernel"' in text) == part.is_built()
    assert "Content-Security-Policy" not in text, "that of a header holds, and no other"
    policy = headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; ")
    assert f"connect-src 'self' ws://{shared.host}; " in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"
    assert "server" not in headers


def test_a_window_is_told_everything(shared: ServedStudio) -> None:
    with shared.window() as window:
        state = window.next()
        assert (state["type"], state["file"]["name"]) == ("state", "m.toml")
        assert window.next()["type"] == "fields"
        for name in EVERY:
            if not any(message.get("name") == name for message in window.told):
                window.until("answer", name=name)
    with shared.window() as window:
        window.until("answer", name="shares", number=state["number"])
        assert {m.get("name") for m in window.told if m["type"] == "answer"} == set(EVERY)


# --- what is refused

NOBODY = "http://attacker.example"


def refused(studio: ServedStudio, path: str, **given: Any) -> None:
    status, headers, body = studio.get(path, **given)
    assert (status, body) == (403, b"Forbidden.\n"), (path, given)
    assert "content-security-policy" not in headers


PATHS = [
    "/",
    "/files",
    "/report",
    "/socket",
    "/secret.toml",
    "/../secret.toml",
    "/m.toml",
    "/%2e%2e/x",
    "//",
]


@pytest.mark.parametrize("path", PATHS)
def test_nothing_is_served_without_the_token(path: str, shared: ServedStudio) -> None:
    mine = {"Origin": f"http://{shared.host}"}
    for query in ("", "?token=", "?token=wrong", f"?token={shared.token[:-1]}"):
        refused(shared, path + query)
        refused(shared, path + query, method="POST", body=b"x", headers=mine)


@pytest.mark.parametrize("path", PATHS)
def test_nothing_is_served_to_another_origin_or_host(path: str, shared: ServedStudio) -> None:
    whole = f"{path}?token={shared.token}"
    host = {"Host": f"attacker.example:{shared.port}"}
    for method, body in (("GET", None), ("POST", b"x"), ("HEAD", None), ("DELETE", None)):
        for headers in ({"Origin": NOBODY}, {"Origin": "null"}, host, {"Host": ""}):
            status, _, told = shared.get(whole, method, body, headers)
            assert status in (400, 403), (method, headers)
            assert b"Planar" not in told
    refused(shared, whole, method="POST", body=b"x")


@pytest.mark.parametrize(
    "path", ["/secret.toml", "/../secret.toml", "/m.toml", "/%2e%2e/secret.toml", "/files/../x"]
)
def test_no_file_is_served_with_the_token_either(path: str, shared: ServedStudio) -> None:
    status, _, body = shared.get(f"{path}?token={shared.token}")
    assert status == 404
    assert b"business" not in body
    assert b"schema" not in body


@pytest.mark.parametrize(
    ("query", "origin", "host"),
    [
        ("", None, None),
        ("?token=wrong", None, None),
        (None, NOBODY, None),
        (None, "null", None),
        (None, "", None),
        (None, None, "attacker.example"),
    ],
)
def test_the_websocket_is_refused_at_its_handshake(
    query: str | None, origin: str | None, host: str | None, shared: ServedStudio
) -> None:
    name = shared.host if host is None else f"{host}:{shared.port}"
    asked = f"?token={shared.token}" if query is None else query
    given: Any = (f"http://{name}" if origin is None else origin) or None
    with socket.create_connection(("127.0.0.1", shared.port), LIMIT) as plain:
        with pytest.raises(InvalidStatus) as failure:
            connect(f"ws://{name}/socket{asked}", sock=plain, origin=given)
        assert failure.value.response.status_code == 403


def test_another_path_of_a_websocket_is_none(shared: ServedStudio) -> None:
    at = f"ws://{shared.host}/other?token={shared.token}"
    with (
        pytest.raises((InvalidStatus, ConnectionClosed)),
        connect(
            at,
            origin=f"http://{shared.host}",  # type: ignore[arg-type]
        ) as window,
    ):
        window.recv(timeout=LIMIT)


def test_bad_input_gets_a_sentence_and_changes_nothing(shared: ServedStudio) -> None:
    with shared.window() as window:
        before = window.until("state")
        for text in ("", "no JSON", "[]", '{"type": "nothing"}', "[" * 50_000, '{"type": 3}'):
            window.socket.send(text)
            assert window.until("refused")["problems"][0]["code"] == "bad-argument"
        window.edit("condition.temperature", "5 N")
        problem = window.until("refused")["problems"][0]
        assert (problem["code"], problem["path"]) == ("wrong-dimension", "condition.temperature")
        assert problem["message"] == "condition.temperature: expected a temperature, found a force"
        for name in ("../secret.toml", "/etc/passwd", "m.toml", "a/b.toml", "c.txt"):
            window.say(type="save", name=name, replace=True)
            assert window.until("refused")["problems"][0]["code"].startswith("output-")
        window.say(type="tab", name="nothing")
        assert window.until("refused")["problems"][0]["code"] == "unknown-choice"
        window.say(type="reload")
        assert window.until("state")["edits"] == before["edits"]


def test_what_is_no_text_or_too_large_closes_the_window(shared: ServedStudio) -> None:
    for content in (b"bytes", "x" * 100_000):
        with shared.window() as window:
            window.until("fields")
            window.socket.send(content)
            with pytest.raises(ConnectionClosed):
                window.until("refused")
    assert shared.get(f"/?token={shared.token}", method="HEAD")[0] == 200


# --- dropped files


def test_a_dropped_file_is_held_and_never_written(own: ServedStudio, tmp_path: Path) -> None:
    with own.window() as window:
        window.until("fields")
        before = sorted(tmp_path.rglob("*"))
        told = own.post("measured.csv", b"x (mm)\n1\n")
        assert told == {"file": 1, "name": "measured.csv", "size": 9}
        assert window.until("state", files=[told])
        window.say(type="tab", name="calibration", options={"file": 1})
        answer = window.until("tab", name="calibration")
        assert answer["problems"][0]["file"] == "measured.csv"
        window.say(type="forget", file=1)
        assert window.until("state", files=[])
    assert sorted(tmp_path.rglob("*")) == before


def test_a_dropped_file_that_is_too_large(own: ServedStudio) -> None:
    path = f"/files?token={own.token}&name=large.csv"
    origin = {"Origin": f"http://{own.host}"}
    declared = origin | {"Content-Length": str(LARGEST_FILE + 1)}
    status, _, body = own.get(path, "POST", None, declared)
    assert status == 413
    assert json.loads(body)["problems"][0]["code"] == "file-too-large"
    status, _, _ = own.get(path, "POST", None, origin | {"Content-Length": "many"})
    assert status in (400, 413)
    status, _, body = own.get(path, "POST", b"x" * LARGEST_FILE, origin)
    assert (status, json.loads(body)["size"]) == (200, LARGEST_FILE)
    assert own.end() == (130, "")


# --- windows


def answers_of(window: Window, number: int) -> dict[str, Any]:
    """The last value of every answer of a state."""
    last = {"type": "answer", "name": EVERY[-1], "number": number}
    while not any(last.items() <= message.items() for message in window.told):
        window.next()
    given = [m for m in window.told if m["type"] == "answer" and m["number"] == number]
    return {message["name"]: message["value"] for message in given}


def test_two_windows_share_one_state(own: ServedStudio) -> None:
    with own.window() as one, own.window() as two:
        one.until("answer", name="shares")
        one.edit("strut.1.length", "501")
        assert two.until("state", number=1)["edits"] == [["strut.1.length", "501"]]
        two.edit("strut.1.length", "502")
        assert one.until("state", number=2)["edits"] == [["strut.1.length", "502"]]
        one.say(type="tab", name="budget")
        assert one.until("tab", name="budget", number=2)
        told = answers_of(two, 2)
        assert told == answers_of(one, 2)
        assert not [m for m in two.told if m["type"] == "tab"], "each its own view"
        two.say(type="undo")
        assert one.until("state", number=3)["edits"] == [["strut.1.length", "501"]]
        assert one.until("tab", name="budget", number=3), "it follows"


def test_of_a_dragged_slider_the_last_value_wins(own: ServedStudio) -> None:
    with own.window() as window:
        window.until("answer", name="shares")
        for step in range(40):
            window.say(
                type="edit", edits=[["condition.temperature", str(20 + step)]], joins=step > 0
            )
        state = window.until("state", edits=[["condition.temperature", "59"]])
        assert state["undo"] == 1, "one step"
        told = answers_of(window, state["number"])
        assert set(told) == set(EVERY)
        window.say(type="undo")
        assert window.until("state", edits=[])


def test_at_rest_every_number_is_that_of_the_command_for_the_saved_file(
    own: ServedStudio, tmp_path: Path, capsys: Capture
) -> None:
    with own.window() as window:
        window.say(type="edit", edits=[["strut.1.length", "500.7"], ["condition.force.x", "900"]])
        number = window.until("state", undo=1)["number"]
        told = answers_of(window, number)
        window.say(type="save", name="saved.toml")
        window.until("saved")
        window.say(type="difference")
        lines = window.until("difference")["text"].splitlines()
    assert [line for line in lines if line[0] in "+-"][2:] == [
        "-length = 500",
        "+length = 500.7",
        "-force = { x = 1200, y = -1500 } # on the tool",
        "+force = { x = 900, y = -1500 } # on the tool",
    ]
    saved = tmp_path / "machines" / "saved.toml"
    document = json.loads(call(capsys, "budget", saved, "--format", "json").out)
    linear = max(row[0] for row in document["variables"]["linear_maximum"]["values"])
    assert told["known"]["highest"]["position"]["value"] * 1e3 == pytest.approx(linear, rel=1e-15)
    (first, *_) = tp.accuracy(tp.load(saved))
    assert told["verdict"][0]["bound"]["value"] == first.bound.value
    assert told["verdict"][0]["answer"] == first.answer


def test_the_report_is_that_of_the_saved_file(own: ServedStudio, tmp_path: Path) -> None:
    with own.window() as window:
        window.edit("accuracy.target", "0.9 mm")
        window.until("state", number=1)
        window.say(type="save", name="m2.toml")
        window.until("saved")
        status, headers, body = own.get(f"/report?token={own.token}")
        assert status == 200
        assert headers["content-type"].startswith("text/html")
        page = tmp_path / "page.html"
        saved = tmp_path / "machines" / "m2.toml"
        assert run(["report", str(saved), "--output", str(page)]) == 0
        # The name of the file is another one, and nothing else.
        expected = page.read_text("utf-8").replace("m2.toml", "m.toml")
        assert re.sub(r"<script.*?</script>", "", body.decode(), flags=re.S) == re.sub(
            r"<script.*?</script>", "", expected, flags=re.S
        )
    assert own.get("/report")[0] == 403


# --- what outlives it


def test_after_kill_9_the_same_address_has_the_same_state(tmp_path: Path) -> None:
    file, state = folder_of(tmp_path) / "m.toml", tmp_path / "state"
    with studio_of(file, state, "--port", str(free_port())) as first:
        with first.window() as window:
            window.edit("strut.1.length", "501")
            window.until("answer", name="known", number=1)
            window.say(type="show", pose=[0.3, 0.2])
            before = window.until("state", number=2)
            window.until("answer", name="known", number=2)
        first.process.send_signal(signal.SIGKILL)
        first.process.wait(LIMIT)
        (kept,) = (state / "truepose" / "studio").iterdir()
        assert stat.S_IMODE(kept.stat().st_mode) == 0o600
        with studio_of(file, state) as again:
            assert again.address == first.address
            with again.window() as window:
                after = window.next()
                for key in ("edits", "pose", "condition", "undo", "redo"):
                    assert after[key] == before[key]
                assert window.until("answer", name="known")["value"]["pose"] == [0.3, 0.2]
                window.say(type="undo")
                assert window.until("state", edits=[])


def test_a_port_that_another_process_has(tmp_path: Path) -> None:
    file, port = folder_of(tmp_path) / "m.toml", free_port()
    with socket.socket() as other:
        other.bind(("127.0.0.1", port))
        other.listen()
        with studio_of(file, tmp_path / "state", "--port", str(port)) as studio:
            assert studio.port != port
            assert studio.get(f"/?token={studio.token}")[0] == 200
            code, err = studio.end()
    assert code == 130
    assert err == f"Port {port} is taken by another process: {studio.port} instead.\n"


def test_a_file_that_changes_under_it(own: ServedStudio, tmp_path: Path) -> None:
    file = tmp_path / "machines" / "m.toml"
    with own.window() as window:
        state = window.until("state")
        file.write_text(file.read_text().replace('target = "0.5 mm"', 'target = "0.9 mm"'))
        told = window.until("changed")
        assert told["hash"] not in (None, state["file"]["hash"])
        assert window.until("state")["file"]["changed"]
        window.say(type="reload")
        again = window.until("state", number=1)
        assert again["file"] == {"name": "m.toml", "hash": told["hash"], "changed": False}
        verdict = answers_of(window, 1)["verdict"]
        assert verdict[0]["asked"] == pytest.approx(0.9e-3)
        file.unlink()
        assert window.until("changed")["hash"] is None


def test_a_file_that_looks_as_before_when_another_was_read(
    own: ServedStudio, tmp_path: Path
) -> None:
    """It was read again as somebody had changed it, who took that back before it was looked at."""
    file = tmp_path / "machines" / "m.toml"
    first, looks = file.read_bytes(), file.stat()
    other = first.replace(b'target = "0.5 mm"', b'target = "0.9 mm"')
    assert other != first

    def write(content: bytes) -> None:
        """With the same size, place and time, as what is looked at first."""
        with file.open("r+b") as opened:
            opened.write(content)
        os.utime(file, ns=(looks.st_atime_ns, looks.st_mtime_ns))

    with own.window() as window:
        number = window.until("state")["number"]
        time.sleep(2.0 * LOOK_EVERY)
        for _ in range(5):  # by chance it is looked at in between
            write(other)
            window.say(type="reload")
            number = window.until("state", number=number + 1)["number"]
            write(first)
            time.sleep(3.0 * LOOK_EVERY)
            window.say(type="difference")
            window.told.clear()
            window.until("difference")
            if any(told["type"] == "changed" for told in window.told):
                break
            window.say(type="reload")
            number = window.until("state", number=number + 1)["number"]
        else:
            pytest.fail("not told that the file is another one than was read")


def test_a_report_that_is_being_made_holds_nobody_up(tmp_path: Path) -> None:
    file = folder_of(tmp_path) / "m.toml"
    grid = "grid = { x = [200, 400, 5], y = [100, 300, 5] }"
    many = file.read_text().replace(grid, "grid = { x = [200, 400, 700], y = [100, 300, 700] }")
    file.write_text(many)
    studio = started(file, tmp_path / "state", "--port", str(free_port()))
    with socket.create_connection(("127.0.0.1", studio.port), LIMIT) as asking:
        path = f"GET /report?token={studio.token} HTTP/1.1\r\nHost: {studio.host}\r\n\r\n"
        asking.sendall(path.encode())
        until = time.monotonic() + LIMIT
        while len(descendants(studio.process.pid)) < 4:  # trackers, the one that forks, two more
            assert time.monotonic() < until
            time.sleep(0.02)
        children = descendants(studio.process.pid)
        assert studio.end() == (130, "")
    while any(map(alive, children)):
        assert time.monotonic() < until
        time.sleep(0.02)


def test_nothing_is_left_running(tmp_path: Path) -> None:
    """Neither after Ctrl-C nor after a kill that it cannot see coming."""
    file = folder_of(tmp_path) / "m.toml"
    for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)):
        studio = started(file, tmp_path / "state", "--port", str(free_port()))
        with studio.window() as window:
            window.until("answer", name="known")
        children = descendants(studio.process.pid)
        assert children
        assert studio.end(number) == (code, "")
        until = time.monotonic() + LIMIT
        while any(map(alive, children)):
            assert time.monotonic() < until, f"left after {number}"
            time.sleep(0.02)


def descendants(parent: int) -> list[int]:
    """All processes below one."""
    below: dict[int, list[int]] = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            below.setdefault(int(fields[1]), []).append(int(folder.name))
    every, left = [], [parent]
    while left:
        children = below.get(left.pop(), [])
        every += children
        left += children
    return every


def alive(number: int) -> bool:
    try:
        os.kill(number, 0)
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return False
    return state != "Z"


# --- the command


def test_files_that_are_refused_before_anything_listens(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    outcome = call(capsys, "studio", tmp_path / "none.toml")
    assert (outcome.code, outcome.codes) == (2, ["file-missing"])
    (tmp_path / "m.toml").write_text("schema = 1\n")
    outcome = call(capsys, "studio", tmp_path / "m.toml")
    assert outcome.code == 2
    assert "missing-key" in outcome.codes
    assert call(capsys, "studio", "-").code == 2
    for wrong in (["--port", "70000"], ["--host", "no.such.host.invalid"]):
        outcome = call(capsys, "studio", PLANAR, *wrong)
        assert outcome.code == 2
        assert re.search("--port|--host", outcome.err)
    assert not (tmp_path / "state").exists()


def test_without_the_extra_it_says_so(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    import sys

    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.delitem(sys.modules, "truepose.studio.server", raising=False)
    outcome = call(capsys, "studio", PLANAR)
    assert (outcome.code, outcome.codes) == (2, ["extra-missing"])
    assert "pip install 'truepose[studio]'" in outcome.err


def test_page_answers_and_report_are_in_the_language_asked_for(tmp_path: Path) -> None:
    file = folder_of(tmp_path) / "m.toml"
    machine = tp.load(file)
    english = [answer.rests_on for answer in tp.accuracy(machine, states=(BEFORE,))]
    with speaking("de"):
        expected = [answer.rests_on for answer in tp.accuracy(machine, states=(BEFORE,))]
    assert english != expected
    with studio_of(file, tmp_path / "state", "--language", "de") as studio:
        for path in ("/", "/report"):
            status, _, page = studio.get(f"{path}?token={studio.token}")
            assert status == 200
            assert b'<html lang="de"' in page
        with studio.window() as window:
            told = window.until("answer", name="verdict")["value"]
    assert [one["rests_on"] for one in told] == expected


def test_a_language_that_there_is_not_is_told_before_anything_listens(capsys: Capture) -> None:
    assert run(["studio", str(PLANAR), "--language", "xx"]) == 2
    assert "unknown-language" in capsys.readouterr().err
