"""Agents that do what a test says, and a battle in which nothing moves."""

from __future__ import annotations

import asyncio
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import pytest
from rich.console import Console
from s2clientprotocol import error_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.errors import GameError
from khala_bridge.game.game import GameIdentity, GameThread, Sides, StepResult
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.state import read_info, read_snapshot
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_orchestrator.match.turn import Question, Turn
from khala_orchestrator.roster import Roster, Seat
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import decode_as, encode
from khala_protocol.keys import Topic, agent_key, alive_key
from khala_protocol.messages import Clock, Observation, Reply, Report, Run, View

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
    from contextlib import AbstractAsyncContextManager

    from khala_bridge.act import Plan
    from khala_bridge.state import Snapshot
    from khala_protocol.bus import Sample, Subscription, Token
    from khala_protocol.bus.memory import MemoryBus
    from khala_protocol.messages import AgentReport, Outcome, Result, Wire

    Table = Callable[..., AbstractAsyncContextManager[tuple[Turn, list["Peer"]]]]

P = ParamSpec("P")
T = TypeVar("T")

RUN = "test"


# --- agents on a bus in memory ------------------------------------------------------------------------


class Peer:
    """An agent that says what a test tells it to, when the test tells it to."""

    def __init__(self, bus: MemoryBus, seat: Seat) -> None:
        self.bus, self.seat = bus, seat
        self._observations: Subscription[Sample] | None = None
        self._tokens: dict[str, Token] = {}

    async def arrive(self, instance: str = "1") -> None:
        key = agent_key(RUN, *self.seat, Topic.OBSERVATION)
        self._observations = await self.bus.subscribe(key, Delivery.STATE)
        self._tokens[instance] = await self.bus.announce(alive_key(RUN, *self.seat, instance))

    async def leave(self, instance: str = "1") -> None:
        await self._tokens.pop(instance).close()

    async def observed(self) -> Observation:
        assert self._observations is not None
        return decode_as(Observation, (await anext(self._observations)).payload)

    async def put(self, topic: Topic, payload: bytes) -> None:
        publisher = await self.bus.publisher(agent_key(RUN, *self.seat, topic), Delivery.SPEECH)
        await publisher.put(payload)

    async def reply(self, text: str = "", **changes: Any) -> None:
        """Answer step 0, or what else `changes` say."""
        side, name = self.seat
        fields = {"run": RUN, "side": side, "agent": name, "episode": 0, "step": 0, "text": text}
        await self.put(Topic.REPLY, encode(Reply.model_validate(fields | changes)))

    async def answer(self, seen: Observation, text: str = "", **changes: Any) -> None:
        await self.reply(text, **{"episode": seen.episode, "step": seen.step} | changes)

    async def play(self, react: Callable[[Peer, Observation], Awaitable[None]]) -> None:
        """Do the same at each observation, until cancelled."""
        while True:
            await react(self, await self.observed())


@pytest.fixture
def broker() -> MemoryBroker:
    return MemoryBroker()


@pytest.fixture
def peer(broker: MemoryBroker) -> Callable[[Seat], Peer]:
    """An agent in a session of its own, which has not arrived yet."""
    return lambda seat: Peer(broker.session(), seat)


@pytest.fixture
def table(broker: MemoryBroker) -> Table:
    """A turn with agents that are all there."""

    @asynccontextmanager
    async def lay(*seats: Seat, **options: Any) -> AsyncIterator[tuple[Turn, list[Peer]]]:
        host = broker.session()
        peers = [Peer(broker.session(), seat) for seat in seats]
        for one in peers:
            await one.arrive()
        async with Roster(host, RUN, seats) as roster, Turn(host, RUN, roster, **options) as turn:
            await roster.assemble(seats, 1)
            yield turn, peers

    return lay


@pytest.fixture
def observe() -> Callable[..., list[Question]]:
    def make(*seats: Seat, step: int = 0, within_s: float | None = None) -> list[Question]:
        return [
            Question(
                Observation(
                    run=RUN,
                    side=seat.side,
                    agent=seat.agent,
                    episode=0,
                    step=step,
                    game_loop=8 * step,
                    answer_within_s=within_s,
                    text="",
                    view=View(time_s=0.0),
                )
            )
            for seat in seats
        ]

    return make


# --- a game without a game ----------------------------------------------------------------------------

STALKER, ZEALOT, ENEMY = 0x1, 0x2, 0xB
_UNITS = (
    (STALKER, "Stalker", 15, raw_pb2.Self),
    (ZEALOT, "Zealot", 17, raw_pb2.Self),
    (ENEMY, "Zealot", 18, raw_pb2.Enemy),
)


def make_snapshot(
    *, loop: int = 0, dead: Sequence[int] = (), refuse: Sequence[int] = (), outcome: Outcome | None = None
) -> Snapshot:
    """A Stalker and a Zealot before a Zealot of the enemy's; some died, and some could not do what was ordered."""
    response = sc_pb.ResponseObservation()
    response.observation.game_loop = loop
    response.observation.player_common.player_id = 1
    for tag, name, x, alliance in _UNITS:
        if tag not in dead:
            known = knowledge()[name]
            unit = response.observation.raw_data.units.add(
                tag=tag, unit_type=known.id, alliance=alliance, display_type=raw_pb2.Visible, build_progress=1.0
            )
            unit.cloak = raw_pb2.NotCloaked
            unit.health = unit.health_max = known.health
            unit.shield = unit.shield_max = known.shield
            unit.pos.x, unit.pos.y, unit.pos.z = x, 16, 10
    for tag in refuse:
        response.action_errors.add(unit_tag=tag, result=error_pb2.CantTargetAirUnits)
    details = response.observation.score.score_details
    details.killed_minerals.army = 100.0 * (ENEMY in dead)
    details.lost_minerals.army = 125.0 * (STALKER in dead)
    info = sc_pb.ResponseGameInfo()
    info.start_raw.map_size.x = info.start_raw.map_size.y = 32
    info.start_raw.playable_area.p1.x = info.start_raw.playable_area.p1.y = 32
    layers = info.options.feature_layer
    layers.width = 24
    layers.resolution.x = layers.resolution.y = 128
    layers.minimap_resolution.x = layers.minimap_resolution.y = 64
    return read_snapshot(
        response, read_info(info, facts_of("multi")), dead=frozenset(dead), outcome=outcome, ended=outcome is not None
    )


@dataclass
class StillGame:
    """A `Game` in which nothing happens but what `after` says: by number of the step that leads there."""

    after: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    fails_at: int | None = None
    """Step at which the game dies."""
    calls: list[str] = field(default_factory=list)

    @property
    def info(self) -> GameIdentity:
        return GameIdentity("4.10.0.75689", "B89B", "2s3z.SC2Map", "0" * 64)

    def reset(self) -> tuple[Snapshot, ...]:
        self.calls.append("reset")
        self._steps = self._loop = 0
        return (make_snapshot(),)

    def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        self.calls.append("act")
        if self._steps == self.fails_at:
            raise GameError("the game died")
        (plan,) = plans
        self._loop += next(plan).loops
        after = make_snapshot(loop=self._loop, **self.after.get(self._steps, {}))
        self._steps += 1
        try:
            plan.send(after)
        except StopIteration as done:
            return (StepResult(after, done.value, env_steps=1),)
        raise AssertionError("the raw executor plays a plan in one step")

    def whole(self) -> None:
        """Show no more than the side sees."""

    def kill(self) -> None:
        self.calls.append("kill")

    def close(self) -> None:
        self.calls.append("close")


class _Here(ThreadPoolExecutor):
    """Runs at once and on the spot: the clock does not jump while the game plays."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001  # whoever waits gets it
            future.set_exception(error)
        return future


@pytest.fixture
def start() -> Callable[[StillGame], Awaitable[Sides]]:
    """Starts a game in the loop's own thread."""

    async def started(game: StillGame) -> Sides:
        thread = GameThread(lambda: game)
        thread._threads = _Here()
        return await Sides(thread, [RawExecutor()]).__aenter__()

    return started


@pytest.fixture
def still_game() -> Callable[..., StillGame]:
    return StillGame


@pytest.fixture
def snapshot() -> Callable[..., Snapshot]:
    return make_snapshot


@pytest.fixture
def config() -> Callable[..., MatchConfig]:
    """A match of Stalkers and Zealots on one side, of three steps in one episode, if nothing else is said."""

    def make(*, required: bool = True, **changes: Any) -> MatchConfig:
        match = {name: changes.pop(name) for name in ("episodes", "assemble_s", "record", "game") if name in changes}
        task = change(load_task("2s3z_pair"), **{"max_steps": 3, "max_wait_s": 10.0} | changes)
        agents = tuple(agent.model_copy(update={"required": required}) for agent in task.agents)
        task = task.model_copy(update={"agents": agents})
        return MatchConfig(task=task, run=RUN, **match)

    return make


# --- what is printed ----------------------------------------------------------------------------------


@pytest.fixture
def printed() -> Callable[..., list[str]]:
    """The lines of something that rich prints, without colours and blanks at their ends."""

    def lines(*parts: Any, width: int = 100) -> list[str]:
        screen = Console(width=width, color_system=None, highlight=False)
        with screen.capture() as captured:
            for part in parts:
                screen.print(part)
        return [line.rstrip() for line in captured.get().splitlines()]

    return lines


@pytest.fixture
def card() -> Callable[..., Run]:
    """A run card."""

    def make(**changes: Any) -> Run:
        fields: dict[str, Any] = {
            "run": RUN,
            "task": "2s3z_pair",
            "map_name": "2s3z",
            "map_sha256": "0",
            "seed": 1,
            "episodes": 1,
            "game": "Khala simulator 0.1.0, as 4.10.0.75689",
            "executor": "raw",
            "clock": Clock(step_loops=11),
            "agents": (
                {"name": "Stalkers", "side": "blue", "teams": ("Stalker-1",)},
                {"name": "Zealots", "side": "blue", "teams": ("Zealot-1", "Zealot-2")},
            ),
            "catalogue_sha256": "0",
            "versions": {},
        }
        return Run.model_validate(fields | changes)

    return make


@pytest.fixture
def drain() -> Callable[[Subscription[Sample]], Awaitable[list[Sample]]]:
    """Ends a subscription and returns what had arrived."""

    async def rest(samples: Subscription[Sample]) -> list[Sample]:
        await samples.close()
        return [sample async for sample in samples]

    return rest


# --- a whole match --------------------------------------------------------------------------------------


async def agree(peer: Peer, seen: Observation) -> None:
    """Answer at once, and order nothing."""
    await peer.answer(seen)


@dataclass
class Hall:
    """Where a match is played: a broker, a game, agents of the side `blue`, and what the host showed of it."""

    broker: MemoryBroker
    game: StillGame
    side: Sides
    watched: list[Wire] = field(default_factory=list)

    async def play(
        self,
        config: MatchConfig,
        *,
        bus: MemoryBus | None = None,
        watch: Callable[[Wire], None] = lambda _: None,
        by: Callable[..., Awaitable[list[Result]]] = host,
        **agents: Callable[[Peer, Observation], Awaitable[None]] | None,
    ) -> list[Result]:
        """Host a match, or play it `by` another function.

        Agents that are not given order nothing, those that are None do not come.
        """
        given = {agent.name: agents.get(agent.name, agree) for agent in config.task.agents}
        reactions = {name: react for name, react in given.items() if react is not None}
        peers = [Peer(self.broker.session(), Seat("blue", name)) for name in reactions]
        for one in peers:
            await one.arrive()
        tasks = [asyncio.create_task(one.play(reactions[one.seat.agent])) for one in peers]

        def see(message: Wire) -> None:
            self.watched.append(message)
            watch(message)

        try:
            return await by(config, self.side, bus or self.broker.session(), watch=see)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            for one in peers:
                one.bus.kill()

    @property
    def reports(self) -> list[Report]:
        return [message for message in self.watched if isinstance(message, Report)]

    def of(self, agent: str) -> list[AgentReport]:
        """What became of one agent, step by step."""
        return [found for report in self.reports for found in report.agents if found.agent == agent]


@pytest.fixture
async def hall(broker: MemoryBroker, start: Callable[[StillGame], Awaitable[Sides]]) -> Hall:
    game = StillGame()
    return Hall(broker, game, await start(game))
