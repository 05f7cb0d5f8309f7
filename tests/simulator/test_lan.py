"""One game in several processes: they find each other, stay in step, see the same world, and end cleanly."""

from __future__ import annotations

import asyncio
import socket
from typing import TYPE_CHECKING, Any, ClassVar

import pytest
from s2clientprotocol import common_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process import joining, lan, lockstep
from khala_simulator.process.client import Client, ResponseError, command, interface
from khala_simulator.process.clock import SharedClock
from khala_simulator.process.lan import HOST
from khala_simulator.process.session import Session
from khala_simulator.process.status import Status

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

PARTICIPANT, OBSERVER = sc.PlayerSetup(type=sc.Participant), sc.PlayerSetup(type=sc.Observer)
MOVE = 16
THREE = b"""# A map of Khala's simulator
name: three
family: test
title: A Zealot for each of three
terrain: agria_open
players: {1: {race: protoss, control: agent}, 2: {race: protoss, control: agent}, 3: {race: protoss, control: agent}}
triggers:
  - name: spawn
    when: [start]
    do:
      - create: {player: 1, unit: Zealot, at: [8, 8]}
      - create: {player: 2, unit: Zealot, at: [24, 8]}
      - create: {player: 3, unit: Zealot, at: [16, 24]}
"""


class Process:
    """A game process and its client, without the websocket between them."""

    started: ClassVar[list[Process]] = []

    def __init__(self, base_build: int = 75689) -> None:
        self.session = Session(".", base_build)
        self.started.append(self)

    async def ask(self, **request: Any) -> sc.Response:
        response = sc.Response.FromString(await self.session.answer(sc.Request(**request).SerializeToString()))
        if response.error:
            raise ResponseError(*response.error)
        return response

    async def create(self, players: int = 2, observers: int = 0, **options: Any) -> None:
        game_map = sc.LocalMap(map_path="llm_smac/2s3z.SC2Map") if players == 2 else sc.LocalMap(map_data=THREE)
        setups = [PARTICIPANT] * players + [OBSERVER] * observers
        request = sc.RequestCreateGame(local_map=game_map, random_seed=1, player_setup=setups, **options)
        assert not (await self.ask(create_game=request)).create_game.HasField("error")

    async def join(self, port: int, **options: Any) -> sc.ResponseJoinGame:
        options = {"options": interface(screen=0), "race": common_pb2.Protoss, **options}
        if "observed_player_id" in options:
            del options["race"]
        request = sc.RequestJoinGame(server_ports=sc.PortSet(game_port=port, base_port=port), shared_port=0, **options)
        return (await self.ask(join_game=request)).join_game

    async def step(self, count: int = 1) -> sc.Response:
        return await self.ask(step=sc.RequestStep(count=count))

    async def observe(self) -> sc.ResponseObservation:
        return (await self.ask(observation=sc.RequestObservation())).observation

    async def act(self, *actions: sc.Action) -> None:
        assert list((await self.ask(action=sc.RequestAction(actions=actions))).action.result) == [1] * len(actions)

    async def own_tags(self) -> list[int]:
        units = (await self.observe()).observation.raw_data.units
        return [unit.tag for unit in units if unit.alliance == raw_pb2.Self]

    async def replay(self) -> bytes:
        return (await self.ask(save_replay=sc.RequestSaveReplay())).save_replay.data

    @property
    def loop(self) -> int:
        return self.session._process.table.game.world.loop

    @property
    def digest(self) -> str:
        return self.session._process.table.game.world.digest()


@pytest.fixture(autouse=True)
async def no_link_left() -> AsyncIterator[None]:
    yield
    while Process.started:
        Process.started.pop().session._process.play(None)
    for _ in range(5):  # a link is closed when the event loop has said so to both ends
        await asyncio.sleep(0.001)


@pytest.fixture(autouse=True)
def nobody_waits_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lan, "PARTING_S", 0.05)


@pytest.fixture
def port() -> int:
    with socket.socket() as sock:
        sock.bind((HOST, 0))
        number: int = sock.getsockname()[1]
        return number


async def begin(port: int, players: int = 2, **options: Any) -> list[Process]:
    """Return processes with a game that all of them have joined, the host first."""
    processes = [Process() for _ in range(players)]
    await processes[0].create(players, **options)
    joined = await asyncio.gather(*(process.join(port) for process in processes))
    assert joined[0].player_id == 1
    order = {answer.player_id: process for answer, process in zip(joined, processes, strict=True)}
    return [order[number] for number in sorted(order)]


async def together(processes: list[Process], count: int = 1) -> list[sc.Response]:
    return await asyncio.gather(*(process.step(count) for process in processes))


async def is_waiting(task: asyncio.Task[Any]) -> bool:
    """Return whether a request still waits after everything that can happen by itself has happened."""
    done, _ = await asyncio.wait([task], timeout=0.1)
    return not done


# joining --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", ["host", "guest"])
async def test_nobody_has_joined_before_all_have(port: int, first: str) -> None:
    host, guest = Process(), Process()
    await host.create()
    early, late = (host, guest) if first == "host" else (guest, host)
    waiting = asyncio.create_task(early.join(port))
    assert await is_waiting(waiting)
    answers = {late: await late.join(port), early: await waiting}
    assert (answers[host].player_id, answers[guest].player_id) == (1, 2)
    assert host.session.status is guest.session.status is Status.in_game
    for number, process in ((1, host), (2, guest)):
        assert (await process.observe()).observation.player_common.player_id == number
        info = (await process.ask(game_info=sc.RequestGameInfo())).game_info
        assert [player.type for player in info.player_info] == [sc.Participant] * 2
        assert [player.HasField("race_actual") for player in info.player_info] == [number == 1, number == 2]


async def test_each_client_has_its_own_interface_and_name(port: int) -> None:
    host, guest = Process(), Process()
    await host.create()
    wide = interface(screen=32, minimap=32)
    await asyncio.gather(host.join(port, player_name="Artanis"), guest.join(port, player_name="Zeratul", options=wide))
    info = (await guest.ask(game_info=sc.RequestGameInfo())).game_info
    assert [player.player_name for player in info.player_info] == ["Artanis", "Zeratul"]
    assert info.options == wide
    assert not (await host.observe()).observation.HasField("feature_layer_data")
    assert (await guest.observe()).observation.feature_layer_data.renders.unit_type.size.x == 32


@pytest.mark.parametrize("role", ["host", "guest"])
async def test_a_process_that_waits_in_vain_says_so(port: int, role: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joining, "PATIENCE_S", 0.2)
    process = Process()
    if role == "host":
        await process.create()
    before = process.session.status
    answer = await process.join(port)
    assert answer.error == sc.ResponseJoinGame.NetworkError
    assert answer.error_details in {
        f"No game to join on port {port} of 127.0.0.1 for 0.2 s",
        f"Not everybody joined on port {port} of 127.0.0.1 within 0.2 s",
    }
    assert process.session.status is before


async def test_a_client_that_gives_up_joining_frees_its_place(port: int) -> None:
    host, impatient, guest = Process(), Process(), Process()
    await host.create(players=3)
    hosting, leaving = asyncio.create_task(host.join(port)), asyncio.create_task(impatient.join(port))
    assert await is_waiting(leaving)
    leaving.cancel()
    others = [asyncio.create_task(process.join(port)) for process in (guest, Process())]
    assert sorted([(await hosting).player_id, *[(await other).player_id for other in others]]) == [1, 2, 3]
    assert impatient.session.status is Status.launched


async def test_a_host_that_gives_up_can_try_again(port: int) -> None:
    host, guest = Process(), Process()
    await host.create()
    hosting, visiting = asyncio.create_task(host.join(port)), asyncio.create_task(guest.join(port))
    visiting.cancel()
    assert await is_waiting(hosting)
    hosting.cancel()
    await asyncio.wait([hosting, visiting])
    assert host.session.status is Status.init_game
    await asyncio.gather(host.join(port), guest.join(port))
    assert (await together([host, guest]))[0].status == sc.in_game


@pytest.mark.parametrize(
    ("guest", "options", "error", "details"),
    [
        (Process(), {"observed_player_id": 0}, "GameFull", "No place for an observer is free"),
        (Process(), {"observed_player_id": 7}, "InvalidObservedPlayerId", "There is no player 7"),
        (Process(92440), {}, "NetworkError", "The host plays build 75689, and the guest another one"),
    ],
)
async def test_a_guest_that_cannot_be_taken_is_told_why(
    port: int, guest: Process, options: dict[str, Any], error: str, details: str
) -> None:
    host = Process()
    await host.create()
    hosting = asyncio.create_task(host.join(port))
    answer = await guest.join(port, **options)
    assert (sc.ResponseJoinGame.Error.Name(answer.error), answer.error_details) == (error, details)
    assert guest.session.status is Status.launched
    await Process().join(port)
    assert (await hosting).player_id == 1


async def test_a_port_that_is_taken_is_told(port: int) -> None:
    host = Process()
    await host.create()
    with socket.socket() as sock:
        sock.bind((HOST, port))
        sock.listen()
        answer = await host.join(port)
    assert answer.error == sc.ResponseJoinGame.NetworkError
    assert "address already in use" in answer.error_details


@pytest.mark.parametrize("noise", [b"GET / HTTP/1.1\r\n\r\n", b"\x03\0\0\0abc", b"\xff" * 10, b""])
async def test_whoever_else_knocks_is_sent_away(port: int, noise: bytes) -> None:
    host, guest = Process(), Process()
    await host.create()
    hosting = asyncio.create_task(host.join(port))
    assert await is_waiting(hosting)
    reader, writer = await asyncio.open_connection(HOST, port)
    writer.write(noise)
    writer.write_eof()
    await reader.read()
    writer.close()
    await asyncio.gather(hosting, guest.join(port))
    assert guest.session.status is Status.in_game


# in step --------------------------------------------------------------------------------------------------------------


async def test_a_step_returns_when_its_own_target_is_reached(port: int) -> None:
    host, guest = await begin(port)
    long = asyncio.create_task(host.step(4))
    assert (await guest.step(2)).step.simulation_loop == 2
    assert await is_waiting(long)
    assert (await guest.step(2)).step.simulation_loop == 4
    assert (await long).step.simulation_loop == 4
    assert (host.loop, guest.loop) == (4, 4)


async def test_what_a_player_does_is_reported_two_loops_later(port: int) -> None:
    players = await begin(port)
    for index, player in enumerate(players):
        await together(players)
        tags = await player.own_tags()
        loop = player.loop
        await player.act(command(MOVE, tags[:1], point=(16, 16)))
        await together(players)
        assert not (await player.observe()).actions
        await together(players)
        (action,) = (await player.observe()).actions
        assert action.game_loop == loop + 1
        assert action.action_raw.unit_command.ability_id == MOVE
        assert not (await players[1 - index].observe()).actions


async def test_a_single_player_is_told_one_loop_later() -> None:
    client = Client()
    client.play(options=interface(screen=0))
    tags = [unit.tag for unit in client.observe().observation.raw_data.units if unit.alliance == raw_pb2.Self]
    client.act(command(MOVE, tags[:1], point=(16, 16)))
    (action,) = client.step().actions
    assert action.game_loop == 0


async def test_both_processes_have_the_same_world(port: int) -> None:
    players = await begin(port)
    strides = {players[0]: 3, players[1]: 5}

    async def play(player: Process) -> None:
        while player.loop < 240:
            if tags := await player.own_tags():
                await player.act(command(23, tags, point=(4.0 + player.loop % 24, 16)))
            await player.step(strides[player])

    await asyncio.gather(*map(play, players))
    await asyncio.gather(*(player.step(250 - player.loop) for player in players))
    assert players[0].loop == players[1].loop == 250
    assert players[0].digest == players[1].digest
    assert (await players[0].observe()).observation.score.score_details.total_damage_dealt.life > 0


async def test_chat_reaches_the_other_process(port: int) -> None:
    players = await begin(port)
    chat = sc.Action(action_chat=sc.ActionChat(channel=sc.ActionChat.Broadcast, message="gl hf"))
    await players[0].act(chat)
    await together(players, 2)
    for player in players:
        assert [(c.player_id, c.message) for c in (await player.observe()).chat] == [(1, "gl hf")]


async def test_three_play_and_two_go_on_when_one_leaves(port: int) -> None:
    processes = await begin(port, players=3)
    await together(processes, 5)
    assert len({process.digest for process in processes}) == 1
    waiting = [asyncio.create_task(process.step(10)) for process in processes[:2]]
    assert await is_waiting(waiting[0])
    await processes[2].ask(leave_game=sc.RequestLeaveGame())
    assert [(await task).status for task in waiting] == [sc.in_game] * 2
    assert processes[0].digest == processes[1].digest
    await processes[1].ask(leave_game=sc.RequestLeaveGame())
    assert (await processes[0].step()).status == sc.ended


async def test_worlds_that_differ_end_the_game(
    port: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lockstep, "CHECK_LOOPS", 16)
    players = await begin(port)
    players[1].session._process.table.game.world.life[1] -= 1.0
    assert {answer.status for answer in await together(players, 20)} == {sc.in_game}
    assert {answer.status for answer in await together(players, 20)} == {sc.ended}
    assert "StarCraft II simulator: at loop 16 the world of member" in capsys.readouterr().err


# the end --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("who", ["host", "guest"])
@pytest.mark.parametrize("how", ["leaves", "creates", "quits", "vanishes"])
@pytest.mark.parametrize("when", ["idle", "in a step"])
async def test_a_player_who_goes_ends_the_game_of_the_other(port: int, who: str, how: str, when: str) -> None:
    players = await begin(port)
    await together(players, 3)
    gone, left = players if who == "host" else reversed(players)
    stepping = asyncio.create_task(left.step(8)) if when == "in a step" else None
    if stepping is not None:
        assert await is_waiting(stepping)
    match how:
        case "leaves":
            assert (await gone.ask(leave_game=sc.RequestLeaveGame())).status == sc.launched
        case "creates":
            await gone.create()
        case "quits":
            assert (await gone.ask(quit=sc.RequestQuit())).status == sc.quit
        case "vanishes":
            peers = gone.session._process.table.peers
            assert peers is not None
            peers.close()
    answer = await (stepping or left.step(8))
    assert (answer.status, answer.step.simulation_loop) == (sc.ended, 3)
    results = {r.player_id: r.result for r in (await left.observe()).player_result}
    number = players.index(left) + 1
    assert results == {number: sc.Victory, 3 - number: sc.Defeat}


async def test_who_leaves_a_decided_game_first_is_answered_when_the_other_has_left_too(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lan, "PARTING_S", 60.0)
    host, guest = await begin(port)
    leaving = asyncio.create_task(host.ask(leave_game=sc.RequestLeaveGame()))
    assert await is_waiting(leaving)
    assert (await guest.step(8)).status == sc.ended
    assert [r.result for r in (await guest.observe()).player_result] == [sc.Defeat, sc.Victory]
    assert not leaving.done()
    assert (await guest.ask(leave_game=sc.RequestLeaveGame())).status == sc.launched
    assert (await leaving).status == sc.launched


async def test_a_client_that_vanishes_while_it_leaves_has_left(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lan, "PARTING_S", 60.0)
    host, guest = await begin(port)
    leaving = asyncio.create_task(host.ask(leave_game=sc.RequestLeaveGame()))
    assert await is_waiting(leaving)
    leaving.cancel()
    assert (await leaving).status == sc.launched
    assert (await guest.step(8)).status == sc.ended


async def test_the_same_ports_serve_one_game_after_the_other(port: int) -> None:
    host, guest = Process(), Process()
    shipped = b"# A map of Khala's simulator\nllm_smac/2s3z\n"
    for process in (host, guest):
        await process.ask(save_map=sc.RequestSaveMap(map_path="saved.SC2Map", map_data=shipped))
    create = sc.RequestCreateGame(local_map=sc.LocalMap(map_path="saved.SC2Map"), player_setup=[PARTICIPANT] * 2)
    for _ in range(3):
        await host.ask(create_game=create)
        await asyncio.gather(guest.join(port), host.join(port))
        assert [answer.step.simulation_loop for answer in await together([host, guest], 4)] == [4, 4]
        await asyncio.gather(*(process.ask(leave_game=sc.RequestLeaveGame()) for process in (host, guest)))


async def test_a_game_of_several_processes_is_not_restarted(port: int) -> None:
    players = await begin(port)
    answer = (await players[1].ask(restart_game=sc.RequestRestartGame())).restart_game
    assert answer.error == sc.ResponseRestartGame.LaunchError
    assert answer.error_details == "Only a game of one process can be restarted"


async def test_a_step_that_its_client_gave_up_does_not_hold_the_other_one_up(port: int) -> None:
    host, guest = await begin(port)
    given_up = asyncio.create_task(host.step(4))
    assert await is_waiting(given_up)
    given_up.cancel()
    assert (await guest.step(4)).step.simulation_loop == 4
    await host.act(sc.Action(), command(MOVE, (await host.own_tags())[:1], point=(16, 16)))
    assert [answer.step.simulation_loop for answer in await asyncio.gather(host.step(6), guest.step(2))] == [6, 6]
    assert host.digest == guest.digest


# replays and observers ------------------------------------------------------------------------------------------------


async def test_both_replays_show_what_each_player_saw(port: int) -> None:
    players = await begin(port)
    seen: dict[Process, list[sc.ResponseObservation]] = {player: [] for player in players}
    for loop in range(0, 60, 4):
        for player in players:
            camera = sc.Action()
            centre = camera.action_raw.camera_move.center_world_space
            centre.x, centre.y = 10 + loop % 7, 12 + players.index(player)
            await player.act(camera, command(23, (await player.own_tags())[: 1 + loop % 3], point=(16, 16)))
        await together(players, 4)
        for player in players:
            seen[player].append(await player.observe())
    replays = [await player.replay() for player in players]
    assert replays[0] == replays[1]
    for number, player in enumerate(players, start=1):
        viewer = Client()
        options = interface(screen=0)
        request = sc.RequestStartReplay(replay_data=replays[0], observed_player_id=number, options=options)
        assert not viewer.ask(start_replay=request).start_replay.HasField("error")
        again = [viewer.step(4) for _ in seen[player]]
        assert [o.observation.raw_data.player for o in again] == [o.observation.raw_data.player for o in seen[player]]
        assert [o.observation.raw_data.units for o in again] == [o.observation.raw_data.units for o in seen[player]]
        assert again[-1].actions == seen[player][-1].actions


async def test_an_observer_has_a_process_of_its_own(port: int) -> None:
    host, guest, watcher = Process(), Process(), Process()
    await host.create(observers=1)
    joined = await asyncio.gather(guest.join(port), watcher.join(port, observed_player_id=0), host.join(port))
    assert [answer.player_id for answer in joined] == [2, 3, 1]
    await together([host, guest, watcher], 6)
    assert len({process.digest for process in (host, guest, watcher)}) == 1
    units = (await watcher.observe()).observation.raw_data.units
    assert {unit.owner for unit in units} == {1, 2}
    await watcher.ask(leave_game=sc.RequestLeaveGame())
    assert [answer.status for answer in await together([host, guest], 6)] == [sc.in_game] * 2


# real time ------------------------------------------------------------------------------------------------------------


class Wall:
    """A wall clock that only moves when a task sleeps, and gives the other tasks their turn then."""

    now_s = 100.0

    def now(self) -> float:
        return self.now_s

    async def sleep(self, duration_s: float) -> None:
        self.now_s += duration_s
        await asyncio.sleep(0)


async def test_in_real_time_nobody_waits_for_a_client(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    wall = Wall()
    monkeypatch.setattr(joining, "SharedClock", lambda game: SharedClock(game, wall.now, wall.sleep))
    host, guest = await begin(port, realtime=True)
    seen = (await host.ask(observation=sc.RequestObservation(game_loop=100))).observation
    assert seen.observation.game_loop >= 100
    seen = (await guest.ask(observation=sc.RequestObservation(game_loop=112))).observation
    assert seen.observation.game_loop >= 112
    with pytest.raises(ResponseError, match="step is not possible in a game in real time"):
        await guest.step()
    await guest.ask(leave_game=sc.RequestLeaveGame())
    end = await host.ask(observation=sc.RequestObservation(game_loop=10_000))
    assert end.status == sc.ended
