"""The websocket at `/sc2api`: frames in, frames out.

Requests come as text frames from PySC2 and as binary frames from python-sc2; both carry raw protobuf, so text is not
decoded. Connections come and go while the session lives on: the newest one is served, and older ones are dropped, so
that a client that vanished silently does not lock others out.

If a client disconnects while its request is being answered, the request is dropped.

A web page that somebody has open can reach every port of this machine, and a page cannot hide its origin. PySC2's
library sends an origin too, but that of the game itself; other clients send none.

It knows nothing of the game: that is `session.py`, called with the bytes of one request at a time.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import ipaddress
import socket

from aiohttp import WSMsgType, web

from khala_simulator.process.parent_watch import wait_until_orphaned
from khala_simulator.process.session import Session
from khala_simulator.process.status import Status

ENDPOINT = "/sc2api"
LARGEST_REQUEST = 256 * 2**20
"""Bytes of a request; the largest real one is a map that a client saves, of some 20 MB."""
_REQUESTS = {WSMsgType.TEXT, WSMsgType.BINARY}


class GameServer:
    """Serves one session to one client after the other."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.done = asyncio.Event()
        self._transport: asyncio.Transport | None = None
        self._turn = asyncio.Lock()  # a client that was replaced still has to learn that its request is dropped

    async def connect(self, request: web.Request) -> web.StreamResponse:
        """Answer one client until it leaves, is replaced, or ends the process with quit; refuse a web page."""
        if is_from_page(request):
            return web.Response(status=403, text="This is a game: its clients are programs, and no page of the web.\n")
        client = web.WebSocketResponse(decode_text=False, max_msg_size=LARGEST_REQUEST, compress=False, timeout=0.1)
        await client.prepare(request)
        before, self._transport = self._transport, request.transport
        if before is not None:
            before.abort()  # closing politely would wait for one that may be gone
        with contextlib.suppress(ConnectionError):  # a client need not wait for its last answer
            await self._answer(client)
        return client

    def has_client(self) -> bool:
        """Return whether a client is connected now."""
        return self._transport is not None and not self._transport.is_closing()

    async def _answer(self, client: web.WebSocketResponse) -> None:
        async for frame in client:
            if frame.type not in _REQUESTS:
                continue
            async with self._turn:
                answer = await self.session.answer(frame.data)
            try:
                await client.send_bytes(answer)
            finally:
                if self.session.status is Status.quit:
                    self.done.set()


def is_from_page(request: web.BaseRequest) -> bool:
    """Return whether a web page opened a connection, and no client of the game.

    A page's origin is not that of the game, or it is one whose owner points its name at this machine. Such a name has a
    dot; the addresses under which clients reach the game are numbers, the name of this machine, or names of a local
    network without a dot.
    """
    origins = request.headers.getall("Origin", [])
    host = request.headers.get("Host", "")
    if not origins:
        return False
    name = host.rpartition(":")[0] if host.rpartition(":")[2].isdecimal() else host
    is_ours = "." not in name or name.casefold() == socket.gethostname().casefold() or _is_address(name)
    return not is_ours or any(origin.casefold() != f"http://{host}".casefold() for origin in origins)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True


def run(sock: socket.socket, *, data_dir: str, base_build: int, data_version: str | None) -> None:
    """Serve on a listening socket until a client says quit."""
    session = Session(data_dir=data_dir, base_build=base_build, data_version=data_version)
    gc.collect()
    gc.freeze()  # tables and modules stay; collections in a game need not look at them again
    asyncio.run(serve(sock, session))


async def serve(sock: socket.socket, session: Session) -> None:
    """Serve the session on a listening socket until a client says quit, or no client is left that could."""
    server = GameServer(session)
    app = web.Application()
    app.router.add_get(ENDPOINT, server.connect)
    runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=0.1, handler_cancellation=True)
    await runner.setup()
    ends = [asyncio.create_task(server.done.wait()), asyncio.create_task(wait_until_orphaned(server.has_client))]
    try:
        await web.SockSite(runner, sock).start()
        await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for end in ends:
            end.cancel()
        await runner.cleanup()
