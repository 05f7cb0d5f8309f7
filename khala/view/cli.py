"""The command `khala view`; `khala.cli` mounts it."""

import asyncio
import contextlib
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from khala_orchestrator.console import stderr_console
from khala_protocol.errors import ConfigError
from khala_protocol.signals import cancelled_by_signal

if TYPE_CHECKING:
    from khala.view.guard import Guard
    from khala.view.server import Server

VIEW_EPILOG = """
Examples:\n
    khala view\n
    khala view 2s3z-20260101-120000-ab12\n
    khala view runs/a/run.mcap runs/b/run.mcap\n
    khala view my_experiment\n
"""
LOCAL = "127.0.0.1"


def view(
    given: Annotated[
        list[str] | None,
        typer.Argument(
            help="A recording, a run below runs/, or a directory; two to see them side by side.",
            metavar="[RUN|RECORDING|DIR]...", show_default="runs",
        ),
    ] = None,
    *,
    host: Annotated[str, typer.Option(help="Address to serve on; another than this machine's needs --password.")] = LOCAL,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to serve on; 0 for a free one.")] = 0,
    no_open: Annotated[bool, typer.Option("--no-open", help="Print the address, and open no browser.")] = False,
) -> None:  # fmt: skip
    """Look at matches in the browser: the map, what each agent saw, said and did, and what became of it.

    Serves a page on this machine alone, behind a token in its address.
    """
    from khala.view.guard import Guard  # noqa: PLC0415  # a web server, which --help need not wait for
    from khala.view.server import Server  # noqa: PLC0415
    from khala.view.sources import find  # noqa: PLC0415

    guard = Guard()
    server = Server(find(given or [], Path("runs")), guard)
    asyncio.run(cancelled_by_signal(_serve(server, guard, host, port, opens=not no_open)))


async def _serve(server: "Server", guard: "Guard", host: str, port: int, *, opens: bool) -> None:
    from aiohttp import web  # noqa: PLC0415

    runner = web.AppRunner(server.application(), access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    try:
        site = web.TCPSite(runner, host, port)
        try:
            await site.start()
        except OSError as error:
            raise ConfigError(f"{host}:{port} cannot be served: {error.strerror}; --port names another") from None
        address = f"http://{host}:{runner.addresses[0][1]}/?token={guard.token}"
        stderr_console().print(f"view at {address}\nCtrl-C ends it", soft_wrap=True, highlight=False)
        if opens:
            with contextlib.suppress(webbrowser.Error):
                await asyncio.to_thread(webbrowser.open, address)
        await asyncio.Event().wait()
    finally:
        await runner.cleanup()
