"""The servers of a match: one over stdio, or one for each seat over streamable HTTP.

`khala_sc2.mcp.cli` above has the options.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import os
import secrets
from typing import TYPE_CHECKING, Any

import typer
import uvicorn
from mcp.server.transport_security import TransportSecuritySettings
from starlette.applications import Starlette
from starlette.routing import Mount

from khala_protocol.commandline import say
from khala_protocol.listening import bind
from khala_protocol.platforms import on_signals
from khala_sc2.commands.exit_codes import SIGNALLED
from khala_sc2.doors.asgi import Guarded, head_of
from khala_sc2.doors.rules import TOKEN, Door, token_of
from khala_sc2.doors.serving import uvicorn_config
from khala_sc2.mcp.holder import Holder
from khala_sc2.mcp.server import CLIENT, client_of, server_of

if TYPE_CHECKING:
    import signal
    from collections.abc import AsyncIterator, Iterable, Iterator

    from khala_sc2.doors.asgi import Application, Message, Receive, Scope, Send
    from khala_sc2.mcp.table import Table
    from khala_sc2.playing.seats import Seat

HOST = "127.0.0.1"
"""The address to serve on: connections are not encrypted."""
TOKENS = "KHALA_MCP_TOKEN"
"""The variable with a token for all seats, which stays the same; without it each seat has a new one."""
METHOD, DISCOVER = "mcp-method", "server/discover"
"""The header that names the method of a request, and the method with which newer clients begin."""
MOST_BODY_BYTES = 65_536
"""Of a request: twice the longest answer."""


async def over_stdio(table: Table) -> None:
    """Serve the only seat of a table on stdin and stdout until the client closes them, or a signal comes."""
    (seat,) = table.seats
    signalled = _first_signal()
    async with table:
        serving = asyncio.create_task(server_of(table, seat).run_stdio_async())
        both: set[asyncio.Future[Any]] = {serving, signalled}
        await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
    if signalled.done():  # the SDK's thread still reads stdin, and Python would wait for it
        os._exit(SIGNALLED + signalled.result())
    serving.result()


async def over_http(table: Table, port: int) -> None:
    """Serve each seat of a table at an address of its own until a signal comes.

    Args:
        table: the match.
        port: on this machine; 0 for a free one.

    Raises:
        ConfigError: the port is taken, or the token that the environment gives can be guessed.
    """
    seats = [SeatAddress(table, seat) for seat in table.seats]

    @contextlib.asynccontextmanager
    async def running(_: Starlette) -> AsyncIterator[None]:
        async with contextlib.AsyncExitStack() as stack:
            await stack.enter_async_context(table)
            for seat in seats:
                await stack.enter_async_context(seat.server.session_manager.run())
            yield

    app = Starlette(routes=routes_of(seats), lifespan=running)
    with bind(HOST, port) as listening:
        for seat in seats:
            say(f"{seat.seat}: {seat.address(listening.getsockname()[1])}", err=True)
        server = _Server(uvicorn_config(app, timeout_graceful_shutdown=1))
        signalled = _first_signal()
        signalled.add_done_callback(lambda _: server.end())
        await server.serve(sockets=[listening])
    if signalled.done():
        raise typer.Exit(SIGNALLED + signalled.result())


def routes_of(seats: Iterable[SeatAddress]) -> list[Mount]:
    """Return the routes to seats, each behind its door."""
    return [Mount(f"/{seat.seat}", app=seat.app) for seat in seats]


class SeatAddress:
    """A seat behind a door of its own: its token opens no other seat."""

    def __init__(self, table: Table, seat: Seat) -> None:
        """Take a match and the seat."""
        self.seat = seat
        self._holder = Holder(str(seat))
        self.server = server_of(table, seat, self._holder)
        self._door = Door(
            command="khala mcp",
            token=token_of(TOKENS),
            most_body_bytes=MOST_BODY_BYTES,
            denied=403,  # of 401 clients think that they can log in
        )
        # the door has checked host and origin, more strictly than the SDK would
        unchecked = TransportSecuritySettings(enable_dns_rebinding_protection=False)
        self._served: Application = self.server.streamable_http_app(host=HOST, transport_security=unchecked)
        self.app = Guarded(self._name_client, self._door)

    def address(self, port: int) -> str:
        """Return the address for a client that plays the seat."""
        return f"http://{HOST}:{port}/{self.seat}/mcp?{TOKEN}={self._door.token}"

    async def _name_client(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, and give a client without a name one; free the seat whose client ends its session."""
        headers = dict(head_of(scope).headers)
        client = client_of(headers)
        if scope["method"] == "DELETE":
            self._holder.leave(client)
        elif headers.get(METHOD) == DISCOVER:
            self._holder.greet()

        async def send_named(message: Message) -> None:
            if message["type"] == "http.response.start" and not client:
                cookie = f"{CLIENT}={secrets.token_urlsafe(16)}; Path=/{self.seat}; HttpOnly; SameSite=Strict"
                message["headers"] = [*message.get("headers", ()), (b"set-cookie", cookie.encode())]
            await send(message)

        await self._served(scope, receive, send_named)


class _Server(uvicorn.Server):
    """A server that leaves signals to us: its own handlers end the process without an exit code of ours."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield

    def end(self) -> None:
        """End in order."""
        self.should_exit = True


def _first_signal() -> asyncio.Future[signal.Signals]:
    """Return the first signal that asks for an end, once it has come."""
    loop = asyncio.get_running_loop()
    signalled: asyncio.Future[signal.Signals] = loop.create_future()
    on_signals(functools.partial(_resolve, signalled))
    return signalled


def _resolve(signalled: asyncio.Future[signal.Signals], number: signal.Signals) -> None:
    if not signalled.done():
        signalled.set_result(number)
