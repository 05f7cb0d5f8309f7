"""Requests made at random from the API's own descriptors, and broken on their way: the session answers them all."""

import asyncio
import socket
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import DecodeError, Message
from google.protobuf.message_factory import GetMessageClass
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, interface
from khala_simulator.process.lan import HOST
from khala_simulator.process.session import Session
from khala_simulator.process.status import LEGAL, Status

KINDS = [field.name for field in sc.Request.DESCRIPTOR.oneofs_by_name["request"].fields]
SCALARS: dict[int, st.SearchStrategy[Any]] = {
    FieldDescriptor.CPPTYPE_INT32: st.sampled_from([0, 1, 3, 23, 3674]) | st.integers(-(2**31), 2**31 - 1),
    FieldDescriptor.CPPTYPE_UINT32: st.sampled_from([0, 1, 2, 16, 74]) | st.integers(0, 2**32 - 1),
    FieldDescriptor.CPPTYPE_INT64: st.integers(-(2**63), 2**63 - 1),
    FieldDescriptor.CPPTYPE_UINT64: st.sampled_from([1 << 32 | s << 18 for s in range(8)]) | st.integers(0, 2**64 - 1),
    FieldDescriptor.CPPTYPE_FLOAT: st.sampled_from([0.0, 9.0, 16.0, 23.5]) | st.floats(width=32),
    FieldDescriptor.CPPTYPE_DOUBLE: st.floats(),
    FieldDescriptor.CPPTYPE_BOOL: st.booleans(),
}  # fmt: skip
PATHS = st.sampled_from(["", "2s3z", "llm_smac/2s3z.SC2Map", "../x", "\0", "x" * 300, "/"])
SLOW = [HealthCheck.too_slow, HealthCheck.filter_too_much]
LONG = 200
"""Loops in one step at most: the fuzzing is about requests, not about patience."""


def value(field: FieldDescriptor, depth: int) -> st.SearchStrategy[Any]:
    if field.message_type is not None:
        return message(field.message_type, depth - 1)
    if field.enum_type is not None:
        return st.sampled_from([v.number for v in field.enum_type.values])
    if field.type == FieldDescriptor.TYPE_STRING:
        return PATHS | st.text(max_size=8)
    if field.type == FieldDescriptor.TYPE_BYTES:
        return st.binary(max_size=30)
    return SCALARS[field.cpp_type]


def message(descriptor: Descriptor | None, depth: int = 5) -> st.SearchStrategy[Message]:
    assert descriptor is not None
    fields = {}
    for field in descriptor.fields:
        if field.message_type is not None and depth <= 0:
            continue
        one = value(field, depth)
        fields[field.name] = st.lists(one, max_size=3) if field.is_repeated else one

    def build(chosen: dict[str, Any]) -> Message:
        return GetMessageClass(descriptor)(**chosen)

    return st.fixed_dictionaries({}, optional=fields).map(build)


REQUESTS = {kind: message(sc.Request.DESCRIPTOR.fields_by_name[kind].message_type) for kind in KINDS}


def prepare(state: Status) -> Client:
    client = Client()
    if state is Status.init_game:
        client.create("2s3z")
    elif state is not Status.launched:
        client.play(options=interface(screen=32, minimap=32))
    if state is Status.ended:
        client.step(1440)
    if state is Status.in_replay:
        client.step(20)
        replay = client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
        options = interface(screen=32, minimap=32)
        client.ask(start_replay=sc.RequestStartReplay(replay_data=replay, observed_player_id=1, options=options))
    assert client.session.status is state
    return client


def tame(kind: str, body: Any) -> None:
    """Leave out what is legal and only takes long: endless steps, huge images, real time, waiting for others."""
    if kind == "join_game":
        body.ClearField("server_ports")
    if kind == "observation":
        body.ClearField("game_loop")
    if kind == "step":
        body.count = min(body.count, LONG)
    if kind == "create_game":
        body.realtime = False
    for size in ("resolution", "minimap_resolution"):
        if kind in {"join_game", "start_replay"} and body.HasField("options"):
            pixels = getattr(body.options.feature_layer, size)
            assume(pixels.x * pixels.y < 2**16 or pixels.x > 2**20 or pixels.y > 2**20)


def observe() -> Client:
    """Return a client that observes a game of computers."""
    client = Client()
    players = [sc.PlayerSetup(type=kind) for kind in (sc.Computer, sc.Computer, sc.Observer)]
    game_map = sc.LocalMap(map_path="llm_smac/2s3z")
    client.ask(create_game=sc.RequestCreateGame(local_map=game_map, player_setup=players))
    options = interface(screen=32, minimap=32)
    client.ask(join_game=sc.RequestJoinGame(observed_player_id=0, options=options))
    return client


STARTS = {state.name: partial(prepare, state) for state in Status if state is not Status.quit} | {"observer": observe}


@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
@settings(max_examples=settings().max_examples // 3, suppress_health_check=SLOW)
@given(data=st.data())
def test_no_request_breaks_a_session(start: Callable[[], Client], data: st.DataObject) -> None:
    client = start()
    for _ in range(6):
        kind = data.draw(st.sampled_from([k for k in KINDS if k != "quit"]))
        body = data.draw(REQUESTS[kind])
        tame(kind, body)
        raw = client.session.handle(sc.Request(id=3, **{kind: body}).SerializeToString())  # type: ignore[arg-type]  # kind is a field's name
        response = sc.Response.FromString(raw)
        assert response.id == 3
        assert Status(response.status) is client.session.status
        assert bool(response.error) != response.HasField(kind)  # type: ignore[arg-type]  # kind is a field's name
        assert not any(error.startswith("The simulator failed") for error in response.error)


def texts(descriptor: Descriptor | None) -> Iterator[tuple[str, ...]]:
    """Yield the path of every text in a message."""
    assert descriptor is not None
    for field in descriptor.fields:
        if field.message_type is not None:
            yield from ((field.name, *path) for path in texts(field.message_type))
        elif field.type == FieldDescriptor.TYPE_STRING:
            yield (field.name,)


TEXTS = [path for path in texts(sc.Request.DESCRIPTOR) if path[0] != "quit"]
MARK = "a text to be broken"


@pytest.mark.parametrize("path", TEXTS, ids=map(".".join, TEXTS))
def test_a_text_that_is_not_utf_8_is_refused_by_its_name(path: tuple[str, ...]) -> None:
    request = sc.Request(id=3)
    inner: Any = request
    for name in path[:-1]:
        inner = getattr(inner, name)
        inner = inner.add() if hasattr(inner, "add") else inner
    last = inner.DESCRIPTOR.fields_by_name[path[-1]]
    inner.MergeFrom(type(inner)(**{path[-1]: [MARK] if last.is_repeated else MARK}))
    broken = request.SerializeToString().replace(MARK.encode(), b"\xff" * len(MARK))
    state = next(state for state in LEGAL if path[0] in LEGAL[state] and state is not Status.ended)
    response = sc.Response.FromString(prepare(state).session.handle(broken))
    assert list(response.error) == [f"{'.'.join(path)} in the request is not a text in UTF-8"]
    assert (response.id, Status(response.status)) == (3, state)


@pytest.mark.parametrize("state", [Status.launched, Status.in_game], ids=lambda state: state.name)
@settings(max_examples=settings().max_examples // 2, suppress_health_check=SLOW)
@given(data=st.data())
def test_no_bytes_break_a_session(state: Status, data: st.DataObject) -> None:
    client = prepare(state)
    for _ in range(6):
        kind = data.draw(st.sampled_from([k for k in KINDS if k != "quit"]))
        body = data.draw(REQUESTS[kind])
        tame(kind, body)
        raw = bytearray(sc.Request(id=3, **{kind: body}).SerializeToString())  # type: ignore[arg-type]  # kind is a field's name
        for place, value in data.draw(st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), max_size=4)):
            raw[place % len(raw)] = value
        request = parsed(bytes(raw[: data.draw(st.integers(0, len(raw)) | st.just(len(raw)))]))
        response = sc.Response.FromString(client.session.handle(request))
        assert Status(response.status) is client.session.status
        assert not any(error.startswith("The simulator failed") for error in response.error)


def parsed(raw: bytes) -> bytes:
    """Return a broken request without what would only take long, if it still is a request."""
    try:
        request = sc.Request.FromString(raw)
    except DecodeError:
        return raw
    if (kind := request.WhichOneof("request")) in {None, "quit"}:
        return raw if kind is None else b""
    tame(kind, getattr(request, kind))
    return request.SerializeToString()


async def answer(session: Session, kind: str, body: Message) -> sc.Response:
    request = sc.Request(id=3, **{kind: body})  # type: ignore[arg-type]  # kind is a field's name
    async with asyncio.timeout(20):
        response = sc.Response.FromString(await session.answer(request.SerializeToString()))
    assert not any(error.startswith("The simulator failed") for error in response.error)
    return response


async def begin_over_lan() -> list[Session]:
    sessions = [Session("."), Session(".")]
    with socket.socket() as sock:
        sock.bind((HOST, 0))
        ports = sc.PortSet(game_port=sock.getsockname()[1], base_port=1)
    participant = sc.PlayerSetup(type=sc.Participant)
    create = sc.RequestCreateGame(local_map=sc.LocalMap(map_path="llm_smac/2s3z"), player_setup=[participant] * 2)
    join = sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=32, minimap=32), server_ports=ports)
    await answer(sessions[0], "create_game", create)
    await asyncio.gather(*(answer(session, "join_game", join) for session in sessions))
    assert [session.status for session in sessions] == [Status.in_game] * 2
    return sessions


@settings(max_examples=settings().max_examples // 5, suppress_health_check=SLOW)
@given(data=st.data())
def test_no_request_breaks_a_game_over_lan(data: st.DataObject) -> None:
    async def play(sessions: list[Session]) -> None:
        for _ in range(8):
            kind = data.draw(st.sampled_from([k for k in KINDS if k not in {"quit", "step"}]))
            body = data.draw(REQUESTS[kind])
            tame(kind, body)
            await answer(data.draw(st.sampled_from(sessions)), kind, body)
            await asyncio.gather(*(answer(session, "step", sc.RequestStep(count=4)) for session in sessions))
        worlds = [session._process.playing for session in sessions]
        if all(playing is not None and playing.peers is not None for playing in worlds):
            first, second = (playing.game.world for playing in worlds if playing is not None)
            assert first.loop != second.loop or first.digest() == second.digest()

    async def play_and_leave() -> None:
        sessions = await begin_over_lan()
        try:
            await play(sessions)
        finally:  # a draw may end the example
            for session in sessions:
                session._process.play(None)
            await asyncio.sleep(0.01)  # a link is closed when the event loop has said so to both ends

    asyncio.run(play_and_leave())
