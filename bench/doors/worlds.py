"""What comes to the game: requests, connections, maps, replays and installs.

Requests go to the session that the websocket server asks; connections go to a server on a socket of this machine. A
door of the game holds if it answers with an error of the API, or refuses the connection, and the game lives on.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import random
import struct
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import aiohttp
import mpyq
from s2clientprotocol import common_pb2, debug_pb2, query_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from bench.doors.rows import Row
from khala_simulator.__main__ import listen
from khala_simulator.maps.map_file import MapDataError, read_map
from khala_simulator.maps.nodes import ScenarioError
from khala_simulator.maps.scenario_file import parse_scenario
from khala_simulator.process import mpq, server
from khala_simulator.process.client import Client, command, interface
from khala_simulator.process.session import Session

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine

    from bench.doors.rows import Kind

    Play = Callable[[Path], Coroutine[Any, Any, str]]

PING: Final = sc.Request(ping=sc.RequestPing(), id=7).SerializeToString()
MARK: Final = b"# A map of Khala's simulator\n"
HEAD: Final = """\
name: door
family: test
title: A door
terrain: {flat: [32, 32]}
players: {1: {race: terran, control: agent}, 2: {race: zerg, control: computer}}
"""
PATIENCE_S: Final = 20.0

# requests -------------------------------------------------------------------------------------------------------------


def _fault_of(client: Client, data: bytes) -> str:
    """Return what is wrong with the answer to a request, and with the game after it; "" if nothing is."""
    with contextlib.redirect_stderr(io.StringIO()):
        response = sc.Response.FromString(client.session.handle(data))
    if failed := [error for error in response.error if error.startswith("The simulator failed")]:
        return failed[0]
    if not response.error and response.WhichOneof("response") is None:
        return "an answer without a body and without an error"
    for request in (sc.Request(step=sc.RequestStep(count=2)), sc.Request(observation=sc.RequestObservation())):
        after = sc.Response.FromString(client.session.handle(request.SerializeToString()))
        if any(error.startswith("The simulator failed") for error in after.error):
            return f"the game afterwards: {after.error[0]}"
    return ""


def _game() -> Client:
    client = Client()
    client.play("Melee/Flat32", interface(screen=32, minimap=32))
    client.step(2)
    return client


def _request(make: Callable[[list[int]], list[sc.Request]]) -> Play:
    async def play(_: Path) -> str:
        client = _game()
        tags = [unit.tag for unit in client.observe().observation.raw_data.units]
        return next(filter(None, (_fault_of(client, made.SerializeToString()) for made in make(tags))), "")

    return play


def _actions(*actions: sc.Action) -> sc.Request:
    return sc.Request(action=sc.RequestAction(actions=actions))


def _without_parts(_: list[int]) -> list[sc.Request]:
    kinds = [field.name for field in sc.Request.DESCRIPTOR.oneofs_by_name["request"].fields]
    requests = [sc.Request(), *(sc.Request(**{kind: {}}) for kind in kinds if kind not in {"quit", "leave_game"})]  # type: ignore[arg-type]  # kind is a field's name
    empty = [sc.Action(action_raw={kind: {}}) for kind in ("unit_command", "camera_move", "toggle_autocast")]  # type: ignore[arg-type]  # likewise
    return [*requests, _actions(sc.Action(), *empty)]


def _numbers(tags: list[int]) -> list[sc.Request]:
    floats, whole = (float("nan"), float("inf"), -1e38, 1e38), (-(2**31), -1, 2**31 - 1)
    points = [
        _actions(command(ability, tags, point=(x, y))) for ability in (1, 16, 23, 318) for x in floats for y in floats
    ]
    return [*points, *(_actions(command(ability, tags, target=2**64 - 1)) for ability in whole)]


def _unknown_types(_: list[int]) -> list[sc.Request]:
    def create(**given: Any) -> sc.Request:
        order = debug_pb2.DebugCreateUnit(**{"owner": 1, "pos": common_pb2.Point2D(x=5, y=5), **given})
        return sc.Request(debug=sc.RequestDebug(debug=[debug_pb2.DebugCommand(create_unit=order)]))

    nowhere = common_pb2.Point2D(x=float("nan"), y=1e30)
    return [
        *(create(unit_type=kind) for kind in (0, 2**32 - 1)),
        *(create(unit_type=48, owner=owner) for owner in (-1, 99, -(2**31))),
        create(unit_type=48, pos=nowhere),
    ]


def _questions(tags: list[int]) -> list[sc.Request]:
    point = common_pb2.Point2D(x=float("inf"), y=float("-inf"))
    asked = query_pb2.RequestQuery(
        pathing=[query_pb2.RequestQueryPathing(start_pos=point, end_pos=point), query_pb2.RequestQueryPathing()],
        abilities=[query_pb2.RequestQueryAvailableAbilities(unit_tag=tag) for tag in (0, 2**64 - 1, *tags)],
        placements=[query_pb2.RequestQueryBuildingPlacement(ability_id=-5, target_pos=point)],
    )
    return [sc.Request(query=asked)]


def _giants(tags: list[int]) -> list[sc.Request]:
    raw = raw_pb2.ActionRawUnitCommand(ability_id=16, unit_tags=tags * 5000)
    many = [_actions(*[command(16, tags[:1], point=(9, 9))] * 2000)]
    return [_actions(sc.Action(action_raw=raw_pb2.ActionRaw(unit_command=raw))), *many]


async def _broken_texts(_: Path) -> str:
    requests = [
        sc.Request(replay_info=sc.RequestReplayInfo(replay_path="@@@")),
        sc.Request(create_game=sc.RequestCreateGame(local_map=sc.LocalMap(map_path="@@@"))),
        sc.Request(save_map=sc.RequestSaveMap(map_path="@@@", map_data=b"x")),
        _actions(sc.Action(action_chat=sc.ActionChat(message="@@@"))),
    ]
    broken = (_fault_of(_game(), request.SerializeToString().replace(b"@@@", b"\xff\xfe\xfd")) for request in requests)
    return next(filter(None, broken), "")


async def _broken_bytes(_: Path) -> str:
    client = _game()
    dice = random.Random(1)
    whole = [made.SerializeToString() for made in (*_questions([1]), *_unknown_types([]), *_numbers([1])[:9])]
    for _number in range(300):
        data = bytearray(dice.choice(whole))
        for _change in range(dice.randint(1, 4)):
            data[dice.randrange(len(data))] = dice.randrange(256)
        if fault := _fault_of(client, bytes(data[: dice.randint(0, len(data))])):
            return fault
    return ""


async def _crowd(_: Path) -> str:
    client = _game()
    order = debug_pb2.DebugCreateUnit(unit_type=48, owner=1, pos=common_pb2.Point2D(x=9, y=9), quantity=2**31)
    client.debug(*[debug_pb2.DebugCommand(create_unit=order)] * 60)
    playing = client.session._process.playing  # noqa: SLF001  # a step with so many takes seconds
    assert playing is not None
    playing.game._take_effect()  # noqa: SLF001  # likewise
    world = playing.game.world
    count = int(world.alive.sum())
    return f"{count} units were made, and tags have room for 16383" if count > 16_000 else ""


# connections ----------------------------------------------------------------------------------------------------------


@contextlib.asynccontextmanager
async def _server() -> AsyncIterator[tuple[str, int]]:
    """Serve a game on a port of this machine; yield its address and port."""
    sock = listen("127.0.0.1", 0)
    port = sock.getsockname()[1]
    task = asyncio.create_task(server.serve(sock, Session(".")))
    try:
        yield f"http://127.0.0.1:{port}/sc2api", port
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def _visit(origin: str | None, host: str | None = None) -> Play:
    async def play(_: Path) -> str:
        async with _server() as (url, port), aiohttp.ClientSession() as http:
            headers = {} if host is None else {"Host": host.format(port=port)}
            if origin is not None:
                headers["Origin"] = origin.format(port=port)
            try:
                async with http.ws_connect(url, headers=headers):
                    return "the page was let in"
            except aiohttp.WSServerHandshakeError as refused:
                return "" if refused.status == 403 else f"it was refused with {refused.status}"

    return play


async def _lan_client(_: Path) -> str:
    """PySC2's library names the game as its origin; it must be let in."""
    async with (
        _server() as (url, port),
        aiohttp.ClientSession() as http,
        http.ws_connect(url, headers={"Origin": f"http://127.0.0.1:{port}"}) as ws,
    ):
        await ws.send_bytes(PING)
        answer = sc.Response.FromString(await ws.receive_bytes(timeout=PATIENCE_S))
        return "" if answer.id == 7 else "PySC2 was not answered"


def _frames(*frames: bytes) -> Play:
    """Return a row that sends raw bytes after the handshake, and then asks as a new client whether the game lives."""

    async def play(_: Path) -> str:
        async with _server() as (url, port), aiohttp.ClientSession() as http:
            writer = (await asyncio.open_connection("127.0.0.1", port))[1]
            writer.write(
                b"GET /sc2api HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
            )
            for frame in frames:
                writer.write(frame)
            await writer.drain()
            async with http.ws_connect(url) as ws:
                await ws.send_bytes(PING)
                answer = sc.Response.FromString(await ws.receive_bytes(timeout=PATIENCE_S))
            writer.close()
            return "" if answer.id == 7 else "the next client was not answered"

    return play


async def _text_frame(_: Path) -> str:
    async with _server() as (url, _port), aiohttp.ClientSession() as http, http.ws_connect(url) as ws:
        await ws.send_str("hello\u202e")
        answer = sc.Response.FromString(await ws.receive_bytes(timeout=PATIENCE_S))
        await ws.ping()
        await ws.send_bytes(PING)
        alive = sc.Response.FromString(await ws.receive_bytes(timeout=PATIENCE_S))
    return "" if answer.error and alive.id == 7 else "a text that is no request was taken for one"


async def _second_client(_: Path) -> str:
    async with _server() as (url, _port), aiohttp.ClientSession() as http:
        first, second = await http.ws_connect(url), await http.ws_connect(url)
        await second.send_bytes(PING)
        answer = sc.Response.FromString(await second.receive_bytes(timeout=PATIENCE_S))
        dropped = await first.receive(timeout=PATIENCE_S)
        await second.close()
    if dropped.type in {aiohttp.WSMsgType.TEXT, aiohttp.WSMsgType.BINARY}:
        return "an answer went to the wrong client"
    return "" if answer.id == 7 else "the second client was not answered"


# files ----------------------------------------------------------------------------------------------------------------


def _scenario(text: str) -> Play:
    async def play(directory: Path) -> str:
        path = directory / "door.yaml"
        path.write_text(text, encoding="utf-8")
        child = await asyncio.create_subprocess_exec(
            sys.executable, "-c", _READER, str(path), stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
        )
        try:
            async with asyncio.timeout(PATIENCE_S):
                said, fault = (part.decode() for part in await child.communicate())
        except TimeoutError:
            child.kill()
            await child.wait()
            return f"it was read for more than {PATIENCE_S:g} s"
        if child.returncode:
            return f"exit code {child.returncode}: {fault[-200:].strip()}"
        return "" if said.startswith(f"{path}:") and len(said) < 1000 else f"it says {said[:200]!r}"

    return play


_READER: Final = """
import sys
from pathlib import Path
from khala_simulator.maps.scenario_file import read_scenario
try:
    read_scenario(Path(sys.argv[1]))
except ValueError as error:
    if type(error).__name__ != "ScenarioError":
        raise
    print(error)
"""
"""Reads a scenario in another process: what is meant to be refused may end it, or fill its memory."""


def _map(data: Callable[[], bytes]) -> Play:
    async def play(_: Path) -> str:
        made = data()
        try:
            read_map(made, "door.SC2Map")
        except MapDataError as error:
            return "" if "door.SC2Map" in str(error) else f"it does not name the file: {error}"
        return "it was read"

    return play


def _cut_archive() -> bytes:
    whole = mpq.pack({"MapInfo": b"IpaM" + struct.pack("<5I", 39, 0, 0, 64, 64) + b"A" * 100, "Objects": b"<a/>"})
    assert mpyq.MPQArchive(io.BytesIO(whole)).read_file("Objects")
    return whole[: len(whole) * 2 // 3]


async def _mutations(_: Path) -> str:
    dice = random.Random(3)
    text = HEAD + "units: [{player: 1, unit: Marine, at: [4, 4]}]\npoints: {a: [3, 3]}\n"
    junk = (
        "7",
        "[]",
        "{}",
        "[[]]",
        ".nan",
        "-.inf",
        "!!binary x",
        "2026-02-31",
        "&a *a",
        "? ",
        "\x07",
        "'",
        "9" * 5000,
    )
    for _number in range(150):
        begin = dice.randrange(len(text))
        hostile = text[:begin] + dice.choice(junk) + text[begin + dice.randint(0, 12) :]
        try:
            parse_scenario(hostile, "door.yaml")
        except ScenarioError as error:
            if not str(error).startswith("door.yaml:"):
                return f"it does not name the file: {error}"
    return ""


async def _devices(directory: Path) -> str:
    pipe, endless = directory / "pipe.SC2Map", directory / "endless.SC2Map"
    os.mkfifo(pipe)
    endless.symlink_to("/dev/zero")
    for path in (pipe, endless, directory):
        asked = sc.RequestCreateGame(local_map=sc.LocalMap(map_path=str(path)), player_setup=[sc.PlayerSetup()])
        answer = await asyncio.wait_for(asyncio.to_thread(Client().ask, create_game=asked), PATIENCE_S)
        if answer.create_game.error != sc.ResponseCreateGame.InvalidMapPath:
            return f"{path.name} was opened"
    return ""


async def _replays(_: Path) -> str:
    client = _game()
    whole = client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
    dice = random.Random(5)
    for _number in range(60):
        data = bytearray(whole)
        for _change in range(dice.randint(1, 4)):
            data[dice.randrange(len(data))] = dice.randrange(256)
        broken = bytes(data[: dice.choice((len(data), dice.randrange(len(data))))])
        if fault := _fault_of(
            client, sc.Request(replay_info=sc.RequestReplayInfo(replay_data=broken)).SerializeToString()
        ):
            return fault
    return ""


# the command line -----------------------------------------------------------------------------------------------------


async def _run(*arguments: str, **environ: str) -> tuple[int, str]:
    """Run the simulator's command with these variables; return its exit code and what it said."""
    code = "import sys; from khala_simulator.cli import app; app()"
    child = await asyncio.create_subprocess_exec(
        sys.executable, "-c", code, *arguments, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
        env={**os.environ, **environ},
    )  # fmt: skip
    try:
        said, _ = await asyncio.wait_for(child.communicate(), PATIENCE_S)
    except TimeoutError:
        child.kill()
        await child.wait()
        return 1, f"it said nothing for {PATIENCE_S:g} s"
    return child.returncode or 0, said.decode(errors="replace")


async def _install_over_a_file(directory: Path) -> str:
    (directory / "taken").write_bytes(b"x")
    code, said = await _run("install", str(directory / "taken" / "sc2"))
    return "" if code == 1 and "Not installed" in said and "Traceback" not in said else said[-200:]


async def _install_what_is_no_map(directory: Path) -> str:
    maps = directory / "maps"
    maps.mkdir()
    (maps / "a.SC2Map").write_bytes(b"not a map")
    os.mkfifo(maps / "b.SC2Map")
    (maps / "c.SC2Map").write_bytes(b"MPQ\x1a" + bytes(100))
    code, said = await _run("install", str(directory / "sc2"), "--maps", str(maps))
    return "" if code == 0 and said.count("Left out") == 2 and "Traceback" not in said else said[-200:]


async def _serve_at_a_taken_port(_: Path) -> str:
    sock = listen("127.0.0.1", 0)
    try:
        code, said = await _run("serve", "--port", str(sock.getsockname()[1]))
    finally:
        sock.close()
    return "" if code and "cannot listen" in said and "Traceback" not in said else said[-200:]


def _make_evil_path(directory: Path) -> Path:
    return directory / "\x1b]0;owned\x07\u202e"


def _make_forged_install(directory: Path) -> Path:
    """Make an install whose executable is a program of its own, which must not run to tell what it is."""
    game = directory / "forged" / "Versions" / "Base75689" / "SC2_x64"
    game.parent.mkdir(parents=True)
    game.write_text(f"#!/bin/sh\ntouch {directory}/it-ran\n")
    game.chmod(0o755)
    return directory / "forged"


def _make_pipe_install(directory: Path) -> Path:
    game = directory / "pipe" / "Versions" / "Base75689" / "SC2_x64"
    game.parent.mkdir(parents=True)
    os.mkfifo(game)
    return directory / "pipe"


SC2PATHS: Final[dict[str, tuple[Callable[[Path], Path], Kind]]] = {
    "a name with escape sequences": (_make_evil_path, "attack"),
    "an install with a forged program": (_make_forged_install, "attack"),
    "an install with a pipe for a program": (_make_pipe_install, "attack"),
    "in the home of nobody": (lambda _: Path("~nobody-of-this-name/sc2"), "quirk"),
    "a file": (lambda _: Path(__file__), "quirk"),
}


async def _info(directory: Path, make: Callable[[Path], Path]) -> str:
    """Ask which game this is, where SC2PATH names something odd."""
    path = make(directory)
    code, said = await _run("info", SC2PATH=str(path))
    if (directory / "it-ran").exists():
        return "a program that SC2PATH names was run"
    if not all(character.isprintable() or character == "\n" for character in said):
        return "an escape sequence reached the terminal"
    return "" if code == 0 and "llm_smac/" in said and "(this simulator)" not in said else said[-200:]


def _row(door: str, what: str, play: Play, kind: Kind = "attack") -> Row:
    return Row(door, what, play, kind)


_game_row, _map_row = partial(_row, "game: requests"), partial(_row, "game: maps")
_socket_row, _command_row = partial(_row, "khala sc2 serve"), partial(_row, "khala sc2 install")
_BOMB = "\n".join(["a0: &a0 {x: 1}", *(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}" for i in range(1, 12))])
_ROW = HEAD + "units: [{player: 1, unit: Marine, at: {x: {from: 0, to: 1.0e+9}, y: 3}}]\n"

ROWS: Final[tuple[Row, ...]] = (
    _game_row("requests and actions without their parts", _request(_without_parts), "quirk"),
    _game_row("points at infinity, negative abilities, unknown tags", _request(_numbers)),
    _game_row("units of unknown types, for players who are not there", _request(_unknown_types)),
    _game_row("questions about nowhere", _request(_questions)),
    _game_row("100 000 tags, 2 000 actions", _request(_giants)),
    _game_row("texts that are no UTF-8", _broken_texts),
    _game_row("300 requests with broken bytes", _broken_bytes, "fault"),
    _game_row("60 times 2 billion units", _crowd),
    _game_row("60 broken replays", _replays, "fault"),
    _socket_row("a page of the web", _visit("http://evil.example")),
    _socket_row("a page in a frame, which has no origin", _visit("null")),
    _socket_row("a page of another port", _visit("http://127.0.0.1:80")),
    _socket_row("a page whose name points here", _visit("http://evil.example:{port}", "evil.example:{port}")),
    _socket_row("PySC2's library, which sends an origin", _lan_client, "quirk"),
    _socket_row("a frame that is cut off", _frames(b"\x82\xff\0\0\0\0\x02\xfa\xf0"), "fault"),
    _socket_row("a frame of 9 exabytes", _frames(b"\x82\xff" + b"\x7f" + b"\xff" * 7 + bytes(4))),
    _socket_row("frames with reserved bits and unknown kinds", _frames(b"\xf2\x81\0\0\0\0x", b"\x83\x80\0\0\0\0")),
    _socket_row("a text and a ping in place of requests", _text_frame, "quirk"),
    _socket_row("a second client", _second_client, "quirk"),
    _map_row("a scenario nested 200 000 deep", _scenario(HEAD + "triggers: " + "[" * 200_000)),
    _map_row("aliases of aliases", _scenario(_BOMB)),
    _map_row("a terrain of 10 billion cells", _scenario(HEAD.replace("[32, 32]", "[100000, 100000]"))),
    _map_row("a row of a billion units", _scenario(_ROW)),
    _map_row("150 mutated scenarios", _mutations, "fault"),
    _map_row("a unit off the map", _map(lambda: MARK + HEAD.encode() + b"points: {a: [99999, 3]}\n"), "fault"),
    _map_row("an archive that is cut off", _map(_cut_archive), "fault"),
    _map_row("pipes and devices for a map", _devices),
    _command_row("a file where its folder is to be", _install_over_a_file, "fault"),
    _command_row("--maps with files that are no maps", _install_what_is_no_map, "quirk"),
    _socket_row("a port that is taken", _serve_at_a_taken_port, "fault"),
    *(
        _row("khala sc2 info", f"SC2PATH is {what}", partial(_info, make=make), kind)
        for what, (make, kind) in SC2PATHS.items()
    ),
)  # fmt: skip
