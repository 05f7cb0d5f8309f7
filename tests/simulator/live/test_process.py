"""The game as a process: it starts at once, and ends on command."""

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

from khala_simulator.process.client import interface

pytestmark = pytest.mark.game

Launch = Callable[..., subprocess.Popen[bytes]]
PARTICIPANT = sc.PlayerSetup(type=sc.Participant)


@pytest.fixture
def port() -> int:
    return free_port()


def free_port() -> int:
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
                await asyncio.sleep(0.02)  # the process is not there yet; nothing signals when


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


@pytest.mark.parametrize(
    "how",
    [
        "quit",
        *(pytest.param(f"SIGTERM{when}", marks=pytest.mark.slow) for when in ("", " in a step", " in a LAN wait")),
    ],
)
async def test_the_process_ends_at_once(launch: Launch, port: int, how: str) -> None:
    process = launch(port)
    async with connect(port) as ws:
        await ask(ws, ping=sc.RequestPing())
        if how == "SIGTERM in a step":
            await start_long_step(ws)
        if how == "SIGTERM in a LAN wait":
            await start(ws, join_game=lan_join(1))
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
    await start(ws, step=sc.RequestStep(count=2**31))


async def start(ws: aiohttp.ClientWebSocketResponse, **request: object) -> None:
    """Send a request that takes long."""
    await ws.send_bytes(sc.Request(**request).SerializeToString())  # type: ignore[arg-type]  # one field
    with pytest.raises(TimeoutError):  # it is at work
        await ws.receive_bytes(timeout=0.3)


def lan_join(port: int) -> sc.RequestJoinGame:
    ports = sc.PortSet(game_port=port, base_port=port)
    return sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0), server_ports=ports)


@pytest.mark.parametrize("killed", ["host", pytest.param("guest", marks=pytest.mark.slow)])
async def test_a_kill_ends_the_game_over_lan_and_not_the_other_process(launch: Launch, killed: str) -> None:
    ports = [free_port() for _ in range(3)]
    processes = [launch(number) for number in ports[:2]]
    async with connect(ports[0]) as host, connect(ports[1]) as guest:
        create = sc.RequestCreateGame(local_map=sc.LocalMap(map_path="2s3z"), player_setup=[PARTICIPANT] * 2)
        await ask(host, create_game=create)
        joins = await asyncio.gather(*(ask(ws, join_game=lan_join(ports[2])) for ws in (host, guest)))
        assert [answer.join_game.player_id for answer in joins] == [1, 2]
        victim, survivor = (0, guest) if killed == "host" else (1, host)
        await start(survivor, step=sc.RequestStep(count=8))
        processes[victim].kill()
        async with asyncio.timeout(5):
            answer = sc.Response.FromString(await survivor.receive_bytes())
        assert (answer.status, answer.step.simulation_loop) == (sc.ended, 0)
        seen = await ask(survivor, observation=sc.RequestObservation())
        assert {r.player_id: r.result for r in seen.observation.player_result}[victim + 1] == sc.Defeat
        assert (await ask(survivor, leave_game=sc.RequestLeaveGame())).status == sc.launched


async def test_a_process_whose_client_is_killed_in_a_step_ends_when_told(launch: Launch, port: int) -> None:
    process = launch(port)
    async with connect(port) as ws:
        await start_long_step(ws)
        connection = ws._response.connection
        assert connection is not None
        assert connection.transport is not None
        connection.transport.abort()
    async with connect(port) as ws:
        assert (await ask(ws, ping=sc.RequestPing())).status == sc.in_game
        assert (await ask(ws, quit=sc.RequestQuit())).status == sc.quit
    assert await asyncio.to_thread(process.wait, 5) == 0


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
