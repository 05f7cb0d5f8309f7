"""What reaches `khala openenv`: no page, no silent client that takes a session, nobody who ends another's episode."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import os
import struct
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from openenv.core.env_server.exceptions import SessionCapacityError
from openenv.core.env_server.types import ConcurrencyConfig
from openenv.core.generic_client import GenericEnvClient
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from khala_bridge.game.processes import IdleGames
from khala_sc2.openenv.client import KhalaAction, KhalaEnv
from khala_sc2.openenv.places import OVER_YIELD_S, YIELD_S, ServerPlaces
from khala_sc2.openenv.server import (
    MOST_BODY_BYTES,
    MOST_WAITING,
    OPENENV_TOKEN,
    _Server,
    app_of,
    openenv_door,
    server_config,
)
from khala_sc2.openenv.settings import ServerSettings

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractAsyncContextManager

    Serving = Callable[..., AbstractAsyncContextManager[str]]

RAISES = pytest.raises
STATE = json.dumps({"type": "state"})
SHORT = {"task": "2s3z", "seed": 1, "max_steps": 2}


def socket_of(address: str) -> str:
    return address.replace("http://", "ws://") + "/ws"


# --- pages and tokens ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Sec-Fetch-Site": "cross-site"}],
    ids=["origin", "host", "site"],
)
async def test_no_page_of_another_site_is_answered(serving: Serving, headers: dict[str, str]) -> None:
    async with serving() as address, httpx.AsyncClient(base_url=address) as client:
        for path in ("/reset", "/step", "/close", "/mcp"):
            assert (await client.post(path, json={}, headers=headers)).status_code == 403
        for path in ("/state", "/health", "/openapi.json"):
            assert (await client.get(path, headers=headers)).status_code == 403
        with RAISES(InvalidStatus, match="40[03]"):  # this client sends a second Host
            await connect(socket_of(address), additional_headers=headers)


async def test_clients_on_this_machine_need_nothing(serving: Serving) -> None:
    async with serving() as address, httpx.AsyncClient(base_url=address) as client:
        for path in ("/health", "/schema", "/metadata", "/openapi.json"):
            assert (await client.get(path)).status_code == 200
        async with GenericEnvClient(base_url=address.replace("127.0.0.1", "localhost")) as env:
            assert (await env.state())["step_count"] == 0


@pytest.mark.parametrize(
    ("host", "is_open", "token", "near", "needs"),
    [
        ("127.0.0.1", False, "", True, False),
        ("127.0.0.1", False, "a" * 16, True, True),
        ("0.0.0.0", False, "", False, True),
        ("0.0.0.0", False, "a" * 16, False, True),
        ("0.0.0.0", True, "", False, False),
        (None, False, "", True, False),
        (None, True, "", False, False),
        (None, False, "a" * 16, False, True),
    ],
)
def test_whoever_can_come_from_elsewhere_needs_a_token(
    host: str | None, is_open: bool, token: str, near: bool, needs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if token:
        monkeypatch.setenv(OPENENV_TOKEN, token)
    door = openenv_door(host, is_open=is_open)
    assert (door.is_near, bool(door.token)) == (near, needs)
    assert not token or door.token == token


async def test_a_token_comes_in_the_address_of_any_client_or_in_the_environment_of_ours(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    door = openenv_door("0.0.0.0")
    async with serving(door=door) as address:
        opened = address.replace("http://", f"http://khala:{door.token}@")
        async with httpx.AsyncClient() as client:
            assert (await client.get(f"{address}/health")).status_code == 200
            assert (await client.get(f"{address}/schema")).status_code == 401
            assert (await client.get(f"{opened}/schema")).status_code == 200
        async with GenericEnvClient(base_url=opened) as env:
            assert (await env.state())["step_count"] == 0
        with RAISES(ConnectionError, match="HTTP 401"):
            await KhalaEnv(address).connect()
        monkeypatch.setenv(OPENENV_TOKEN, door.token)
        async with KhalaEnv(address) as ours:
            assert (await ours.state()).step_count == 0


async def test_too_long_a_body_and_message_are_refused(serving: Serving) -> None:
    async with serving() as address, httpx.AsyncClient(base_url=address) as client:
        assert (await client.post("/step", content=b"x" * (MOST_BODY_BYTES + 1))).status_code == 413
        async with connect(socket_of(address)) as socket:
            with contextlib.suppress(ConnectionClosed):
                await socket.send("x" * (MOST_BODY_BYTES + 1))
            with RAISES(ConnectionClosed, match="1009"):
                await socket.recv()


# --- websockets ---------------------------------------------------------------------------------------


async def test_silent_websockets_take_no_session_and_the_oldest_make_room(serving: Serving) -> None:
    async with serving(sessions=1) as address, contextlib.AsyncExitStack() as stack:
        silent = [await stack.enter_async_context(connect(socket_of(address))) for _ in range(MOST_WAITING + 2)]
        with RAISES(ConnectionClosed) as left:
            await silent[0].recv()
        assert left.value.rcvd is not None
        assert left.value.rcvd.code == 1013
        assert left.value.rcvd.reason == "too many clients wait: connect again when you begin to play"
        async with GenericEnvClient(base_url=address) as env:
            assert (await env.state())["step_count"] == 0
        await silent[-1].send(STATE)
        assert json.loads(await silent[-1].recv())["type"] == "state"


async def test_episodes_over_http_that_their_clients_left_do_not_fill_the_server(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("khala_sc2.openenv.server.MOST_WAITING", 2)
    server = _Server(
        ServerSettings(), IdleGames(1), ServerPlaces(1), ConcurrencyConfig(max_concurrent_envs=6, session_timeout=3600)
    )
    made = [(await server._create_session())[0] for _ in range(20)]
    assert list(server._sessions) == made[-3:]
    for session in made[-3:]:
        await server._destroy_session(session)


class Blocked:
    """A client of a websocket that does nothing but what the test says: it answers no ping."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    @classmethod
    async def connect(cls, address: str) -> Blocked:
        host, port = address.removeprefix("http://").split(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        key = base64.b64encode(os.urandom(16)).decode()
        writer.write(
            f"GET /ws HTTP/1.1\r\nHost: {host}:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
        )
        assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 101")
        return cls(reader, writer)

    async def ask(self, text: str) -> tuple[int, bytes]:
        """Send a text, and return the code and the payload of the next frame."""
        mask = os.urandom(4)
        masked = bytes(byte ^ mask[place % 4] for place, byte in enumerate(text.encode()))
        self.writer.write(struct.pack("!BB", 0x81, 0x80 | len(masked)) + mask + masked)
        code, size = await self.reader.readexactly(2)
        if size == 126:
            (size,) = struct.unpack("!H", await self.reader.readexactly(2))
        return code & 0x0F, await self.reader.readexactly(size)


async def test_a_trainer_that_thinks_for_ten_minutes_and_answers_no_ping_keeps_its_connection(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop, ahead_s = asyncio.get_running_loop(), [0.0]
    true_time = loop.time
    monkeypatch.setattr(loop, "time", lambda: true_time() + ahead_s[0])
    async with serving() as address:
        blocked = await Blocked.connect(address)
        assert (await blocked.ask(STATE))[0] == 1
        for _ in range(20):
            ahead_s[0] += 30
            async with httpx.AsyncClient(base_url=address) as other:  # the server sees the time as well
                assert (await other.get("/health")).status_code == 200
        code, answer = await blocked.ask(STATE)
        assert (code, json.loads(answer)["type"]) == (1, "state")
        blocked.writer.close()
    config = server_config(app_of())
    assert (config.ws_ping_interval, config.ws_ping_timeout) == (None, None)


# --- places -------------------------------------------------------------------------------------------


class Session:
    is_busy = False
    is_over = False
    lost = ""

    async def give_up(self, why: str) -> None:
        self.lost = why


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


async def test_a_place_is_lost_only_when_it_is_needed_and_only_by_a_session_that_is_idle() -> None:
    clock = Clock()
    places = ServerPlaces(2, clock)
    first, second, third = Session(), Session(), Session()
    await places.take(first)
    clock.now_s = 1
    await places.take(second)
    with RAISES(SessionCapacityError, match="at capacity: 2/2 sessions play, and none .* idle for 15 min"):
        await places.take(third)
    await places.take(first)
    clock.now_s = YIELD_S + 0.5
    places.touch(first)
    with RAISES(SessionCapacityError):
        await places.take(third)
    clock.now_s = YIELD_S + 1
    second.is_busy = True
    with RAISES(SessionCapacityError):
        await places.take(third)
    second.is_busy = False
    await places.take(third)
    assert second.lost == "it did nothing for long, and another client needed its place: call reset to begin anew"
    assert (places.holds(first), places.holds(second), places.holds(third)) == (True, False, True)
    assert first.lost == ""


async def test_a_session_whose_episode_is_over_makes_room_sooner() -> None:
    clock = Clock()
    places = ServerPlaces(2, clock)
    playing, over, new = Session(), Session(), Session()
    over.is_over = True
    await places.take(playing)
    await places.take(over)
    clock.now_s = OVER_YIELD_S
    await places.take(new)
    assert (playing.lost, bool(over.lost)) == ("", True)
    places.free(new)
    await places.take(over)
    assert places.holds(over)


# --- episodes -----------------------------------------------------------------------------------------


@pytest.mark.game
async def test_another_client_cannot_end_or_move_an_episode(serving: Serving) -> None:
    async with (
        serving(sessions=2) as address,
        httpx.AsyncClient(base_url=address, timeout=60) as owner,
        httpx.AsyncClient(base_url=address, timeout=60) as other,
    ):
        await owner.post("/reset", json=SHORT | {"episode_id": "mine"})
        step: dict[str, Any] = {"action": {"reply": ""}}
        named = {"episode_id": "mine"}
        tries: list[tuple[str, dict[str, Any]]] = [
            ("/close", {}), ("/step", step), ("/close", named), ("/step", step | named), ("/reset", SHORT | named),
        ]  # fmt: skip
        refused = [await other.post(path, json=body) for path, body in tries]
        assert [answer.status_code for answer in refused] == [409] * len(tries)
        assert refused[-1].json()["detail"].startswith("another client chose this episode_id: send the cookie")
        assert (await other.get("/state")).status_code == 409
        played = await owner.post("/step", json=step)
        assert played.json()["observation"]["step"] == 1
        made = (await other.post("/reset", json=SHORT)).json()["observation"]["episode_id"]
        async with httpx.AsyncClient(base_url=address) as without_cookies:
            closed = await without_cookies.post("/close", json={"episode_id": made})
        assert closed.json() == {"episode_id": made}, "the name that the server made is all that a client needs"


@pytest.mark.slow
@pytest.mark.game
async def test_a_session_that_left_makes_room_and_reads_why_when_it_comes_back(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with serving(sessions=1) as address, KhalaEnv(address) as first, KhalaEnv(address) as second:
        await first.reset(**SHORT)
        with RAISES(RuntimeError, match="at capacity: 1/1"):
            await second.reset(**SHORT)
        monkeypatch.setattr("khala_sc2.openenv.places.YIELD_S", 0.0)
        assert not (await second.reset(**SHORT)).done
        monkeypatch.undo()
        with RAISES(RuntimeError, match="the episode was ended, since it did nothing for long, and another client"):
            await first.step(KhalaAction(reply=""))
        assert not (await second.step(KhalaAction(reply=""))).done
