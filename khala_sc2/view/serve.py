"""Run a view: find what is to be seen, follow a match if it is on a bus, serve the page, or write it into a file."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import ssl
import sys
import tempfile
import webbrowser
from dataclasses import dataclass
from getpass import getpass
from pathlib import Path
from typing import TYPE_CHECKING

from aiohttp import web

from khala_orchestrator.console import stderr_console
from khala_orchestrator.past.transcript import StepSelection
from khala_protocol.bus.config import is_loopback
from khala_protocol.errors import ConfigError
from khala_protocol.files import read_limited
from khala_protocol.joining import client_config
from khala_protocol.listening import Patience, bind
from khala_protocol.signals import cancelled_by_signal
from khala_sc2.commands.exit_codes import SIGNALLED
from khala_sc2.doors.rules import TOKEN
from khala_sc2.view.export import export
from khala_sc2.view.guard import view_door
from khala_sc2.view.server import Server, page
from khala_sc2.view.sources import Sources, find

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Sequence

    from khala_sc2.doors.rules import Door

RUNS = Path("runs")
EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104  # they are recognised, not listened on
PASSWORD = "KHALA_VIEW_PASSWORD"  # noqa: S105  # the name of its variable
MOST_PASSWORD_BYTES = 4096
HANDSHAKE_S = 10.0
"""Longest time for TLS to begin."""
SWITCH_S = 0.001
"""An index is made in a thread; answers wait no longer than this for Python's lock, a fifth of the usual."""


@dataclass(frozen=True, slots=True)
class ViewOptions:
    """What `khala view` was asked for; see its options."""

    given: tuple[str, ...]
    connect: tuple[str, ...] = ()
    tls: Path | None = None
    insecure: bool = False
    adviser: str = ""
    host: str = "127.0.0.1"
    port: int = 0
    asks_password: bool = False
    password_file: Path | None = None
    https: tuple[Path, Path] | None = None
    published: str = ""
    """`127.0.0.1:PORT`, where a container's port is published; "" if it is in no container."""
    opens: bool = True


def run_view(options: ViewOptions) -> None:
    """Serve until a signal ends it.

    Raises:
        KhalaError: there is nothing to be seen, or it cannot be served so.
    """
    context = tls_context(options.https)
    door = door_of(options)
    sys.setswitchinterval(SWITCH_S)
    ended = asyncio.run(cancelled_by_signal(_view(options, door, context)))
    if isinstance(ended, signal.Signals):
        raise SystemExit(SIGNALLED + ended)


def run_export(options: ViewOptions, path: Path, *, steps: str | None, agents: Sequence[str]) -> None:
    """Write a view into a file.

    Raises:
        KhalaError: there is nothing to export, or too much.
    """
    if options.connect:
        raise ConfigError("an export needs a recording: name one, or watch the match without --export")
    size = export(find(options.given, RUNS), page(), path, steps=StepSelection.of(None, steps), agents=agents)
    stderr_console().print(f"{path}: {size / 1e6:.1f} MB, opens in a browser without a server", soft_wrap=True)


def door_of(options: ViewOptions) -> Door:
    """Return the rules for who may ask.

    Raises:
        ConfigError: other machines could reach it without a password and without TLS.
    """
    near = is_near(options.published.rpartition(":")[0] if options.published else options.host)
    if options.published and not near:
        raise ConfigError(f"{options.published} is no port of this machine alone: give 127.0.0.1:PORT",
                          source="--published")  # fmt: skip
    password = password_of(options)
    if not near and not password and options.https is None:
        raise ConfigError(
            f"{options.host} can be reached by other machines, and recordings hold prompts and replies: "
            "give --password, or --https CERT KEY, or leave --host out and connect through `ssh -L`"
        )
    return view_door(
        password=password,
        is_near=near,
        is_published=bool(options.published),
        is_secure=options.https is not None,
    )


def password_of(options: ViewOptions) -> str:
    """Return the password of a view, "" for none. No option holds it: every user of a machine can read those.

    Raises:
        ConfigError: its file cannot be read, or there is nothing in it.
    """
    if options.password_file is None:
        return getpass("Password: ") if options.asks_password else os.environ.get(PASSWORD, "")
    try:
        password = read_limited(options.password_file, MOST_PASSWORD_BYTES).decode().partition("\n")[0].rstrip("\r")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is no text in UTF-8"
        raise ConfigError(f"{options.password_file} cannot be read: {why}", source="--password-file") from None
    if not password:
        raise ConfigError(f"{options.password_file} is empty: its first line is the password", source="--password-file")
    return password


def is_near(host: str) -> bool:
    """Return True if only this machine can reach an address, as people write it."""
    return is_loopback(host.strip("[]").casefold())


def tls_context(https: tuple[Path, Path] | None, *, option: str = "--https") -> ssl.SSLContext | None:
    """Return the context of a server with a certificate and its key; None without them.

    Raises:
        ConfigError: they are not in PEM; it names the option.
    """
    if https is None:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    try:
        context.load_cert_chain(*https)
    except (OSError, ssl.SSLError) as error:
        names = " and ".join(map(str, https))
        raise ConfigError(f"{option}: {names} are not a certificate and its key in PEM: {error}") from None
    return context


async def _view(options: ViewOptions, door: Door, context: ssl.SSLContext | None) -> None:
    async with contextlib.AsyncExitStack() as stack:
        sources = await stack.enter_async_context(_sources(options))
        advise = None
        if options.adviser:
            from khala_sc2.view.advice import Advisers  # noqa: PLC0415  # loads the native library of the bus

            advisers = Advisers(options.adviser, options.connect, options.tls, insecure=options.insecure)
            stack.push_async_callback(advisers.close)
            advise = advisers.send
        server = Server(sources, door, advise)
        runner = web.AppRunner(server.application(), access_log=None, shutdown_timeout=1.0)
        stack.push_async_callback(runner.cleanup)
        await runner.setup()
        port = await stack.enter_async_context(serving(runner, options.host, options.port, context))
        scheme = "https" if door.is_secure else "http"
        place = options.published or f"{name_of(options.host)}:{port}"
        address = f"{scheme}://{place}/?{TOKEN}={door.token}"
        stderr_console().print(f"{sources.title}: {address}\nCtrl-C ends it", soft_wrap=True, highlight=False)
        if options.opens:
            with contextlib.suppress(webbrowser.Error):
                await asyncio.to_thread(webbrowser.open, address)
        await asyncio.Event().wait()


def name_of(host: str) -> str:
    """Return the name under which a browser finds the server."""
    if host in EVERYWHERE:
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host


@contextlib.asynccontextmanager
async def serving(
    runner: web.AppRunner, host: str, port: int, context: ssl.SSLContext | None, *, option: str = "--port"
) -> AsyncIterator[int]:
    """Take connections for the application, and yield the port."""
    assert runner.server is not None
    patience = Patience(runner.server)
    listening = bind(host.strip("[]"), port, option=option)
    handshake_s = None if context is None else HANDSHAKE_S
    server = await asyncio.get_running_loop().create_server(
        patience, sock=listening, ssl=context, ssl_handshake_timeout=handshake_s
    )
    try:
        yield listening.getsockname()[1]
    finally:
        server.close()


@contextlib.asynccontextmanager
async def _sources(options: ViewOptions) -> AsyncIterator[Sources]:
    """Yield what is to be seen; a match on a bus is recorded meanwhile."""
    if not options.connect:
        yield find(options.given, RUNS, adviser=options.adviser)
        return
    from khala_protocol.bus.zenoh import open_bus  # noqa: PLC0415  # loads the native library
    from khala_protocol.recording import Recorder  # noqa: PLC0415
    from khala_sc2.view.live import Following, running_match  # noqa: PLC0415

    if len(options.given) > 1:
        raise ConfigError("one match is followed at a time: name one run, or none if only one is played there")
    names = ("observer", "host")
    bus = await open_bus(client_config(options.connect, tls=options.tls, names=names, insecure=options.insecure))
    async with contextlib.AsyncExitStack() as stack:
        stack.push_async_callback(bus.close)
        name = options.given[0] if options.given else None
        stderr_console().print(f"looking for {name or 'a match'} at {', '.join(bus.endpoints)}", soft_wrap=True)
        card = await running_match(bus, name)
        directory = stack.enter_context(tempfile.TemporaryDirectory(prefix="khala-view-", ignore_cleanup_errors=True))
        path = Path(directory) / f"{card.run}.mcap"
        recorder = Recorder(path)
        following = asyncio.create_task(Following(bus, card, recorder).follow(), name="follow")
        try:
            yield Sources(f"{card.run}, live", None, [path], adviser=options.adviser)
        finally:
            following.cancel()
            await asyncio.wait([following])
