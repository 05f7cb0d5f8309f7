"""Try on a running match over TLS what strangers and dishonest agents can do to it.

The match has the real host's parts (roster, turn, recording) around made-up observations, and two honest agents. Each
attack runs in a process of its own, as a session of bare Zenoh with no certificate, a foreign one, or that of the
agent Mallory, which has a seat in the match and plays in another process, too. "succeeded" counts what was read, or
what reached the host or an agent under a name that is not Mallory's; "late" are steps of honest agents without a reply
in time.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import logging
import socket
import sys
import tempfile
import time
from collections import Counter
from dataclasses import asdict, astuple, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import zenoh
from zenoh.handlers import Callback

from bench import paths
from bench.command_line import make_parser
from bench.tables import print_table
from bench.turns.bus import open_raw
from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_worker
from khala_bridge.game.game import GameIdentity
from khala_orchestrator.config import MatchConfig, load_task
from khala_orchestrator.match.cards import briefing, run_card
from khala_orchestrator.match.turn import Question, Turn
from khala_orchestrator.publish.announce import Announcer
from khala_orchestrator.publish.record import Listener, RecordingBus
from khala_orchestrator.roster import Roster, Seat
from khala_protocol.access import REPLY_BYTES, router_settings
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig, TlsFiles, host_port_of
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.certificates import certify_agent, files_of, make_authority
from khala_protocol.codec import encode
from khala_protocol.common_names import agent_name
from khala_protocol.keys import Topic, agent_key
from khala_protocol.messages import Observation, Reply, View
from khala_protocol.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator, Sequence

    from khala_protocol.bus import Bus, Publisher
    from khala_protocol.messages import Briefing

RUN, BLUE, RED = "siege", "blue", "red"
HONEST = ("Stalkers", "Zealots")
MALLORY = "Mallory"
ROOT, VICTIM = f"khala/{RUN}", f"khala/{RUN}/{BLUE}/{HONEST[0]}"
OWN = f"khala/{RUN}/{BLUE}/{MALLORY}"
FORGED = b"FORGED"
ANSWER_S = 1.0
PAUSE_S = 0.02
CALM_STEPS, RECOVER_S = 5, 20
MANY = 70_000
FRAME = FORGED + bytes(20_000)


class Tried(NamedTuple):
    """The outcome of an attack, as far as the attacker sees it."""

    tried: int
    succeeded: int = 0


@dataclass(frozen=True)
class Stranger:
    """An attacker: where the router is, the certificate of an agent, and how long a flood lasts."""

    endpoint: str
    keys: Path
    seconds: float

    @contextlib.contextmanager
    def session(self) -> Iterator[zenoh.Session]:
        """Open a session with Mallory's certificate."""
        session = open_raw(BusConfig(connect=(self.endpoint,), tls=self.mine))
        try:
            yield session
        finally:
            session.close()  # type: ignore[no-untyped-call]  # Zenoh's stub lacks the `-> None`

    @property
    def mine(self) -> TlsFiles:
        return files_of(self.keys, agent_name(BLUE, MALLORY))

    def joins(self, endpoint: str, tls: TlsFiles | None, zenoh_settings: dict[str, Any] | None = None) -> Tried:
        """Try to connect; a session is a success."""
        config = BusConfig(connect=(endpoint,), tls=tls, insecure=True, connect_timeout_s=1, zenoh=zenoh_settings or {})
        try:
            open_raw(config).close()  # type: ignore[no-untyped-call]  # as above
        except zenoh.ZError:
            return Tried(1)
        return Tried(1, 1)


# --- attacks ----------------------------------------------------------------------------------------


def without_certificate(me: Stranger) -> Tried:
    """Connect with TLS, but show nothing."""
    return me.joins(me.endpoint, None, {"transport/link/tls/root_ca_certificate": str(me.mine.ca)})


def foreign_certificate(me: Stranger) -> Tried:
    """Connect with a certificate of the same name from another authority."""
    with tempfile.TemporaryDirectory() as made:
        foreign = Path(made)
        make_authority(foreign)
        certify_agent(foreign, BLUE, HONEST[0])
        theirs = files_of(foreign, agent_name(BLUE, HONEST[0]))
        return me.joins(me.endpoint, theirs.model_copy(update={"ca": me.mine.ca}))


def plain_tcp(me: Stranger) -> Tried:
    """Connect without TLS."""
    return me.joins(me.endpoint.replace("tls/", "tcp/"), None)


def silent_connections(me: Stranger) -> Tried:
    """Hold connections open that never say a word, to keep an agent with a certificate out.

    The last of the table: for each that it closes, Zenoh accepts nobody for 0.1 s.
    """
    count = 100
    with contextlib.ExitStack() as held:
        for _ in range(count):
            held.enter_context(socket.create_connection(host_port_of(me.endpoint)))
        joined = me.joins(me.endpoint, me.mine).succeeded
    return Tried(count, 0 if joined else 1)


def agent_as_router(me: Stranger) -> Tried:
    """Listen with an agent's certificate, for those who mistake it for the router."""
    listening = BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=me.mine)
    session = open_raw(listening)
    reply = next(iter(session.get(f"@/{session.zid()}/router", timeout=1.0)))
    assert reply.ok is not None
    joined = me.joins(json.loads(reply.ok.payload.to_bytes())["locators"][0], me.mine)
    session.close()  # type: ignore[no-untyped-call]  # as above
    return joined


def reads(*keys: str) -> Callable[[Stranger], Tried]:
    """Return an attack that subscribes to keys, asks caches for them, and watches their tokens."""

    def attack(me: Stranger) -> Tried:
        """Read what is for others."""
        got: list[str] = []
        allowed: tuple[str, ...] = (f"{OWN}/", f"{ROOT}/result")

        def take(sample: zenoh.Sample) -> None:
            if not str(sample.key_expr).startswith(allowed):
                got.append(str(sample.key_expr))

        def answer(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                take(reply.ok)

        with me.session() as session:
            allowed = (*allowed, f"@/{session.zid()}/")
            held: list[Any] = []
            for key in keys:
                held.append(session.declare_subscriber(key, Callback(take, indirect=False)))
                held.append(session.liveliness().declare_subscriber(key, Callback(take, indirect=False), history=True))
                for asked in (key, f"{key}/@adv/**"):
                    session.get(asked, Callback(answer, indirect=False), timeout=1.0)
            time.sleep(1.0)
        return Tried(4 * len(keys), len(got))

    return attack


def writes(*keys: str, payload: bytes = FORGED, times: int = 20) -> Callable[[Stranger], Tried]:
    """Return an attack that puts under keys of others; the match finds out what arrived."""

    def attack(me: Stranger) -> Tried:
        """Write what is for others to write."""
        with me.session() as session:
            for _ in range(times):
                for key in keys:
                    session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK)
                time.sleep(0.01)
            time.sleep(0.2)
        return Tried(times * len(keys))

    return attack


def answers_for_caches(me: Stranger) -> Tried:
    """Answer in place of the host when an agent asks for the newest observation."""
    keys = [f"{VICTIM}/{topic}" for topic in ("observation", "briefing")]

    def answer(query: zenoh.Query) -> None:
        query.reply(str(query.key_expr).partition("/@adv")[0], FORGED)

    with me.session() as session:
        held = [session.declare_queryable(f"{key}/@adv/**", Callback(answer, indirect=False)) for key in keys]
        held += [session.declare_queryable(key, Callback(answer, indirect=False)) for key in keys]
        time.sleep(1.5)
    return Tried(len(held))


def holds_tokens(me: Stranger) -> Tried:
    """Hold the liveliness tokens of others."""
    with me.session() as session:
        tokens = [
            session.liveliness().declare_token(f"{ROOT}/{side}/{name}/alive/{FORGED.decode()}")
            for side, name in ((BLUE, HONEST[0]), (BLUE, HONEST[1]), (RED, "Roaches"))
        ]
        time.sleep(0.5)
    return Tried(len(tokens))


def floods(key: str) -> Callable[[Stranger], Tried]:
    """Return an attack that puts frames of 20 kB as fast as it can."""

    def attack(me: Stranger) -> Tried:
        """Flood."""
        until = time.monotonic() + me.seconds
        count = 0
        with me.session() as session:
            while time.monotonic() < until:
                session.put(key, FRAME, congestion_control=zenoh.CongestionControl.BLOCK)
                count += 1
        return Tried(count)

    return attack


def many_keys(me: Stranger) -> Tried:
    """Write under more keys than a recording has numbers for."""
    with me.session() as session:
        for number in range(MANY):
            session.put(f"{ROOT}/junk/x{number}/reply", FORGED)
    return Tried(MANY)


def many_tokens(me: Stranger) -> Tried:
    """Declare tokens of oneself, each with another instance, as fast as it goes."""
    until = time.monotonic() + me.seconds
    with me.session() as session:
        tokens: list[Any] = []
        while time.monotonic() < until and len(tokens) < MANY:
            tokens.append(session.liveliness().declare_token(f"{OWN}/alive/i{len(tokens)}"))
    return Tried(len(tokens))


def in_another_name(me: Stranger) -> Tried:
    """Send replies in the name of another under one's own key."""
    with me.session() as session:
        for step in range(2000):
            reply = Reply(run=RUN, side=BLUE, agent=HONEST[0], episode=0, step=step, text=FORGED.decode())
            session.put(f"{OWN}/reply", encode(reply), congestion_control=zenoh.CongestionControl.BLOCK)
    return Tried(2000)


FORGED_REPLY = encode(Reply(run=RUN, side=BLUE, agent=HONEST[0], episode=0, step=0, text=FORGED.decode()))
STATES = [f"{ROOT}/run", f"{ROOT}/result", f"{VICTIM}/briefing", f"{VICTIM}/observation", f"{VICTIM}/image/0"]

ATTACKS: dict[str, Callable[[Stranger], Tried]] = {
    "stranger: no certificate": without_certificate,
    "stranger: certificate of another authority": foreign_certificate,
    "stranger: plain TCP": plain_tcp,
    "agent: listens as a router": agent_as_router,
    "agent: reads observations of others": reads(f"{VICTIM}/observation", f"{ROOT}/{BLUE}/*/observation"),
    "agent: reads prompts of others": reads(f"{VICTIM}/exchange", f"{ROOT}/*/*/exchange"),
    "agent: reads briefings of others": reads(f"{VICTIM}/briefing", f"{ROOT}/*/*/briefing"),
    "agent: reads pictures of others": reads(f"{VICTIM}/image/*", f"{ROOT}/*/*/image/*"),
    "agent: reads replies and messages of others": reads(f"{VICTIM}/reply", f"{VICTIM}/message"),
    "agent: reads reports and the run card": reads(f"{ROOT}/report", f"{ROOT}/run"),
    "agent: reads the map of both sides": reads(f"{ROOT}/terrain", f"{ROOT}/scene"),
    "agent: reads the other side": reads(f"{ROOT}/{RED}/**"),
    "agent: reads everything": reads("**", "khala/**", f"{ROOT}/**", f"{ROOT}/*/*/*"),
    "agent: reads the router's own state": reads("@/**"),
    "agent: writes replies of others": writes(f"{VICTIM}/reply", payload=FORGED_REPLY),
    "agent: writes junk under replies of others": writes(f"{VICTIM}/reply"),
    "agent: writes as host": writes(*STATES, f"{ROOT}/report", f"{VICTIM}/message"),
    "agent: writes exchanges of others": writes(f"{VICTIM}/exchange"),
    "agent: writes to the other side": writes(f"{ROOT}/{RED}/Roaches/observation", f"{ROOT}/{RED}/Roaches/reply"),
    "agent: writes to expressions": writes(f"{ROOT}/*/*/reply", f"{ROOT}/**", f"{ROOT}/{BLUE}/*/observation"),
    "agent: sends replies in another's name": in_another_name,
    "agent: answers for caches": answers_for_caches,
    "agent: holds tokens of others": holds_tokens,
    "agent: sends an oversized reply": writes(f"{OWN}/reply", payload=FORGED + bytes(REPLY_BYTES), times=5),
    "agent: writes under 70 000 keys": many_keys,
    "agent: floods a reply of others": floods(f"{VICTIM}/reply"),
    "agent: floods its own reply": floods(f"{OWN}/reply"),
    "agent: floods its own exchange": floods(f"{OWN}/exchange"),
    "agent: declares 70 000 tokens": many_tokens,
    "stranger: 100 silent connections": silent_connections,
}


# --- the match --------------------------------------------------------------------------------------


@dataclass
class Seen:
    """What happened to the match since the last look."""

    steps: int = 0
    late: int = 0
    slowest_ms: float = 0.0
    forged: int = 0
    statuses: Counter[str] = field(default_factory=Counter)


class Siege:
    """A match under attack; see the module. Made by `siege`."""

    def __init__(self, host: Bus, published: Sequence[Publisher], turn: Turn, endpoint: str, keys: Path) -> None:
        self.endpoint, self.keys = endpoint, keys
        self.seen = Seen()
        self._in_time = 0  # steps without a late reply, up to now
        self._calm = asyncio.Event()  # enough of them
        self._turn = turn
        self._host = host
        self._published = published
        self._step = 0

    def look(self) -> Seen:
        """Return what was seen since the last look."""
        seen, self.seen = self.seen, Seen()
        return seen

    async def recover(self) -> None:
        """Wait for steps in time: what an attack leaves behind belongs to its row, not to the next one's."""
        self._in_time = 0
        self._calm.clear()
        async with asyncio.timeout(RECOVER_S):
            await self._calm.wait()

    async def play(self) -> None:
        """Ask the agents, step after step."""
        while True:
            began = time.perf_counter()
            answers = await self._turn.ask(self._questions())
            took_ms = 1000 * (time.perf_counter() - began)
            honest = {seat: answer for seat, answer in answers.by_seat.items() if seat.agent in HONEST}
            self.seen.steps += 1
            late = sum(answer.status != "ok" for answer in honest.values())
            self.seen.late += late
            self._in_time = 0 if late else self._in_time + 1
            if self._in_time == CALM_STEPS:
                self._calm.set()
            self.seen.statuses.update(answer.status for answer in honest.values())
            self.seen.forged += sum(FORGED.decode() in (answer.text or "") for answer in honest.values())
            self.seen.slowest_ms = max(self.seen.slowest_ms, took_ms)
            self._step += 1
            for publisher in self._published:  # with the report, the recording has room for another step
                await publisher.put(b"secret")
            await asyncio.sleep(PAUSE_S)

    def _questions(self) -> Iterator[Question]:
        for name in (*HONEST, MALLORY):
            yield Question(
                Observation(
                    run=RUN, agent=name, side=BLUE, episode=0, step=self._step, game_loop=8 * self._step,
                    answer_within_s=ANSWER_S, text="secret " * 600, view=View(time_s=0),
                ),
                [b"secret picture" * 1000],
            )  # fmt: skip

    async def tap(self, bus: Bus, key_expr: str) -> None:
        """Count what is forged among the samples under an expression."""
        async for sample in await bus.subscribe(key_expr, Delivery.STATE):
            forged = sample.payload.startswith(FORGED) or FORGED in sample.payload[:400]
            self.seen.forged += forged and (not sample.key.startswith(OWN) or len(sample.payload) > REPLY_BYTES)

    async def tap_tokens(self) -> None:
        """Count forged tokens."""
        async for token in await self._host.watch(f"{ROOT}/*/*/alive/{FORGED.decode()}"):
            self.seen.forged += token.alive

    async def join_late(self, bus: Bus) -> None:
        """Ask for the newest observation again and again, as an agent that joins late does."""
        while True:
            late = await bus.subscribe(f"{VICTIM}/observation", Delivery.STATE)
            self.seen.forged += (await anext(late)).payload.startswith(FORGED)
            await late.close()
            await asyncio.sleep(0.1)

    async def secrets(self, bus: Bus) -> None:
        """Publish what only the host may read."""
        exchange = await bus.publisher(f"{VICTIM}/exchange", Delivery.LOG)
        roaches = await self._host.publisher(agent_key(RUN, RED, "Roaches", Topic.OBSERVATION), Delivery.STATE)
        while True:
            for publisher in (exchange, roaches):
                await publisher.put(b"secret")
            await asyncio.sleep(0.05)


@contextlib.asynccontextmanager
async def siege(listen: str = "tls/127.0.0.1:0", *, separate: bool = False) -> AsyncIterator[Siege]:
    """Begin a match with two honest agents over TLS, with a certificate for Mallory; end it."""
    task = load_task("2s3z_pair")
    async with contextlib.AsyncExitStack() as stack:
        keys = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        make_authority(keys, [host_port_of(listen)[0]])
        for name in (*HONEST, MALLORY):
            certify_agent(keys, BLUE, name)
        certify_agent(keys, RED, "Roaches")
        names = [(BLUE, HONEST[0]), (BLUE, HONEST[1]), (BLUE, MALLORY), (RED, "Roaches")]
        rules = router_settings(names, RUN)
        router = await _open(
            stack, BusConfig(mode="router", listen=(listen,), tls=files_of(keys, "router"), zenoh=rules)
        )
        endpoint = router.endpoints[0]
        host = router
        if separate:
            host = await _open(stack, BusConfig(connect=(endpoint,), tls=files_of(keys, "host")))
        seats = [Seat(BLUE, name) for name in (*HONEST, MALLORY)]
        recorder = stack.enter_context(Recorder(keys / "recording.mcap"))
        bus = RecordingBus(host, recorder, seats)
        await stack.enter_async_context(Listener(bus, RUN))
        announcer = await stack.enter_async_context(Announcer(bus, RUN, seats))
        roster = await stack.enter_async_context(Roster(bus, RUN, seats))
        turn = await stack.enter_async_context(Turn(bus, RUN, roster))
        players = (*HONEST, MALLORY)
        agents = [
            await _open(stack, BusConfig(connect=(endpoint,), tls=files_of(keys, agent_name(BLUE, name))))
            for name in players
        ]
        running = stack.enter_context(_tasks())
        for name, session in zip(players, agents, strict=True):
            running(run_worker(session, RUN, BLUE, name, FunctionPolicy(_decide)))
        await announcer.run(run_card(MatchConfig(task=task, run=RUN), GameIdentity("", "", "", "")))
        for name in players:
            await announcer.brief(briefing(task, task.agents[0].model_copy(update={"name": name}), RUN, 0))
        await roster.assemble(seats, 20)
        maps = [await bus.publisher(f"{ROOT}/{topic}", Delivery.STATE) for topic in (Topic.TERRAIN, Topic.SCENE)]
        published = [*maps, await bus.publisher(f"{ROOT}/{Topic.REPORT}", Delivery.LOG)]
        match = Siege(host, published, turn, endpoint, keys)
        for key in (f"{VICTIM}/**", f"{ROOT}/{RED}/**", f"{ROOT}/junk/**", f"{OWN}/reply"):
            running(match.tap(host, key))
        for key in STATES:
            running(match.tap(agents[0], key))
        for work in (match.tap_tokens(), match.join_late(agents[0]), match.secrets(agents[0]), match.play()):
            running(work)
        await asyncio.sleep(0.2)  # the first steps
        yield match


async def _open(stack: contextlib.AsyncExitStack, config: BusConfig) -> Any:
    session = await open_bus(config)
    stack.push_async_callback(session.close)
    return session


@contextlib.contextmanager
def _tasks() -> Iterator[Callable[..., None]]:
    running: list[asyncio.Task[Any]] = []
    try:
        yield lambda work: running.append(asyncio.create_task(work))
    finally:
        for task in running:
            task.cancel()


async def _decide(briefing: Briefing, observation: Observation) -> str:  # noqa: ARG001  # an agent that does nothing
    return "Actions:"


# --- the table --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Row:
    """The outcome of one attack."""

    attack: str
    tried: int
    succeeded: int
    steps: int
    late: int
    slowest_ms: float


async def attack(match: Siege, name: str, *, seconds: float, through: Sequence[str] = ()) -> Row:
    """Run an attack in a process of its own, while the match goes on."""
    match.look()
    process = await asyncio.create_subprocess_exec(
        *through, sys.executable, "-m", "bench", "strangers", "--attack", name,
        "--endpoint", match.endpoint, "--keys", str(match.keys), "--seconds", str(seconds),
        stdout=asyncio.subprocess.PIPE, cwd=paths.ROOT,
    )  # fmt: skip
    said, _ = await process.communicate()
    return await row(match, name, Tried(*json.loads(said.splitlines()[-1])))


async def attack_here(match: Siege, name: str, *, seconds: float) -> Row:
    """Run an attack in a thread."""
    match.look()
    tried = await asyncio.to_thread(ATTACKS[name], Stranger(match.endpoint, match.keys, seconds))
    return await row(match, name, tried)


async def row(match: Siege, name: str, tried: Tried) -> Row:
    """Return the row of an attack that has just ended, once the match has recovered: steps are those until its end."""
    steps = match.seen.steps
    await match.recover()
    seen = match.look()
    return Row(name, tried.tried, tried.succeeded + seen.forged, steps, seen.late, round(seen.slowest_ms, 1))


async def measure(
    names: Sequence[str], listen: str, seconds: float, through: Sequence[str], *, separate: bool
) -> list[Row]:
    """Try attacks, one after the other, on one match."""
    async with siege(listen, separate=separate) as match:
        return [await attack(match, name, seconds=seconds, through=through) for name in names]


def main() -> None:
    """Attack, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--only", nargs="+", choices=list(ATTACKS), default=list(ATTACKS), metavar="ATTACK")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long a flood lasts")
    parser.add_argument("--listen", default="tls/127.0.0.1:0", help="where the match listens")
    parser.add_argument("--through", nargs="+", default=[], help="command before that of the attacker")
    parser.add_argument("--router", action="store_true", help="the host is a client of a separate router")
    for hidden in ("--attack", "--endpoint", "--keys"):
        parser.add_argument(hidden, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.ERROR)  # as the command line does
    if arguments.attack:
        me = Stranger(arguments.endpoint, Path(arguments.keys), arguments.seconds)
        print(json.dumps(ATTACKS[arguments.attack](me)))
        return
    rows = asyncio.run(
        measure(arguments.only, arguments.listen, arguments.seconds, arguments.through, separate=arguments.router)
    )
    print_table(
        ("attack", "tried", "succeeded", "steps", "late", "slowest ms"),
        (astuple(row) for row in rows),
        title=f"attacks on a match with {len(HONEST)} honest agents, {ANSWER_S:g} s to answer",
        file=sys.stderr if arguments.json else sys.stdout,
    )
    if arguments.json:
        print(json.dumps({"rows": [asdict(row) for row in rows]}))
