"""What windows say is taken to its end, and no fault of one conversation silences the others."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.websockets import WebSocketDisconnect

from command_line import PLANAR
from truepose.studio.access import Access
from truepose.studio.jobs import Given
from truepose.studio.server import Studio
from truepose.studio.shared_state import SharedState

SOON = 30.0
"""s; what is not told until then never will be."""
UNDO = '{"type": "undo"}'
EDIT = '{"type": "edit", "edits": [["accuracy.target", "0.1 mm"]]}'


class Page:
    """A window without a network."""

    def __init__(self) -> None:
        self.says: asyncio.Queue[str | None] = asyncio.Queue()
        self._told: asyncio.Queue[dict[str, Any]] = asyncio.Queue()

    async def accept(self) -> None:
        """As a WebSocket's."""

    async def close(self, code: int) -> None:
        """As a WebSocket's."""

    async def send_text(self, text: str) -> None:
        self._told.put_nowait(json.loads(text))

    async def receive_text(self) -> str:
        text = await self.says.get()
        if text is None:
            raise WebSocketDisconnect
        return text

    async def told(self, kind: str) -> dict[str, Any]:
        """The next message of a kind."""
        while True:
            message = await asyncio.wait_for(self._told.get(), SOON)
            if message["type"] == kind:
                return message


@pytest.fixture
def studio(tmp_path: Path) -> Studio:
    """One that listens nowhere, and works nothing out."""
    at = tmp_path / "m.toml"
    at.write_bytes(PLANAR.read_bytes())
    return Studio(SharedState.opened(at), Access("token", "127.0.0.1", 1))


def talk(studio: Studio, course: Callable[[Page, Page], Awaitable[None]]) -> None:
    """Let a course of events happen to two open windows."""

    async def whole() -> None:
        pages = Page(), Page()
        tasks = [asyncio.create_task(studio.conversation(page)) for page in pages]  # type: ignore[arg-type]
        tasks.append(asyncio.create_task(studio.hand_on()))
        for page in pages:
            await page.told("fields")
        async with asyncio.timeout(SOON):
            await course(*pages)
        for page in pages:
            page.says.put_nowait(None)
        await asyncio.wait(tasks[:2])
        tasks[2].cancel()

    asyncio.run(whole())


def failing_once(of: Any, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a method fail as only a fault of ours does, the first time it is called."""
    method, calls = getattr(of, name), []

    def once(*arguments: Any) -> Any:
        calls.append(arguments)
        if len(calls) == 1:
            raise ZeroDivisionError("by nothing")
        return method(*arguments)

    monkeypatch.setattr(of, name, once)


def is_defect(problems: list[dict[str, Any]], err: str) -> bool:
    return (
        [problem["code"] for problem in problems] == ["defect"]
        and "ZeroDivisionError (by nothing)" in problems[0]["found"]
        and err.count("this is a defect of truepose") == 1
    )


def test_what_a_window_said_is_taken_though_it_goes(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken, go_on = threading.Event(), threading.Event()
    receive = studio.session.receive

    def slowly(*arguments: Any) -> Any:
        taken.set()
        assert go_on.wait(SOON)
        return receive(*arguments)

    monkeypatch.setattr(studio.session, "receive", slowly)

    async def course(first: Page, second: Page) -> None:
        number = studio.session.number
        first.says.put_nowait(EDIT)
        while not taken.is_set():
            await asyncio.sleep(0.001)
        first.says.put_nowait(None)
        while studio.open_windows == 2:
            await asyncio.sleep(0.001)
        second.says.put_nowait(UNDO)
        go_on.set()
        assert (await second.told("state"))["number"] == number + 1
        assert (await second.told("state"))["number"] == number + 2

    talk(studio, course)


def test_a_fault_of_ours_is_told_and_the_window_goes_on(
    studio: Studio, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    failing_once(studio.session, "receive", monkeypatch)

    async def course(first: Page, second: Page) -> None:
        first.says.put_nowait(EDIT)
        told = await first.told("refused")
        assert is_defect(told["problems"], capsys.readouterr().err)
        first.says.put_nowait(EDIT)
        assert (await second.told("state"))["edits"]

    talk(studio, course)


def test_so_is_one_in_what_everyone_is_told(
    studio: Studio, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def course(first: Page, second: Page) -> None:
        failing_once(studio.session, "fields", monkeypatch)
        first.says.put_nowait(EDIT)
        told = await first.told("refused")
        assert is_defect(told["problems"], capsys.readouterr().err)
        second.says.put_nowait(UNDO)
        assert (await first.told("fields"))["type"] == "fields"

    talk(studio, course)


def test_an_answer_that_cannot_be_told_does_not_silence_the_next(
    studio: Studio, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def course(first: Page, second: Page) -> None:
        failing_once(studio.session, "given", monkeypatch)
        number = studio.session.number
        studio.given.put_nowait(Given(number, "known", {"error": 1.0}))
        told = await first.told("answer")
        assert is_defect(told["problems"], capsys.readouterr().err)
        studio.given.put_nowait(Given(number, "shares", {"of": 2.0}))
        assert (await second.told("answer"))["name"] == "known"
        assert (await second.told("answer"))["value"] == {"of": 2.0}

    talk(studio, course)
