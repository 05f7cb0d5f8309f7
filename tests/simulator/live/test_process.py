"""The game as a process: it starts at once, and ends when it is told to."""

import asyncio
import contextlib
import signal
import socket
import subprocess
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import aiohttp
import pytest
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from simulator.client import interface

pytestmark = pytest.mark.game

Launch = Callable[..., subprocess.Popen[bytes]]


@pytest.fixture
def port() -> int:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        number: int = sock.getsockname()[1]
        return number


@contextlib.asynccontextmanager
async def connect(port: int) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    async with aiohttp.ClientSession() as http:
        ws = await _patiently(http, port)
        yield ws
        await ws.close()


async def _patiently(http: aiohttp.ClientSession, port: int) -> aiohttp.ClientWebSocketResponse:
    async with asyncio.timeout(20):
        while True:
            try:
                return await http.ws_connect(f"http://127.0.0.1:{port}/sc2api", max_msg_size=0)
            except aiohttp.ClientConnectorError:
                await asyncio.sleep(0.02)  # the process is not there yet; nothing tells when


async def ask(ws: aiohttp.ClientWebSocketResponse, **request: object) -> sc.Response:
    await ws.send_bytes(sc.Request(**request).SerializeToString())  # type: ignore[arg-type]  # one field
    return sc.Response.FromString(await ws.receive_bytes())


async def test_nobody_ever_meets_a_404(launch: Launch, port: int) -> None:
    launch(port)
    async with connect(port) as ws:  # python-sc2 would not try again after anything but a refused connection
        assert (await ask(ws, ping=sc.RequestPing())).ping.base_build == 75689


async def test_the_data_version_of_the_command_line_is_told(launch: Launch, port: int) -> None:
    launch(port, "-dataVersion", "B89B5D6FA7CBF6452E721311BFBC6CB2", "-verbose", "-eglpath", "libEGL.so")
    async with connect(port) as ws:
        assert (await ask(ws, ping=sc.RequestPing())).ping.data_version == "B89B5D6FA7CBF6452E721311BFBC6CB2"


@pytest.mark.parametrize("how", ["quit", "SIGTERM", "SIGTERM in a step"])
async def test_the_process_ends_at_once(launch: Launch, port: int, how: str) -> None:
    process = launch(port)
    async with connect(port) as ws:
        await ask(ws, ping=sc.RequestPing())
        if how == "SIGTERM in a step":
            await start_long_step(ws)
        started_s = time.monotonic()
        if how == "quit":
            await ws.send_bytes(sc.Request(quit=sc.RequestQuit()).SerializeToString())
        else:
            process.send_signal(signal.SIGTERM)
        code = await asyncio.to_thread(process.wait, 5)
        duration_s = time.monotonic() - started_s
    assert code == 0
    assert duration_s < 1.0  # 0.2 s on an idle machine; PySC2 kills after 3 s


ENDLESS = b"""# A map of Khala's simulator
name: endless
family: test
title: A hundred Zealots who never stop
terrain: agria_open
players: {1: {race: protoss, control: agent}, 2: {race: protoss, control: computer}}
triggers:
  - name: spawn
    when: [start]
    do:
      - create: {player: 1, unit: Zealot, count: 100, at: [16, 16]}
"""


async def start_long_step(ws: aiohttp.ClientWebSocketResponse) -> None:
    create = sc.RequestCreateGame(
        local_map=sc.LocalMap(map_data=ENDLESS), player_setup=[sc.PlayerSetup(type=sc.Participant)]
    )
    await ask(ws, create_game=create)
    await ask(ws, join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface()))
    await ws.send_bytes(sc.Request(step=sc.RequestStep(count=2**31)).SerializeToString())
    with pytest.raises(TimeoutError):  # it is at work
        await ws.receive_bytes(timeout=0.3)


async def test_a_port_that_is_taken_is_told(launch: Launch, port: int, capfd: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", port))
        sock.listen()
        process = launch(port)
        code = await asyncio.to_thread(process.wait, 10)
    assert code == 1
    error = capfd.readouterr().err
    assert error.startswith(f"StarCraft II simulator: cannot listen on 127.0.0.1:{port}: ")
    assert "Traceback" not in error


async def test_the_game_is_quiet(launch: Launch, port: int, capfd: pytest.CaptureFixture[str], sc2: Path) -> None:
    launch(port)
    async with connect(port) as ws:
        data = (sc2 / "Maps/llm_smac/2s3z.SC2Map").read_bytes()
        create = sc.RequestCreateGame(
            local_map=sc.LocalMap(map_path="llm_smac/2s3z.SC2Map", map_data=data),
            player_setup=[sc.PlayerSetup(type=sc.Participant)],
        )
        await ask(ws, create_game=create)
        await ask(ws, join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface()))
        await ask(ws, step=sc.RequestStep(count=50))
    assert capfd.readouterr() == ("", "")
