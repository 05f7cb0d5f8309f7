"""The websocket: frames of both kinds, connections that come and go, and the end of the process."""

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator

import aiohttp
import pytest
import websocket
from aiohttp import WSMsgType
from aiohttp.test_utils import make_mocked_request
from multidict import CIMultiDict
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.__main__ import Arguments, listen, main, parse
from khala_simulator.process.client import interface
from khala_simulator.process.server import is_from_page, serve
from khala_simulator.process.session import Session

Ws = aiohttp.ClientWebSocketResponse

ENDLESS = b"""# A map of Khala's simulator
name: endless
family: test
title: One who never stops
terrain: agria_open
players: {1: {race: protoss, control: agent}}
triggers: [{name: spawn, when: [start], do: [{create: {player: 1, unit: Zealot, at: [16, 16]}}]}]
"""


class Running:
    """A server in this process, and clients that connect to it."""

    def __init__(self, sock: socket.socket, http: aiohttp.ClientSession) -> None:
        self.url = f"http://127.0.0.1:{sock.getsockname()[1]}"
        self.http = http
        self.task = asyncio.create_task(serve(sock, Session(".")))
        self.clients: list[Ws] = []

    async def connect(self) -> Ws:
        self.clients.append(await self.http.ws_connect(f"{self.url}/sc2api", max_msg_size=0))
        return self.clients[-1]

    async def close(self) -> None:
        for client in self.clients:
            await client.close()
        self.task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self.task


@pytest.fixture
async def running() -> AsyncIterator[Running]:
    async with aiohttp.ClientSession() as http:
        server = Running(listen("127.0.0.1", 0), http)
        yield server
        await server.close()


async def ask(ws: Ws, request: sc.Request, *, text: bool = False) -> sc.Response:
    data = request.SerializeToString()
    await (ws.send_frame(data, WSMsgType.TEXT) if text else ws.send_bytes(data))
    return sc.Response.FromString(await ws.receive_bytes())


PING = sc.Request(ping=sc.RequestPing(), id=255)


@pytest.mark.parametrize("text", [True, False], ids=["text", "binary"])
async def test_both_kinds_of_frames_carry_protobuf(running: Running, text: bool) -> None:
    ws = await running.connect()
    request = sc.Request(save_map=sc.RequestSaveMap(map_path="x", map_data=bytes(range(256))), id=255)
    response = await ask(ws, request, text=text)  # no valid UTF-8, as most requests of PySC2
    assert response.id == 255
    assert response.HasField("save_map")


async def test_a_frame_of_50_megabytes_is_a_request_like_any(running: Running) -> None:
    ws = await running.connect()
    request = sc.Request(save_map=sc.RequestSaveMap(map_path="big", map_data=bytes(50_000_000)))
    assert (await ask(ws, request)).HasField("save_map")
    assert (await ask(ws, PING)).ping.base_build == 75689


async def test_garbage_is_answered_and_the_connection_lives_on(running: Running) -> None:
    ws = await running.connect()
    await ws.send_bytes(b"\xff\xfe garbage")
    response = sc.Response.FromString(await ws.receive_bytes())
    assert list(response.error) == ["The request is not a protobuf message of the SC2 API"]
    assert (await ask(ws, PING)).HasField("ping")


async def test_requests_in_a_row_are_answered_in_their_order(running: Running) -> None:
    ws = await running.connect()
    for number in range(20):
        await ws.send_bytes(sc.Request(ping=sc.RequestPing(), id=number).SerializeToString())
    answers = [sc.Response.FromString(await ws.receive_bytes()).id for _ in range(20)]
    assert answers == list(range(20))


async def test_a_game_survives_its_connection(running: Running) -> None:
    ws = await running.connect()
    create = sc.RequestCreateGame(
        local_map=sc.LocalMap(map_path="2s3z"), player_setup=[sc.PlayerSetup(type=sc.Participant)]
    )
    await ask(ws, sc.Request(create_game=create))
    await ws.close()
    ws = await running.connect()
    join = sc.RequestJoinGame(race=common_pb2.Protoss, options=interface())
    assert (await ask(ws, sc.Request(join_game=join))).join_game.player_id == 1
    await ws.close()
    ws = await running.connect()
    seen = await ask(ws, sc.Request(observation=sc.RequestObservation()))
    assert len(seen.observation.observation.raw_data.units) == 10


async def test_the_newest_client_is_served_and_the_one_before_is_dropped(running: Running) -> None:
    vanished = await running.connect()
    ws = await running.connect()
    assert (await ask(ws, PING)).HasField("ping")
    assert (await vanished.receive()).type in {WSMsgType.CLOSED, WSMsgType.CLOSE, WSMsgType.ERROR}


async def test_a_connection_that_never_says_a_word_holds_nobody_up(running: Running) -> None:
    port = int(running.url.rpartition(":")[2])
    _, silent = await asyncio.open_connection("127.0.0.1", port)
    ws = await running.connect()
    assert (await ask(ws, PING)).HasField("ping")
    silent.close()
    await silent.wait_closed()


HALVES = {
    "a handshake": b"GET /sc2api HTTP/1.1\r\nHost: x\r\nUpgrade: webso",
    "a frame": b"GET /sc2api HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n\x82\xff\0\0\0\0\x02\xfa\xf0",
}


@pytest.mark.parametrize("half", HALVES.values(), ids=HALVES.keys())
async def test_a_connection_that_stops_in_the_middle_holds_nobody_up(running: Running, half: bytes) -> None:
    _, silent = await asyncio.open_connection("127.0.0.1", int(running.url.rpartition(":")[2]))
    silent.write(half)
    await silent.drain()
    ws = await running.connect()
    assert (await ask(ws, PING)).HasField("ping")
    silent.transport.abort()
    assert (await ask(ws, PING)).HasField("ping")


@pytest.mark.parametrize("frame", [b"\x83\x80\0\0\0\0", b"\xf2\x81\0\0\0\0x"], ids=["opcode", "reserved bits"])
async def test_what_is_no_frame_ends_that_connection_only(running: Running, frame: bytes) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", int(running.url.rpartition(":")[2]))
    writer.write(HALVES["a frame"][: -len(b"\x82\xff\0\0\0\0\x02\xfa\xf0")] + frame)
    async with asyncio.timeout(5):
        await reader.read()
    writer.close()
    ws = await running.connect()
    assert (await ask(ws, PING)).HasField("ping")


async def test_a_client_that_vanishes_in_a_long_step_makes_room_for_the_next(running: Running) -> None:
    ws = await running.connect()
    create = sc.RequestCreateGame(
        local_map=sc.LocalMap(map_data=ENDLESS), player_setup=[sc.PlayerSetup(type=sc.Participant)]
    )
    await ask(ws, sc.Request(create_game=create))
    await ask(ws, sc.Request(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0))))
    await ws.send_bytes(sc.Request(step=sc.RequestStep(count=2**31)).SerializeToString())
    await asyncio.sleep(0)
    ws._response.connection.transport.abort()  # type: ignore[union-attr]  # as if the client had been killed
    async with asyncio.timeout(5):
        ws = await running.connect()
        seen = (await ask(ws, sc.Request(observation=sc.RequestObservation()))).observation.observation
        assert 0 < seen.game_loop < 2**31
        step = (await ask(ws, sc.Request(step=sc.RequestStep(count=2)))).step
    assert step.simulation_loop >= seen.game_loop + 2


async def test_a_client_that_vanishes_while_it_joins_over_lan_makes_room_for_the_next(running: Running) -> None:
    ws = await running.connect()
    join = sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0))
    join.server_ports.game_port = join.server_ports.base_port = 1
    await ws.send_bytes(sc.Request(join_game=join).SerializeToString())
    with pytest.raises(TimeoutError):
        await ws.receive_bytes(timeout=0.1)
    async with asyncio.timeout(5):
        ws = await running.connect()
        assert (await ask(ws, PING)).status == sc.launched


async def test_only_the_endpoint_exists(running: Running) -> None:
    async with running.http.get(f"{running.url}/") as response:
        assert response.status == 404


async def test_quit_is_answered_and_ends_the_server(running: Running) -> None:
    ws = await running.connect()
    response = await ask(ws, sc.Request(quit=sc.RequestQuit(), id=999999999))
    assert (response.status, response.id) == (sc.quit, 999999999)
    await asyncio.wait_for(running.task, 1)


async def test_a_client_that_quits_without_reading_ends_the_server(running: Running) -> None:
    ws = await running.connect()
    await ws.send_bytes(sc.Request(quit=sc.RequestQuit()).SerializeToString())
    await ws.close()
    await asyncio.wait_for(running.task, 1)


# pages of the web -----------------------------------------------------------------------------------------------------

PAGES = {
    "another page": ("127.0.0.1:5000", ["http://evil.example"]),
    "a page from a file or a frame": ("127.0.0.1:5000", ["null"]),
    "a page of this machine": ("127.0.0.1:5000", ["http://127.0.0.1:8000"]),
    "a page over TLS": ("127.0.0.1:5000", ["https://127.0.0.1:5000"]),
    "two origins": ("127.0.0.1:5000", ["http://127.0.0.1:5000", "http://evil.example"]),
    "a name that its owner points here": ("evil.example:5000", ["http://evil.example:5000"]),
    "an empty origin": ("127.0.0.1:5000", [""]),
    "no host": ("", ["http://evil.example"]),
}
CLIENTS = {
    "PySC2 on this machine": ("127.0.0.1:5000", ["http://127.0.0.1:5000"]),
    "PySC2 by IPv6": ("[::1]:5000", ["http://[::1]:5000"]),
    "PySC2 by LAN": ("192.168.1.20:5000", ["http://192.168.1.20:5000"]),
    "PySC2 by a name without a dot": ("game:5000", ["http://game:5000"]),
    "PySC2 by this machine's name": (f"{socket.gethostname()}:5000", [f"http://{socket.gethostname()}:5000"]),
    "PySC2 at port 80": ("127.0.0.1", ["http://127.0.0.1"]),
    "python-sc2": ("127.0.0.1:5000", []),
    "python-sc2 by any name": ("game.example:5000", []),
}


@pytest.mark.parametrize(
    ("host", "origins", "page"),
    [(*given, True) for given in PAGES.values()] + [(*given, False) for given in CLIENTS.values()],
    ids=[*PAGES, *CLIENTS],
)
def test_a_page_is_told_from_a_client(host: str, origins: list[str], page: bool) -> None:
    headers = CIMultiDict([("Host", host), *(("Origin", origin) for origin in origins)])
    assert is_from_page(make_mocked_request("GET", "/sc2api", headers)) is page


async def test_a_page_is_refused_and_its_visit_drops_no_client(running: Running) -> None:
    ws = await running.connect()
    with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
        await running.http.ws_connect(f"{running.url}/sc2api", origin="http://evil.example")
    assert refused.value.status == 403
    assert (await ask(ws, PING)).HasField("ping")


async def test_the_library_of_pysc2_is_let_in(running: Running) -> None:
    port = running.url.rpartition(":")[2]
    ws = await asyncio.to_thread(websocket.create_connection, f"ws://127.0.0.1:{port}/sc2api", timeout=5)
    await asyncio.to_thread(ws.send, PING.SerializeToString())
    answer = await asyncio.to_thread(ws.recv)
    assert isinstance(answer, bytes)
    assert sc.Response.FromString(answer).id == 255
    ws.shutdown()  # type: ignore[no-untyped-call]  # websocket-client has no types


async def test_a_request_beyond_the_limit_ends_that_connection_only(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("khala_simulator.process.server.LARGEST_REQUEST", 1000)
    ws = await running.connect()
    await ws.send_bytes(bytes(1001))
    assert (await ws.receive()).type in {WSMsgType.CLOSED, WSMsgType.CLOSE, WSMsgType.ERROR}
    ws = await running.connect()
    assert (await ask(ws, PING)).HasField("ping")


# the command line -----------------------------------------------------------------------------------------------------

PYSC2 = "-listen 127.0.0.1 -port 15555 -dataDir /sc2/ -tempDir /tmp/sc-x/"


@pytest.mark.parametrize(
    ("argv", "arguments"),
    [
        (PYSC2, Arguments("127.0.0.1", 15555, "/sc2/", "/tmp/sc-x/")),
        (f"{PYSC2} -dataVersion B89B", Arguments("127.0.0.1", 15555, "/sc2/", "/tmp/sc-x/", "B89B")),
        (f"{PYSC2} -eglpath libEGL.so -verbose -headlessNoRender",
         Arguments("127.0.0.1", 15555, "/sc2/", "/tmp/sc-x/")),
        ("-listen ::1 -ipv6 -port 7", Arguments(host="::1", port=7)),
        ("-listen [::1] -port 7", Arguments(host="::1", port=7)),
        ("-displayMode 0 -windowwidth 640 -port 7", Arguments(port=7)),
        ("-executable /x/Versions/Base92440/SC2_x64 -port 7", Arguments(port=7, base_build=92440)),
        ("", Arguments()),
        ("-port", Arguments()),
    ],
)  # fmt: skip
def test_the_command_lines_of_clients_are_understood(argv: str, arguments: Arguments) -> None:
    assert parse(argv.split()) == arguments


def test_a_port_that_is_no_number_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("signal.signal", lambda *_: None)
    with pytest.raises(SystemExit, match="StarCraft II simulator: -port needs a number: "):
        main(["-port", "x"])


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_it_listens_on_both_kinds_of_addresses(host: str) -> None:
    with listen(host, 0) as sock, socket.create_connection((host, sock.getsockname()[1]), timeout=1):
        pass
