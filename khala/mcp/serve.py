"""The servers of a match: one over stdio, or one for each seat over streamable HTTP.

`khala.mcp.cli` above has the options.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
from typing import TYPE_CHECKING, Any

import typer
import uvicorn
from starlette.applications import Starlette
from starlette.routing import Mount

from khala.exit_codes import SIGNALLED
from khala.listening import bound
from khala.mcp.server import server_of
from khala_protocol.commandline import say
from khala_protocol.signals import SIGNALS

if TYPE_CHECKING:
    import signal
    from collections.abc import AsyncIterator, Iterator

    from khala.mcp.table import Table

HOST = "127.0.0.1"
"""The address to serve on: a seat has no password. The SDK refuses requests that a page of another site makes."""


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
        ConfigError: the port is taken.
    """
    servers = {seat: server_of(table, seat) for seat in table.seats}
    apps = {seat: server.streamable_http_app(host=HOST) for seat, server in servers.items()}

    @contextlib.asynccontextmanager
    async def running(_: Starlette) -> AsyncIterator[None]:
        async with contextlib.AsyncExitStack() as stack:
            await stack.enter_async_context(table)
            for server in servers.values():
                await stack.enter_async_context(server.session_manager.run())
            yield

    app = Starlette(routes=[Mount(f"/{seat}", app=one) for seat, one in apps.items()], lifespan=running)
    with bound(HOST, port) as listening:
        for seat in table.seats:
            say(f"{seat}: http://{HOST}:{listening.getsockname()[1]}/{seat}/mcp", err=True)
        server = _Server(uvicorn.Config(app, log_config=None, timeout_graceful_shutdown=1))
        signalled = _first_signal()
        signalled.add_done_callback(lambda _: server.end())
        await server.serve(sockets=[listening])
    if signalled.done():
        raise typer.Exit(SIGNALLED + signalled.result())


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
    for number in SIGNALS:
        loop.add_signal_handler(number, _resolve, signalled, number)
    return signalled


def _resolve(signalled: asyncio.Future[signal.Signals], number: signal.Signals) -> None:
    if not signalled.done():
        signalled.set_result(number)
