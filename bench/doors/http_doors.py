"""Rows of the servers that speak HTTP: `khala view`, `mcp`, `openenv`, `llm` and the metrics of `khala serve`.

Each row first asks as an honest client does, so a row that is held is held by the guard. Servers run in this process on
loopback, with the applications and the configuration of the commands. Where a match is played meanwhile, it has to go
on, and its next step must not take longer than `STEP_S`.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import os
import secrets
import socket
import time
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

import httpx
import uvicorn
from aiohttp import web
from mcp import Client
from mcp.server.mcpserver.exceptions import ToolError
from starlette.applications import Starlette
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from bench.doors.rows import Row, Skipped
from khala_agents.scripted.endpoint import MOST_CONNECTIONS as MOST_OF_ENDPOINT
from khala_agents.scripted.endpoint import Endpoint
from khala_orchestrator.config import MatchConfig, load_task
from khala_protocol.listening import HEAD_S, MOST_CONNECTIONS, Patience, bind
from khala_sc2.doors.serving import uvicorn_config
from khala_sc2.mcp.serve import SeatAddress, routes_of
from khala_sc2.mcp.table import Table
from khala_sc2.openenv.client import KhalaAction, KhalaEnv
from khala_sc2.openenv.server import MOST_WAITING, app_of, openenv_door, server_config
from khala_sc2.playing.minds import Minds
from khala_sc2.playing.seats import seats_of, without_time_limit
from khala_sc2.service.metrics import Metrics
from khala_sc2.view.guard import view_door
from khala_sc2.view.server import Server
from khala_sc2.view.sources import Sources

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
    from contextlib import AbstractAsyncContextManager
    from pathlib import Path

    from khala_sc2.doors.asgi import Application
    from khala_sc2.doors.rules import Door

    Serving = Callable[[Path], AbstractAsyncContextManager["Target"]]

STEP_S: Final = 3.0
"""Longest time for a step of an honest client during an attack; a step takes 20 ms, and machines are busy."""
ANSWER_S: Final = 10.0
INITIALIZE: Final = json.dumps({
    "jsonrpc": "2.0", "id": 1, "method": "initialize",
    "params": {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "doors", "version": "1"}},
}).encode()  # fmt: skip
EVIL: Final = "http://evil.example"


@dataclass(frozen=True, slots=True)
class Target:
    """A server, and a request that an honest client makes of it.

    Attributes:
        port: on loopback.
        path: with the token, if there is one.
        method: of the request.
        body: of the request.
        headers: that the request needs.
        door: its rules, where a row needs its secrets.
        most: number of connections that the server takes.
    """

    port: int
    path: str
    method: str = "GET"
    body: bytes = b""
    headers: tuple[str, ...] = ()
    door: Door | None = None
    most: int = MOST_CONNECTIONS

    @property
    def host(self) -> str:
        """What an honest client writes into `Host`."""
        return f"127.0.0.1:{self.port}"


# --- the servers --------------------------------------------------------------------------------------


class _Uvicorn(uvicorn.Server):
    """A server that leaves signals to the suite."""

    @contextlib.contextmanager
    def capture_signals(self) -> Any:
        yield


@asynccontextmanager
async def _serve(config: uvicorn.Config) -> AsyncIterator[int]:
    """Serve an ASGI application, and yield the port."""
    server = _Uvicorn(config)
    with bind("127.0.0.1", 0) as listening:
        task = asyncio.create_task(server.serve(sockets=[listening]))
        try:
            yield listening.getsockname()[1]
        finally:
            server.should_exit = True
            await task


@asynccontextmanager
async def openenv(directory: Path, *, sessions: int = 2, door: Door | None = None) -> AsyncIterator[Target]:
    """Serve `khala openenv`."""
    del directory
    app = app_of(sessions=sessions, door=door)
    async with _serve(server_config(app, timeout_graceful_shutdown=1)) as port:
        query = f"?token={door.token}" if door is not None else ""
        yield Target(port, f"/schema{query}", door=door)


@asynccontextmanager
async def mcp(directory: Path) -> AsyncIterator[Target]:
    """Serve `khala mcp`: the target is its first seat."""
    task = without_time_limit(load_task("2s3z_pair"))
    config = MatchConfig(task=task, run="doors", record=directory / "recording.mcap", assemble_s=20)
    table = Table(config, seats_of(config.task)[:1], {"blue": Minds().with_name("silent")})
    seat = SeatAddress(table, table.seats[0])
    app: Application = Starlette(routes=routes_of([seat]), lifespan=partial(_running, table, seat))
    async with _serve(uvicorn_config(app, timeout_graceful_shutdown=1)) as port:
        address = urlsplit(seat.address(port))
        yield Target(
            port,
            f"{address.path}?{address.query}",
            "POST",
            INITIALIZE,
            ("Content-Type: application/json", "Accept: application/json, text/event-stream"),
        )


@asynccontextmanager
async def _running(table: Table, seat: SeatAddress, _: Starlette) -> AsyncIterator[None]:
    async with table, seat.server.session_manager.run():
        yield


@asynccontextmanager
async def view(directory: Path, *, door: Door | None = None) -> AsyncIterator[Target]:
    """Serve `khala view` of an empty directory."""
    door = door or view_door()
    runner = web.AppRunner(Server(Sources("doors", directory, []), door).application(), shutdown_timeout=1.0)
    await runner.setup()
    assert runner.server is not None
    try:
        with bind("127.0.0.1", 0) as listening:
            await asyncio.get_running_loop().create_server(Patience(runner.server), sock=listening)
            yield Target(listening.getsockname()[1], f"/api/library?token={door.token}", door=door)
    finally:
        await runner.cleanup()


@asynccontextmanager
async def metrics(directory: Path) -> AsyncIterator[Target]:
    """Serve the metrics of `khala serve`."""
    del directory
    async with Metrics().serve(0) as port:
        yield Target(port, "/metrics")


@asynccontextmanager
async def llm(directory: Path) -> AsyncIterator[Target]:
    """Serve `khala llm`."""
    del directory
    async with Endpoint() as endpoint:
        address = urlsplit(endpoint.base_url)
        assert address.port is not None
        yield Target(address.port, "/v1/models", most=MOST_OF_ENDPOINT)


SERVERS: Final[dict[str, Serving]] = {
    "khala openenv": openenv, "khala mcp": mcp, "khala view": view, "khala serve --metrics": metrics,
    "khala llm": llm,
}  # fmt: skip


# --- requests -----------------------------------------------------------------------------------------


async def send(
    target: Target, *lines: str, host: str | None = None, path: str | None = None, method: str | None = None,
    body: bytes | None = None, length: int | None = None,
) -> int:  # fmt: skip
    """Send a request as it stands, which no client library would; return the status, 0 if the connection ended."""
    body = target.body if body is None else body
    head = [
        f"{method or target.method} {path or target.path} HTTP/1.1",
        f"Host: {target.host if host is None else host}",
        f"Content-Length: {len(body) if length is None else length}",
        *target.headers,
        *lines,
    ]
    reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
    try:
        writer.write("\r\n".join(head).encode() + b"\r\n\r\n" + body)
        line = await asyncio.wait_for(reader.readline(), ANSWER_S)
    except ConnectionError:
        return 0
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()
    return int(line.split()[1]) if line else 0


async def _is_honest_answered(target: Target) -> str:
    """Return how an honest request fares, "" if well."""
    began = time.perf_counter()
    status = await send(target)
    took_s = time.perf_counter() - began
    if status != 200:
        return f"an honest client got {status}"
    return f"an honest client waited {took_s:.1f} s" if took_s > STEP_S else ""


def _wrong_status(
    name: str, statuses: Sequence[int], allowed: Sequence[int] = (0, 400, 401, 403, 405, 408, 413, 429)
) -> str:
    wrong = [status for status in statuses if status not in allowed]
    return f"{name} was answered with {wrong[0]}" if wrong else ""


@dataclass(frozen=True, slots=True)
class Trick:
    """A request that a page, a proxy or a program sends that has no business here.

    Attributes:
        what: in a few words.
        lines: more lines of the head; PORT is the port of the server.
        host: the name that is asked; "" for that of an honest client.
        options: more of `_status`.
        expected: statuses that are a refusal.
    """

    what: str
    lines: tuple[str, ...] = ()
    host: str = ""
    options: dict[str, Any] = field(default_factory=dict)
    expected: tuple[int, ...] = (400, 403)


TRICKS: Final = (
    Trick("a page of another site asks", (f"Origin: {EVIL}",)),
    Trick("a page on another port of localhost asks", ("Origin: http://localhost:9",)),
    Trick("a page in a sandbox asks", ("Origin: null",)),
    Trick("an image on a page of another site asks", ("Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: no-cors")),
    Trick("a name that somebody points at 127.0.0.1", (f"Origin: {EVIL}:PORT",), host="evil.example:PORT"),
    Trick("the same without an origin", host="evil.example:PORT"),
    Trick("two Host headers", (f"Host: {EVIL}",)),
    Trick("X-Forwarded-Host vouches", ("X-Forwarded-Host: localhost", "Forwarded: host=::1"), host="evil.example"),
    Trick("a method in a header, from a page", (f"Origin: {EVIL}", "X-HTTP-Method-Override: GET")),
    Trick("two origins, ours first", ("Origin: http://127.0.0.1:PORT", f"Origin: {EVIL}")),
    Trick("a body of 100 MB", options={"length": 100_000_000}, expected=(413,)),
)  # fmt: skip


async def _play_trick(serving: Serving, trick: Trick, directory: Path) -> str:
    async with serving(directory) as target:
        if wrong := await _is_honest_answered(target):
            return wrong
        lines = [line.replace("PORT", str(target.port)) for line in trick.lines]
        host = trick.host.replace("PORT", str(target.port)) or None
        status = await send(target, *lines, host=host, **trick.options)
        return _wrong_status("it", [status], trick.expected) or await _is_honest_answered(target)


# --- connections --------------------------------------------------------------------------------------


async def _play_half_open(serving: Serving, directory: Path) -> str:
    """Open more connections than a server takes, and send half a request on each; the oldest must make room."""
    async with serving(directory) as target, contextlib.AsyncExitStack() as stack:
        oldest: asyncio.StreamReader | None = None
        for _ in range(target.most + 20):
            reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
            oldest = oldest or reader
            stack.callback(writer.close)
            with contextlib.suppress(ConnectionError):
                writer.write(b"GET / HTTP/1.1\r\nHost: ")
        if wrong := await _is_honest_answered(target):
            return wrong
        assert oldest is not None
        return "" if await _is_ended(oldest) else f"it keeps {target.most + 20} connections that ask for nothing"


async def _play_slow_head(serving: Serving, directory: Path) -> str:
    """Send a head that never ends, while the clock of the server goes on."""
    async with serving(directory) as target:
        reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
        writer.write(b"GET / HTTP/1.1\r\nX-Slow: ")
        await _is_honest_answered(target)  # so the server has seen the other one
        _pass(HEAD_S + 1)
        ended = await _is_ended(reader)
        writer.close()
        return ("" if ended else "it kept its connection") or await _is_honest_answered(target)


async def _is_ended(reader: asyncio.StreamReader) -> bool:
    """Return whether the server ends a connection, and does so soon."""
    with contextlib.suppress(ConnectionError):
        try:
            await asyncio.wait_for(reader.read(), ANSWER_S)
        except TimeoutError:
            return False
    return True


def _pass(seconds: float) -> None:
    """Set the clock of the event loop ahead, for good: what sleeps by the later time would not wake up before it."""
    loop = asyncio.get_running_loop()
    before = loop.time
    loop.time = lambda: before() + seconds  # type: ignore[method-assign]  # asyncio asks for it each time


# --- tokens and passwords -----------------------------------------------------------------------------


async def _play_without_token(serving: Serving, directory: Path) -> str:
    async with serving(directory) as target:
        if wrong := await _is_honest_answered(target):
            return wrong
        bare = target.path.partition("?")[0]
        tries = [
            await send(target, path=bare),
            await send(target, path=f"{bare}?token="),
            await send(target, path=f"{bare}?token={secrets.token_urlsafe(24)}"),
            await send(target, "Authorization: Bearer x", path=bare),
            await send(target, "Cookie: token=x; khala_0=x", path=bare),
        ]
        return _wrong_status("a request without the token", tries, (401, 403)) or await _is_honest_answered(target)


async def _play_guesses(directory: Path) -> str:
    """Guess the password of a view; the holder of the token comes from the same address, and is not held up."""
    async with view(directory, door=view_door(password="hunter2", is_near=False)) as target:
        tries = []
        for number in range(60):
            login = base64.b64encode(f"me:hunter{number + 3}".encode()).decode()
            tries.append(await send(target, f"Authorization: Basic {login}", path="/api/library"))
        if tries.count(401) > 6:
            return f"{tries.count(401)} guesses were looked at"
        right = base64.b64encode(b"me:hunter2").decode()
        if (status := await send(target, f"Authorization: Basic {right}", path="/api/library")) != 429:
            return f"a guess that was right was told by {status}"
        return await _is_honest_answered(target)


async def _play_token_guesses(directory: Path) -> str:
    async with openenv(directory, door=openenv_door("0.0.0.0")) as target:  # its rules alone
        tries = [await send(target, path=f"/schema?token={secrets.token_urlsafe(24)}") for _ in range(60)]
        if 429 not in tries:
            return "60 guesses were looked at"
        return _wrong_status("a guess", tries, (401, 429)) or await _is_honest_answered(target)


# --- khala view ---------------------------------------------------------------------------------------

PATHS: Final = (
    "/../../etc/passwd", "/api/runs/..%2f..%2f..%2fetc%2fpasswd", "/assets/../cli.py", "/%2e%2e/%2e%2e/etc/passwd",
    "/api/experiments/..%2f..", "//etc/passwd", "/api/runs/%00",
)  # fmt: skip


async def _play_paths(directory: Path) -> str:
    async with view(directory) as target:
        query = target.path.partition("?")[2]
        statuses = [await send(target, path=f"{path}?{query}") for path in PATHS]
        return _wrong_status("a path out of the recordings", statuses, (303, 400, 404)) or await _is_honest_answered(
            target
        )


async def _play_view_socket(directory: Path) -> str:
    async with view(directory) as target:
        query = target.path.partition("?")[2]
        address = f"ws://{target.host}/api/runs/0123456789abcdef/live?{query}"
        return await _play_socket(address, 403)


# --- websockets of khala openenv ----------------------------------------------------------------------


async def _play_socket(address: str, expected: int) -> str:
    for headers in ({"Origin": EVIL}, {"Origin": "http://localhost:9"}, {"Origin": "null"}):
        try:
            async with connect(address, additional_headers=headers, open_timeout=ANSWER_S):
                return f"a page of {headers['Origin']} opened a websocket"
        except InvalidStatus as refused:
            if refused.response.status_code != expected:
                return f"the websocket was answered with {refused.response.status_code}"
    return ""


async def _play_openenv_socket(directory: Path) -> str:
    async with openenv(directory) as target:
        return await _play_socket(f"ws://{target.host}/ws", 403)


async def _play_during_a_match(attack: Callable[[Target], Awaitable[str]], directory: Path) -> str:
    """Play an attack while an honest client is in the middle of an episode, which has to go on."""
    async with openenv(directory) as target, KhalaEnv(f"http://{target.host}") as env:
        await env.reset(task="2s3z", seed=1, max_steps=4)
        if through := await attack(target):
            return through
        began = time.perf_counter()
        seen = (await env.step(KhalaAction(reply=""))).observation
        took_s = time.perf_counter() - began
        if seen.step != 1:
            return f"the match is at step {seen.step}"
        return f"a step took {took_s:.1f} s" if took_s > STEP_S else ""


async def _be_silent(target: Target) -> str:
    """Open websockets that say nothing, and see whether another client can still begin to play."""
    async with contextlib.AsyncExitStack() as stack:
        for _ in range(MOST_WAITING + 8):
            await stack.enter_async_context(connect(f"ws://{target.host}/ws"))
        try:
            async with KhalaEnv(f"http://{target.host}") as other:
                await other.reset(task="2s3z", seed=2, max_steps=2)
        except (RuntimeError, ConnectionError) as error:
            return f"silent clients hold the sessions: {error}"
    return ""


async def _end_the_episode(target: Target) -> str:
    """End, move and begin anew an episode over HTTP that another client began, with a name that can be guessed."""
    address = f"http://{target.host}"
    async with httpx.AsyncClient(base_url=address, timeout=60) as owner, httpx.AsyncClient(base_url=address) as other:
        begun = await owner.post("/reset", json={"task": "2s3z", "seed": 3, "max_steps": 4, "episode_id": "1"})
        begun.raise_for_status()
        step: dict[str, Any] = {"action": {"reply": ""}}
        named = {"episode_id": "1"}
        tries = {
            "/close {}": ("/close", {}), "/step": ("/step", step), "/close": ("/close", named),
            "/step with the name": ("/step", step | named), "/reset": ("/reset", named),
        }  # fmt: skip
        for what, (path, body) in tries.items():
            if (status := (await other.post(path, json=body)).status_code) != 409:
                return f"{what} by another client was answered with {status}"
        after = (await owner.post("/step", json=step)).json()
    return "" if after["observation"]["step"] == 1 else f"the episode is at step {after['observation']['step']}"


async def _send_much(target: Target) -> str:
    """Send a message and a body that are far too long, the body in chunks that declare no size."""
    async with connect(f"ws://{target.host}/ws", max_size=None) as large:
        with contextlib.suppress(ConnectionClosed):
            await large.send("x" * 2**24)
            await large.recv()
            return "a message of 16 MB was read"
    reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
    writer.write(f"POST /step HTTP/1.1\r\nHost: {target.host}\r\nTransfer-Encoding: chunked\r\n\r\n".encode())
    with contextlib.suppress(ConnectionError):
        for _ in range(64):
            writer.write(b"10000\r\n" + b"x" * 65_536 + b"\r\n")
            await writer.drain()
    line = b"0 413"
    with contextlib.suppress(ConnectionError):
        line = await asyncio.wait_for(reader.readline(), ANSWER_S) or line
    writer.close()
    return _wrong_status("a body in chunks", [int(line.split()[1])], (413,))


async def _talk_nonsense(target: Target) -> str:
    """Send what is no message, of every kind."""
    async with connect(f"ws://{target.host}/ws") as strange:
        for text in ("", "{", "null", "[]", '{"type":"step"}', '{"type":"step","data":{"reply":5}}', '{"type":"x"}'):
            with contextlib.suppress(ConnectionClosed):
                await strange.send(text)
                await asyncio.wait_for(strange.recv(), ANSWER_S)
    return ""


async def _play_left_sessions(directory: Path) -> str:
    """Begin episodes over HTTP, leave, and see whether the next client has to wait for an hour."""
    from khala_sc2.openenv import places  # noqa: PLC0415  # its limit is changed below

    async with openenv(directory, sessions=1) as target:
        address = f"http://{target.host}"
        async with httpx.AsyncClient(base_url=address, timeout=60) as gone:
            (await gone.post("/reset", json={"task": "2s3z", "seed": 1, "max_steps": 1})).raise_for_status()
            (await gone.post("/step", json={"action": {"reply": ""}})).raise_for_status()
        before, places.OVER_YIELD_S = places.OVER_YIELD_S, 0.0  # type: ignore[misc]  # the minute is over
        try:
            async with KhalaEnv(address) as env:
                return "" if not (await env.reset(task="2s3z", seed=2, max_steps=1)).done else "no episode began"
        except RuntimeError as error:
            return f"a client that has left holds the session: {error}"
        finally:
            places.OVER_YIELD_S = before  # type: ignore[misc]


async def _play_blocked_trainer(directory: Path) -> str:
    """Answer no ping for ten minutes, as a trainer does whose event loop is blocked."""
    async with openenv(directory) as target:
        reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
        key = base64.b64encode(os.urandom(16)).decode()
        writer.write(
            f"GET /ws HTTP/1.1\r\nHost: {target.host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
        )
        await reader.readuntil(b"\r\n\r\n")
        for _ in range(20):
            _pass(30)
            await send(target)  # the server sees the time
        came = b""
        with contextlib.suppress(TimeoutError):
            came = await asyncio.wait_for(reader.read(1), 0.2)
            return "the server closed the websocket" if not came else "the server pinged, and would close the websocket"
        writer.close()
        return ""


# --- khala mcp ----------------------------------------------------------------------------------------


async def _play_second_client(directory: Path) -> str:
    """Let another client with the address of a seat act for it, while its own client plays."""
    async with mcp(directory) as target:
        address = f"http://{target.host}{target.path}"
        async with Client(address) as first, Client(address) as second, Client(address, mode="legacy") as third:
            await first.call_tool("observe", {})
            for other in (second, third):
                for tool, given in (("observe", {}), ("act", {"reply": ""})):
                    with contextlib.suppress(ToolError):
                        if not (await other.call_tool(tool, given)).is_error:
                            return f"another client could {tool}"
            acted = await first.call_tool("act", {"reply": ""})
            return "the client of the seat could not act" if acted.is_error else ""


async def _play_long_answer(directory: Path) -> str:
    """Send an answer of 100 kB, which the recording would keep."""
    async with mcp(directory) as target:
        body = INITIALIZE.replace(b'"doors"', b'"' + b"x" * 100_000 + b'"')
        return _wrong_status("a body of 100 kB", [await send(target, body=body)], (413,))


# --- files and processes ------------------------------------------------------------------------------


async def _play_exposed(directory: Path) -> str:
    """Serve on all addresses without having said who may play."""
    del directory
    for door in (openenv_door("0.0.0.0"), openenv_door("::")):  # its rules alone
        if not door.token:
            return "a server that other machines reach has no token"
    return ""


async def _play_address(directory: Path) -> str:
    """Connect from another address of this machine to a server that is for loopback alone."""
    own = _own_address()
    async with openenv(directory) as target:
        if own is None:
            raise Skipped("this machine has no address but loopback")
        try:
            _, writer = await asyncio.open_connection(own, target.port)
        except OSError:
            return ""
        writer.close()
        return f"{own}:{target.port} takes connections"


def _own_address() -> str | None:
    """Return an address of this machine that is not loopback; nothing is sent."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        return str(probe.getsockname()[0])
    return None


def _rows() -> tuple[Row, ...]:
    tricks = [
        Row(door, trick.what, partial(_play_trick, serving, trick))
        for door, serving in SERVERS.items()
        for trick in TRICKS
    ]
    connections = [
        row
        for door, serving in SERVERS.items()
        for row in (
            Row(door, "half-open connections, 20 more than it takes", partial(_play_half_open, serving)),
            Row(door, "a head that never ends", partial(_play_slow_head, serving)),
        )
    ]
    attacks = {
        f"{MOST_WAITING + 8} silent websockets during a match": _be_silent,
        "another client ends and moves an episode": _end_the_episode,
        "messages of 16 MB and a body without end during a match": _send_much,
        "nonsense on a websocket during a match": _talk_nonsense,
    }
    return (
        *tricks,
        *connections,
        *(Row("khala openenv", what, partial(_play_during_a_match, attack)) for what, attack in attacks.items()),
        Row("khala openenv", "a websocket of another page", _play_openenv_socket),
        Row("khala openenv", "60 guesses at the token", _play_token_guesses),
        Row("khala openenv", "all addresses, and nobody said who may play", _play_exposed),
        Row("khala openenv", "another address of this machine", _play_address),
        Row("khala openenv", "a client that left over HTTP", _play_left_sessions, "fault"),
        Row("khala openenv", "a trainer that thinks for ten minutes", _play_blocked_trainer, "quirk"),
        Row("khala view", "without the token", partial(_play_without_token, view)),
        Row("khala view", "60 guesses at the password", _play_guesses),
        Row("khala view", "paths out of the recordings", _play_paths),
        Row("khala view", "a websocket of another page", _play_view_socket),
        Row("khala mcp", "without the token", partial(_play_without_token, mcp)),
        Row("khala mcp", "a second client on a seat", _play_second_client),
        Row("khala mcp", "a body of 100 kB", _play_long_answer),
    )


ROWS: Final[tuple[Row, ...]] = _rows()
