"""The studio's server: the page, one WebSocket and dropped files, on the only socket it listens on.

It knows the network and the clock; `shared_state` knows what messages mean, `evaluation` what they
ask. Everything goes through `access` first.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import socket
import sys
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import uvicorn
import websockets  # noqa: F401 uvicorn imports it late: who lacks it is told at once
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from truepose.errors import Problem, TrueposeError
from truepose.language import spoken
from truepose.studio import messages, report_page
from truepose.studio.access import Access
from truepose.studio.evaluation import Evaluator, by_itself
from truepose.studio.jobs import Given, problems_of
from truepose.studio.page import studio_page
from truepose.studio.shared_state import LARGEST_FILE, Replies, SharedState, refused, too_large
from truepose.studio.state_file import KeptState, write_state
from truepose.version import version

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Asgi = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOK_EVERY = 1.0
"""s between two looks at the machine file on the disk."""
MOST_WAITING = 400
"""Messages that wait for a window; one that takes no more is closed, and comes again."""
PORTS_TRIED = 20
"""Ports after the one wanted, before any that is free."""

MOST_QUOTED = 1000
"""Characters of a refused message that are told back."""

FORBIDDEN, TOO_LARGE, UNPROCESSABLE = 403, 413, 422
GOING, TOO_SLOW = 1001, 1013
"""Codes with which a WebSocket is closed."""
GONE = (WebSocketDisconnect, asyncio.CancelledError, KeyError, RuntimeError, OSError)
"""What a WebSocket raises where its page is gone."""

HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class Guarded:
    """An application that is reached only by what `access` lets in, whatever it asks for."""

    def __init__(self, app: Asgi, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or refuse with 403 and nothing else."""
        if scope["type"] not in ("http", "websocket"):
            return
        method = scope["method"] if scope["type"] == "http" else "WEBSOCKET"
        if self._access.refuses(method, scope["headers"], scope["query_string"]) is None:
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": GOING})
        else:
            response = PlainTextResponse("Forbidden.\n", FORBIDDEN, HEADERS)
            await response(scope, receive, send)


class _Window:
    """One page that is open: its number, what it said, and what it is yet to be told."""

    def __init__(self, number: int, page: WebSocket) -> None:
        self.number, self._page = number, page
        self._waiting: asyncio.Queue[str] = asyncio.Queue(MOST_WAITING)
        self._said: deque[tuple[str, messages.Received | TrueposeError]] = deque()
        self._heard, self._room = asyncio.Event(), asyncio.Semaphore(MOST_WAITING)
        self._slow = False

    def tell(self, text: str) -> None:
        """Tell it, unless it takes nothing any more."""
        try:
            self._waiting.put_nowait(text)
        except asyncio.QueueFull:
            self._slow = True

    async def send(self) -> None:
        """Send what waits, until it is slow or gone."""
        while not self._slow:
            await self._page.send_text(await self._waiting.get())
        await self._page.close(TOO_SLOW)

    async def hear(self) -> None:
        """Take what it says, until it is gone."""
        while True:
            text = await self._page.receive_text()
            await self._room.acquire()
            try:
                self._said.append((text, messages.received(text)))
            except TrueposeError as failure:
                self._said.append((text, failure))
            self._heard.set()

    async def next_said(self) -> tuple[str, messages.Received | TrueposeError]:
        """The next that it said, and what that means; of what waits, one in place of several."""
        while not self._said:
            self._heard.clear()
            await self._heard.wait()
        text, message = self._taken()
        while self._said and not isinstance(message, TrueposeError):
            later_text, later = self._said[0]
            both = None
            if not isinstance(later, TrueposeError):
                both = messages.in_place_of(message, later)
            if both is None:
                break
            self._taken()
            text, message = later_text, both
        return text, message

    def _taken(self) -> tuple[str, messages.Received | TrueposeError]:
        self._room.release()
        return self._said.popleft()


class Studio:
    """A session on the network: its windows, its evaluation, its file on the disk."""

    def __init__(self, session: SharedState, access: Access, state: Path | None = None) -> None:
        """`state`: where what outlives it is kept; None: nowhere."""
        self.session, self.access, self._state = session, access, state
        self._windows: dict[int, _Window] = {}
        self._next = 1
        self._lock = asyncio.Lock()
        # Machines, texts and pages are made by one thread: malloc gives each an arena of its own,
        # and several would each keep the most that they ever had. A report is waited for apart.
        self._maker = ThreadPoolExecutor(1, "making")
        self._reporter = ThreadPoolExecutor(1, "report")
        self.given: asyncio.Queue[Given] = asyncio.Queue()
        """Answers that are to be told."""
        self._evaluation: Evaluator | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._taking: set[asyncio.Task[None]] = set()
        self._process: Any = None
        self._stopped = False
        self.not_kept = ""
        routes = [
            Route("/", self._page, methods=["GET"]),
            Route("/report", self._report, methods=["GET"]),
            Route("/files", self._drop, methods=["POST"]),
            WebSocketRoute("/socket", self.conversation),
        ]
        self.app: Asgi = Guarded(Starlette(routes=routes), access)

    async def begin(self) -> None:
        """Start the evaluation, and look after the file."""
        loop = asyncio.get_running_loop()
        loop.set_default_executor(self._maker)

        def tell(given: Given) -> None:
            with suppress(RuntimeError):  # the loop is closed: the studio ends
                loop.call_soon_threadsafe(self.given.put_nowait, given)

        self._evaluation = Evaluator(tell)
        self._tasks = [asyncio.create_task(self.hand_on()), asyncio.create_task(self._watch())]
        await self._keep()

    def stop(self) -> None:
        """End what is made in a process of its own: the loop would wait for it."""
        self._stopped = True
        if self._process is not None:
            self._process.kill()

    @property
    def open_windows(self) -> int:
        """How many pages it talks with."""
        return len(self._windows)

    def _note_process(self, process: Any) -> None:
        self._process = process
        if self._stopped:
            process.kill()

    def end(self) -> None:
        """End the process that answers. The loop is over, and with it all else."""
        if self._evaluation is not None:
            self._evaluation.close()

    # --- requests

    async def _page(self, request: Request) -> Response:
        async with self._lock:
            machine = self.session.machine
        page = await asyncio.to_thread(studio_page, machine, request.headers["host"])
        policy = {"Content-Security-Policy": page.policy}
        return Response(page.text, headers=HEADERS | policy, media_type="text/html")

    async def _report(self, request: Request) -> Response:
        """The report of what is set now; one is made at a time."""
        async with self._lock:
            path, text = self.session.file.path, self.session.text
        language = spoken().code

        def make() -> Any:
            return by_itself(report_page.work, path, text, language, started=self._note_process)

        try:
            made = await asyncio.get_running_loop().run_in_executor(self._reporter, make)
        except EOFError:  # ended by the system, for want of memory
            made = ()
        if not isinstance(made, str):
            problems = [problem.to_dict() for problem in made]
            return JSONResponse({"problems": problems}, UNPROCESSABLE, HEADERS)
        # The policy that stands in the page holds too: it may load nothing.
        policy = {"Content-Security-Policy": "frame-ancestors 'none'"}
        return Response(made, headers=HEADERS | policy, media_type="text/html")

    async def _drop(self, request: Request) -> Response:
        name = request.query_params.get("name", "")[:200] or "file"
        try:
            content = await _body(request, name)
        except TrueposeError as failure:
            return JSONResponse({"problems": problems_of(failure)}, TOO_LARGE, HEADERS)
        async with self._lock:
            number = self.session.drop(name, content)
            self._tell_everyone([self.session.state()])
        answer = {"file": number, "name": name, "size": len(content)}
        return JSONResponse(answer, headers=HEADERS)

    async def conversation(self, page: WebSocket) -> None:
        """Talk with a page, until it is gone."""
        await page.accept()
        window = _Window(self._next, page)
        self._next += 1
        async with self._lock:
            self._windows[window.number] = window
            self._tell([window], await asyncio.to_thread(self.session.greeting))
            self._ask()
        tasks = [asyncio.create_task(of) for of in (window.hear(), window.send())]
        tasks.append(asyncio.create_task(self._converse(window)))
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._windows.pop(window.number, None)
            for task in tasks:
                task.cancel()
            for ended in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(ended, BaseException) and not isinstance(ended, GONE):
                    _noted_defect(ended)
            async with self._lock:
                self.session.left(window.number)

    async def _converse(self, window: _Window) -> None:
        """Take what a window says, one after the other."""
        while True:
            text, message = await window.next_said()
            # To its end even where the window goes meanwhile: else the state is changed by a thread
            # that nobody waits for, and no other window is told of it.
            taking = asyncio.create_task(self._take(window, text, message))
            self._taking.add(taking)
            taking.add_done_callback(self._taking.discard)
            await asyncio.shield(taking)

    async def _take(
        self, window: _Window, text: str, message: messages.Received | TrueposeError
    ) -> None:
        """Take one message of a window: it is told the answer, all are told what changed."""
        async with self._lock:
            try:
                if isinstance(message, TrueposeError):
                    raise message
                told = await asyncio.to_thread(self.session.receive, message, window.number)
                self._tell([window], told.sender)
                await self._told(told)
            except TrueposeError as failure:
                self._tell([window], [refused(text[:MOST_QUOTED], failure)])
            except Exception as defect:
                problems = [_noted_defect(defect)]
                said = {"type": "refused", "of": text[:MOST_QUOTED], "problems": problems}
                self._tell([window], [said])

    # --- what is told

    async def _told(self, told: Replies) -> None:
        self._tell_everyone(told.everyone)
        if told.ask:
            self._ask()
        if told.fields:
            self._tell_everyone(await asyncio.to_thread(self.session.fields))
        if told.ask:
            await self._keep()

    def _tell_everyone(self, said: Iterable[dict[str, Any]]) -> None:
        self._tell(list(self._windows.values()), said)

    def _tell(self, windows: list[_Window], said: Iterable[dict[str, Any]]) -> None:
        for message in said:
            text = messages.written(message)
            for window in windows:
                window.tell(text)

    def _ask(self) -> None:
        """Have answered what is due, if anybody looks."""
        job = self.session.job()
        if job is not None and self._windows and self._evaluation is not None:
            self._tell_everyone([self.session.computing()])
            self._evaluation.ask(job)

    async def hand_on(self) -> None:
        """Tell windows what was worked out."""
        while True:
            given = await self.given.get()
            async with self._lock:
                try:
                    self._give(given)
                except Exception as defect:
                    self._give(replace(given, value=None, problems=[_noted_defect(defect)]))

    def _give(self, given: Given) -> None:
        """Tell an answer to whom it is for."""
        for numbers, message in self.session.given(given):
            windows = self._windows
            chosen = windows if numbers is None else [n for n in numbers if n in windows]
            self._tell([windows[number] for number in chosen], [message])

    async def _watch(self) -> None:
        """See the machine file change on the disk."""
        path, seen, read = self.session.file.path, "", None
        while True:
            await asyncio.sleep(LOOK_EVERY)
            looks, file = await asyncio.to_thread(_looks, path), self.session.file
            # One that was read again meanwhile is not known to have changed, however it looks.
            if looks == seen and file is read:
                continue
            seen, read = looks, file
            digest = await asyncio.to_thread(_digest, path)
            async with self._lock:
                try:
                    await self._told(self.session.file_is(digest))
                except Exception as defect:
                    _noted_defect(defect)

    async def _keep(self) -> None:
        """Write what outlives the studio."""
        if self._state is None:
            return
        kept = KeptState(self.access.token, self.access.port, self.session.history)
        try:
            await asyncio.to_thread(write_state, self._state, kept)
        except OSError as failure:
            self.not_kept = failure.strerror or str(failure)


def _noted_defect(defect: BaseException) -> dict[str, Any]:
    """Say on stderr, in a line, that we are at fault, and the same for a page, as a problem.

    Its code is no `Problem`'s: those are of input, and each has an explanation.
    """
    what = f"{type(defect).__name__} ({' '.join(str(defect).split())[:200]})"
    sentence = f"this is a defect of truepose {version()}, not of your input"
    sys.stderr.write(f"Error: {sentence}: {what}.\n")
    unsaid = dict.fromkeys(field.name for field in fields(Problem))
    return {**unsaid, "code": "defect", "message": sentence, "found": what}


def _looks(path: Path) -> str:
    try:
        status = path.stat()
    except OSError:
        return "gone"
    return f"{status.st_mtime_ns} {status.st_size} {status.st_ino}"


def _digest(path: Path) -> str | None:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None


async def _body(request: Request, name: str) -> bytes:
    """The body of a request. Raises `RequestError` (file-too-large) before it is all there."""
    length = request.headers.get("content-length", "0")
    if not length.isdigit() or int(length) > LARGEST_FILE:
        raise too_large(name)
    content = bytearray()
    async for chunk in request.stream():
        content += chunk
        if len(content) > LARGEST_FILE:
            raise too_large(name)
    return bytes(content)


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens at a port, the next one that is free where another process has it.

    Raises `OSError` where the host is none of this computer's.
    """
    family, _, _, _, address = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0]
    for wanted in (*range(port, min(port + PORTS_TRIED, 65_536)), 0):
        one = socket.socket(family, socket.SOCK_STREAM)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            one.bind((address[0], wanted))
            one.listen()
        except OSError:
            one.close()
            if wanted == 0:
                raise
            continue
        return one
    raise OSError("no port is free")


def serve(studio: Studio, at: socket.socket, ready: Callable[[], None]) -> None:
    """Serve until it is interrupted. `ready` is called once it answers.

    Raises `KeyboardInterrupt`.
    """
    logging.getLogger("uvicorn").setLevel(logging.CRITICAL)
    config = uvicorn.Config(
        studio.app,
        http="h11",
        ws="websockets-sansio",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        access_log=False,
        server_header=False,
        date_header=False,
        ws_max_size=messages.MOST_RECEIVED,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)

    async def run() -> None:
        await studio.begin()
        ready()
        try:
            await server.serve(sockets=[at])
        finally:
            studio.stop()
        await asyncio.sleep(0)  # where a signal that was taken meanwhile is raised again

    try:
        asyncio.run(run())
    finally:
        studio.end()


__all__ = ["Studio", "listening", "serve"]
