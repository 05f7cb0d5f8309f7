"""The server of a view: the page, the answers of `khala_sc2.view.wire` by their paths, and a websocket of progress.

Answers are made in threads, so that none holds up another. The websocket says that there is more to see, never more
than the newest of it: a page that is slow misses progress, and nobody waits for it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import zlib
from collections import OrderedDict
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from aiohttp import WSMsgType, web
from pydantic import ValidationError

from khala_protocol.errors import KhalaError
from khala_sc2.doors.pages import guard
from khala_sc2.view.guard import policy_of, welcoming
from khala_sc2.view.runs import NotThere, Opened
from khala_sc2.view.wire import MOST_SCENES, AdviceNote, PageNote

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable

    from khala_sc2.doors.rules import Door
    from khala_sc2.view.sources import Sources

log = logging.getLogger(__name__)

WORTH_PACKING = 2_000
"""Bytes; shorter answers are not compressed."""
PROGRESS_S = 0.2
"""Between two lines of progress to a page at most."""
MOST_MESSAGE_BYTES = 16_384
"""Of what a page may send."""
FIRST_LOOK_S = 0.5
"""How long the first question about a recording waits for the begin of its index."""
MOST_OPEN = 8
"""Recordings that stay open; of more, the one that was not asked about for longest is closed."""
_JSON = "application/json"
NO_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>khala view</title>
<h1>The page is not built</h1><p>This checkout has no <code>khala_sc2/view/assets/index.html</code>:
<code>make page</code> builds it. The answers are below <code>/api</code>.</p></html>
"""


def page() -> str:
    """Return the built page; one that says how to build it, if it is missing."""
    with contextlib.suppress(FileNotFoundError):
        return files("khala_sc2.view").joinpath("assets", "index.html").read_text(encoding="utf-8")
    return NO_PAGE


class Server:
    """The web application of one view.

    Args:
        sources: what can be opened.
        door: who may ask.
        advise: sends advice to the agents of a run; None if the view may not.
    """

    def __init__(
        self,
        sources: Sources,
        door: Door,
        advise: Callable[[str, AdviceNote], Awaitable[None]] | None = None,
    ) -> None:
        self._sources, self._door, self._advise = sources, door, advise
        self._opened: OrderedDict[str, Opened] = OrderedDict()
        self._changed: dict[str, asyncio.Event] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._page = page()
        self._sockets: set[web.WebSocketResponse] = set()

    def application(self) -> web.Application:
        """Return the application."""
        middlewares = [guard(self._door), welcoming(self._door)]
        application = web.Application(middlewares=middlewares, client_max_size=self._door.most_body_bytes)
        episode, step = r"/api/runs/{run}/episodes/{episode:\d{1,9}}", r"/steps/{step:\d{1,9}}"
        application.add_routes([
            web.get("/", self._index),
            web.get("/api/library", self._library),
            web.get("/api/runs/{run}", self._view),
            web.get("/api/runs/{run}/live", self._live),
            web.get(r"/api/runs/{run}/images/{sha256:[0-9a-f]{64}}", self._image),
            web.get(f"{episode}/timeline", self._timeline),
            web.get(f"{episode}/terrain", self._terrain),
            web.get(f"{episode}/scenes", self._scenes),
            web.get(f"{episode}{step}", self._moment),
            web.get(f"{episode}{step}/agents/{{side}}/{{agent}}", self._texts),
            web.get("/api/experiments/{experiment}", self._experiment),
        ])  # fmt: skip
        application.cleanup_ctx.append(self._running)
        return application

    async def _running(self, _: web.Application) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        yield
        for socket in list(self._sockets):
            await socket.close()
        for opened in self._opened.values():
            await asyncio.to_thread(opened.close)

    # --- answers ------------------------------------------------------------------------------------

    async def _index(self, _: web.Request) -> web.Response:
        headers = {"Content-Security-Policy": policy_of(self._page)}
        return web.Response(text=self._page, content_type="text/html", headers=headers)

    async def _library(self, request: web.Request) -> web.Response:
        return await self._answer(request, lambda: self._sources.library().model_dump_json().encode())

    async def _experiment(self, request: web.Request) -> web.Response:
        name = request.match_info["experiment"]
        return await self._answer(request, lambda: self._sources.experiment(name).model_dump_json().encode())

    async def _view(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        return await self._answer(request, opened.view)

    async def _timeline(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        episode = _number(request, "episode")
        return await self._answer(request, lambda: opened.timeline(episode))

    async def _terrain(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        episode = _number(request, "episode")
        return await self._answer(request, lambda: opened.terrain(episode))

    async def _scenes(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        episode = _number(request, "episode")
        first, last = (_asked_number(request, name) for name in ("from", "to"))
        if not 0 <= last - first < MOST_SCENES:
            raise web.HTTPBadRequest(text=f"ask for 1 to {MOST_SCENES} scenes: from={first} and to={last} are not\n")
        return await self._answer(request, lambda: opened.scenes(episode, first, last))

    async def _moment(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        episode = _number(request, "episode")
        step = _number(request, "step")
        return await self._answer(request, lambda: opened.moment(episode, step))

    async def _texts(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        episode = _number(request, "episode")
        step = _number(request, "step")
        side, agent = request.match_info["side"], request.match_info["agent"]
        return await self._answer(request, lambda: opened.texts(episode, step, side, agent))

    async def _image(self, request: web.Request) -> web.Response:
        opened = await self._run(request)
        digest = request.match_info["sha256"]
        kind, data = await self._made(lambda: opened.picture(digest))
        headers = {"Cache-Control": "private, max-age=86400, immutable"}
        return web.Response(body=data, content_type=kind, headers=headers)

    async def _answer(self, request: web.Request, make: Callable[[], bytes]) -> web.Response:
        packs = "gzip" in request.headers.get("Accept-Encoding", "")

        def made() -> tuple[bytes, bool]:
            data = make()
            return (_pack(data), True) if packs and len(data) > WORTH_PACKING else (data, False)

        data, is_packed = await self._made(made)
        headers = {"Content-Encoding": "gzip"} if is_packed else {}
        return web.Response(body=data, content_type=_JSON, charset="utf-8", headers=headers)

    async def _made(self, make: Callable[[], Any]) -> Any:
        """Return what a function returns that reads files, in a thread."""
        try:
            return await asyncio.to_thread(make)
        except NotThere as error:
            raise web.HTTPNotFound(text=f"{error}\n") from None
        except KhalaError as error:
            raise web.HTTPConflict(text=f"{error}\n") from None

    # --- recordings ---------------------------------------------------------------------------------

    async def _run(self, request: web.Request) -> Opened:
        """Return the recording that a path names, and begin to index one that is new."""
        name = request.match_info["run"]
        if (known := self._opened.get(name)) is not None and not known.index.is_broken:
            self._opened.move_to_end(name)
            return known
        if known is not None:
            await self._forget(name)
        opened: Opened = await self._made(lambda: self._sources.open(name, lambda: self._notice(name)))
        if name in self._opened:  # two requests at once
            await asyncio.to_thread(opened.index.close)
            return self._opened[name]
        self._opened[name] = opened
        self._changed[name] = begun = asyncio.Event()
        opened.start()
        with contextlib.suppress(TimeoutError):  # so that the first answers are not empty
            await asyncio.wait_for(begun.wait(), FIRST_LOOK_S)
        await self._close_oldest()
        return opened

    async def _close_oldest(self) -> None:
        while len(self._opened) > MOST_OPEN:
            await self._forget(next(iter(self._opened)))

    async def _forget(self, name: str) -> None:
        oldest = self._opened.pop(name)
        del self._changed[name]
        await asyncio.to_thread(oldest.close)

    def _notice(self, name: str) -> None:
        """Note in another thread that there is more in an index."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._wake, name)

    def _wake(self, name: str) -> None:
        if (event := self._changed.get(name)) is not None:
            event.set()
            self._changed[name] = asyncio.Event()

    # --- live ---------------------------------------------------------------------------------------

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        opened = await self._run(request)
        socket = web.WebSocketResponse(max_msg_size=MOST_MESSAGE_BYTES, heartbeat=20.0)
        await socket.prepare(request)
        self._sockets.add(socket)
        telling = asyncio.create_task(self._say_progress(socket, opened), name="say progress")
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT:
                    await socket.send_str((await self._pass_advice_on(opened, message.data)).model_dump_json())
        finally:
            self._sockets.discard(socket)
            telling.cancel()
            await asyncio.wait([telling])
        return socket

    async def _say_progress(self, socket: web.WebSocketResponse, opened: Opened) -> None:
        """Send the newest progress whenever there is more, and each second: a host that died ends a match silently."""
        with contextlib.suppress(ConnectionError):
            while not socket.closed:
                changed = self._changed.get(opened.id)
                progress = await self._made(opened.progress)
                await socket.send_str(progress.model_dump_json())
                if changed is None or (progress.indexed >= 1.0 and not progress.live):
                    return
                await asyncio.sleep(PROGRESS_S)
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(changed.wait(), 1.0)

    async def _pass_advice_on(self, opened: Opened, text: str) -> PageNote:
        if self._advise is None or not opened.may_advise:
            what = "start it with --adviser NAME, an adviser that the task names"
            return PageNote(ok=False, text=f"this view may not write to agents: {what}")
        try:
            await self._advise(opened.run, AdviceNote.model_validate_json(text))
        except ValidationError:
            return PageNote(ok=False, text="this is no advice: it has a side, a recipient and a text")
        except KhalaError as error:
            return PageNote(ok=False, text=str(error))
        return PageNote(ok=True, text="sent: the host says in a message what became of it")


def _number(request: web.Request, name: str) -> int:
    return int(request.match_info[name])


def _asked_number(request: web.Request, name: str) -> int:
    given = request.query.get(name, "")
    if not (given.isascii() and given.isdigit() and len(given) <= 9):
        raise web.HTTPBadRequest(text=f"{name}= is missing or no number of a step\n")
    return int(given)


def _pack(data: bytes) -> bytes:
    """Return gzip of the bytes, quickly: pages are on the same machine most of the time."""
    packer = zlib.compressobj(1, zlib.DEFLATED, 31)
    return packer.compress(data) + packer.flush()
