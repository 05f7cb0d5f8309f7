"""Measure one joint round over the bus: the host sends every agent an observation, and every agent replies.

    python -m bench bus                      a table
    python -m bench bus --tls                the same over TLS, next to it

It compares, in turns of a few rounds so that a noisy machine treats them the same:
    bus    `khala_protocol.bus`: observations as STATE, replies as SPEECH
    raw    Zenoh in asyncio: plain publishers, direct callbacks, a queue filled by `call_soon_threadsafe`
    bare   Zenoh without asyncio: the agent answers inside its callback, the host waits on a thread's event
with the host itself as the router, and with a router process between them. Agents are spread over worker processes, one
session each, over TCP on this machine. Without codec and work, it measures the cost of the bus alone.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import platform
import statistics
import sys
import tempfile
import threading
import time
from contextlib import AsyncExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import zenoh
from zenoh.handlers import Callback

from bench.command_line import make_parser
from bench.figures import Figure
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig, settings
from khala_protocol.bus.zenoh import ZenohBus, open_bus
from khala_protocol.certificates import files_of, make_authority

if TYPE_CHECKING:
    from collections.abc import Iterator

ROUNDS = {1: 400, 8: 200, 32: 120, 128: 60}
TURN_ROUNDS = 10
WARM_UP_ROUNDS = 10
TIMEOUT_S = 60.0
MOST_OVER_RAW = 1.5
"""How many times as long as over plain Zenoh a round may take."""
KEYS = "KHALA_TLS"
HEAD_BYTES = 8
BLOCK = zenoh.CongestionControl.BLOCK  # raw publishers have no cache to repair losses of DROP


@dataclass(frozen=True)
class Sizes:
    """Bytes of an observation and of a reply."""

    observation: int
    reply: int


def observation_key(agent: int) -> str:
    return f"bench/{agent}/observation"


def reply_key(agent: int) -> str:
    return f"bench/{agent}/reply"


def open_raw(config: BusConfig) -> zenoh.Session:
    """Open Zenoh with the same transport as the bus has."""
    zenoh_config = zenoh.Config()
    for path, value in settings(config).items():
        zenoh_config.insert_json5(path, json.dumps(value))
    return zenoh.open(zenoh_config)


# --- agents, in their own processes ------------------------------------------------------------------


def client(endpoint: str) -> BusConfig:
    """Return the configuration of a client; without access rules, any certificate is good."""
    keys = os.environ.get(KEYS)
    return BusConfig(connect=(endpoint,), tls=files_of(Path(keys), "host") if keys and "tls/" in endpoint else None)


def listener(*, tls: bool) -> BusConfig:
    """Return the configuration of a router."""
    files = files_of(Path(os.environ[KEYS]), "router") if tls else None
    return BusConfig(mode="router", listen=(f"{'tls' if tls else 'tcp'}/127.0.0.1:0",), tls=files)


async def work_bus(endpoint: str, agents: range, size: int) -> None:
    bus = await open_bus(client(endpoint))

    async def act(agent: int) -> None:
        replies = await bus.publisher(reply_key(agent), Delivery.SPEECH)
        observations = await bus.subscribe(observation_key(agent), Delivery.STATE, depth=1)
        ready()
        async for sample in observations:
            await replies.put(sample.payload[:HEAD_BYTES] + bytes(size - HEAD_BYTES))

    ready = barrier(len(agents))
    await asyncio.gather(*(act(agent) for agent in agents))


async def work_raw(endpoint: str, agents: range, size: int) -> None:
    session = open_raw(client(endpoint))
    loop = asyncio.get_running_loop()

    async def act(agent: int) -> None:
        queue: asyncio.Queue[bytes] = asyncio.Queue()
        replies = session.declare_publisher(reply_key(agent), congestion_control=BLOCK)

        def hand_over(sample: zenoh.Sample) -> None:
            loop.call_soon_threadsafe(queue.put_nowait, sample.payload.to_bytes())

        subscriber = session.declare_subscriber(observation_key(agent), Callback(hand_over, indirect=False))
        ready()
        while subscriber is not None:
            replies.put((await queue.get())[:HEAD_BYTES] + bytes(size - HEAD_BYTES))

    ready = barrier(len(agents))
    await asyncio.gather(*(act(agent) for agent in agents))


async def work_bare(endpoint: str, agents: range, size: int) -> None:
    session = open_raw(client(endpoint))
    held = []
    for agent in agents:
        publisher = session.declare_publisher(reply_key(agent), congestion_control=BLOCK)

        def answer(sample: zenoh.Sample, publisher: zenoh.Publisher = publisher) -> None:
            publisher.put(sample.payload.to_bytes()[:HEAD_BYTES] + bytes(size - HEAD_BYTES))

        held.append((publisher, session.declare_subscriber(observation_key(agent), Callback(answer, indirect=False))))
    barrier(1)()
    await asyncio.get_running_loop().create_future()


def barrier(count: int) -> Any:
    """Print on stdout that all are ready, when called `count` times."""
    calls = iter(range(count - 1))

    def ready() -> None:
        if next(calls, None) is None:
            print("ready", flush=True)

    return ready


# --- hosts ------------------------------------------------------------------------------------------


class Host(Protocol):
    """The side that plays rounds with its agents; `endpoint` is where they connect to."""

    endpoint: str

    async def open(self, config: BusConfig, agents: int, sizes: Sizes) -> None:
        """Declare everything."""

    async def play(self, number: int) -> None:
        """Play one round: all observations out, all replies in."""

    async def close(self) -> None:
        """Close the session."""


class BusHost(Host):
    """Over `khala_protocol.bus`."""

    async def open(self, config: BusConfig, agents: int, sizes: Sizes) -> None:
        self.bus: ZenohBus = await open_bus(config)
        self.endpoint = self.bus.endpoints[0]
        self.body = bytes(sizes.observation - HEAD_BYTES)
        self.replies = await self.bus.subscribe("bench/*/reply", Delivery.SPEECH)
        self.publishers = [await self.bus.publisher(observation_key(agent), Delivery.STATE) for agent in range(agents)]

    async def play(self, number: int) -> None:
        head = number.to_bytes(HEAD_BYTES)
        for publisher in self.publishers:
            await publisher.put(head + self.body)
        missing = len(self.publishers)
        while missing:
            missing -= (await anext(self.replies)).payload.startswith(head)

    async def close(self) -> None:
        await self.bus.close()


class RawHost(Host):
    """Over Zenoh, in asyncio."""

    async def open(self, config: BusConfig, agents: int, sizes: Sizes) -> None:
        self.session = open_raw(config)
        self.endpoint = locator(self.session) if config.listen else config.connect[0]
        self.body = bytes(sizes.observation - HEAD_BYTES)
        self.queue: asyncio.Queue[bytes] = asyncio.Queue()
        self.loop = asyncio.get_running_loop()
        self.subscriber = self.session.declare_subscriber("bench/*/reply", Callback(self.hand_over, indirect=False))
        self.publishers = [
            self.session.declare_publisher(observation_key(agent), congestion_control=BLOCK) for agent in range(agents)
        ]

    def hand_over(self, sample: zenoh.Sample) -> None:
        self.loop.call_soon_threadsafe(self.queue.put_nowait, sample.payload.to_bytes())

    async def play(self, number: int) -> None:
        head = number.to_bytes(HEAD_BYTES)
        for publisher in self.publishers:
            publisher.put(head + self.body)
        missing = len(self.publishers)
        while missing:
            missing -= (await self.queue.get()).startswith(head)

    async def close(self) -> None:
        self.session.close()  # type: ignore[no-untyped-call]  # Zenoh's stub lacks the `-> None`


class BareHost(RawHost):
    """Over Zenoh, with a thread's event."""

    head = b""
    missing = 0
    done = threading.Event()

    def hand_over(self, sample: zenoh.Sample) -> None:
        self.missing -= sample.payload.to_bytes().startswith(self.head)
        if not self.missing:
            self.done.set()

    async def play(self, number: int) -> None:
        self.done.clear()
        self.head = number.to_bytes(HEAD_BYTES)
        self.missing = len(self.publishers)
        for publisher in self.publishers:
            publisher.put(self.head + self.body)
        if not self.done.wait(1.0):  # the measured behaviour: blocking
            raise TimeoutError


def locator(session: zenoh.Session) -> str:
    """Return the endpoint behind port 0."""
    reply = next(iter(session.get(f"@/{session.zid()}/router", timeout=1.0)))
    assert reply.ok is not None
    return str(json.loads(reply.ok.payload.to_bytes())["locators"][0])


HOSTS: dict[str, type[Host]] = {"bus": BusHost, "raw": RawHost, "bare": BareHost}
WORKERS = {"bus": work_bus, "raw": work_raw, "bare": work_bare}


# --- the measurement --------------------------------------------------------------------------------


async def measure(
    agents: int, *, tls: bool, separate: bool, workers: int, sizes: Sizes, rounds: int
) -> dict[str, list[float]]:
    """Return the milliseconds of each round, by kind."""
    async with AsyncExitStack() as stack:
        hosts: dict[str, Host] = {}
        for kind, make in HOSTS.items():
            config = client(await start(stack, "router", str(tls))) if separate else listener(tls=tls)
            host = hosts[kind] = make()
            await host.open(config, agents, sizes)
            stack.push_async_callback(host.close)
            for first in range(min(workers, agents)):
                await start(stack, kind, host.endpoint, str(first), str(agents), str(workers), str(sizes.reply))
            await warm_up(host)
        took_ms: dict[str, list[float]] = {kind: [] for kind in HOSTS}
        for number in range(WARM_UP_ROUNDS, WARM_UP_ROUNDS + rounds, TURN_ROUNDS):
            for kind, host in hosts.items():
                took_ms[kind] += [await play(host, number + turn) for turn in range(TURN_ROUNDS)]
        return took_ms


async def play(host: Host, number: int) -> float:
    began = time.perf_counter()
    async with asyncio.timeout(TIMEOUT_S):
        await host.play(number)
    return (time.perf_counter() - began) * 1e3


async def warm_up(host: Host) -> None:
    """Play until every subscription is known everywhere: the first samples of raw publishers get lost."""
    done = 0
    while done < WARM_UP_ROUNDS:
        try:
            async with asyncio.timeout(1.0):
                await host.play(done)
        except TimeoutError:
            continue
        done += 1


async def start(stack: AsyncExitStack, *arguments: str) -> str:
    """Start this benchmark as another process; return its first line."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "bench", "bus", "--process", *arguments),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )

    async def stop() -> None:
        process.kill()
        await process.wait()

    stack.push_async_callback(stop)
    assert process.stdout is not None
    async with asyncio.timeout(TIMEOUT_S):
        return (await process.stdout.readline()).decode().strip()


async def be_process(role: str, *arguments: str) -> None:
    if role == "router":
        bus = await open_bus(listener(tls=arguments == ("True",)))
        print(bus.endpoints[0], flush=True)
        await asyncio.get_running_loop().create_future()
    endpoint, first, agents, workers, size = arguments
    await WORKERS[role](endpoint, range(int(first), int(agents), int(workers)), int(size))


async def run(arguments: argparse.Namespace) -> dict[str, Any]:
    results = []
    sizes = Sizes(arguments.observation_bytes, arguments.reply_bytes)
    places = [(separate, agents) for separate in (False, True) for agents in arguments.agents]
    for separate, agents in places:
        for tls in (False, True) if arguments.tls else (False,):
            rounds = max(TURN_ROUNDS, round(ROUNDS.get(agents, 100) * arguments.scale))
            took = await measure(
                agents, tls=tls, separate=separate, workers=arguments.workers, sizes=sizes, rounds=rounds
            )
            results.append(summary(agents, separate, took) | {"tls": tls})
            print(row(results[-1]), file=arguments.table, flush=True)
    machine = {"cpus": os.cpu_count(), "python": platform.python_version(), "system": platform.platform()}
    return {"bench": "bus", "machine": machine, "workers": arguments.workers, "sizes": vars(sizes), "results": results}


def summary(agents: int, separate: bool, took_ms: dict[str, list[float]]) -> dict[str, Any]:
    median = {kind: statistics.median(times) for kind, times in took_ms.items()}
    return {
        "agents": agents,
        "router": "process" if separate else "host",
        "rounds": len(took_ms["bus"]),
        "median_ms": median,
        "p99_ms": {kind: statistics.quantiles(times, n=100)[98] for kind, times in took_ms.items()},
        "ratio_to_raw": median["bus"] / median["raw"],
        "ratio_to_bare": median["bus"] / median["bare"],
        "ratios_to_raw": ratios(took_ms["bus"], took_ms["raw"]),
    }


def ratios(over_ms: list[float], under_ms: list[float]) -> list[float]:
    """Return the ratio of each turn of rounds, whose two sides were measured one after the other."""
    turns = range(0, len(over_ms), TURN_ROUNDS)
    return [
        statistics.median(over_ms[turn : turn + TURN_ROUNDS]) / statistics.median(under_ms[turn : turn + TURN_ROUNDS])
        for turn in turns
    ]


def measures(found: Any) -> Iterator[Figure]:
    """Yield what a round takes, and how many times as long as over plain Zenoh."""
    for row in found["results"]:
        place = f"{row['agents']} agents, {'tls' if row['tls'] else 'tcp'}, router {row['router']}"
        yield Figure(f"a round, {place}", "ms", (row["median_ms"]["bus"],))
        yield Figure(f"ours / plain Zenoh, {place}", "times", tuple(row["ratios_to_raw"]), limit=MOST_OVER_RAW)


HEADER = "link router   agents rounds |  bus ms    p99 |  raw ms    p99 | bare ms    p99 | bus/raw bus/bare"


def row(result: dict[str, Any]) -> str:
    cells = " | ".join(f"{result['median_ms'][kind]:7.2f} {result['p99_ms'][kind]:6.1f}" for kind in HOSTS)
    ratios = f"{result['ratio_to_raw']:7.2f} {result['ratio_to_bare']:8.2f}"
    place = f"{'tls' if result['tls'] else 'tcp':4} {result['router']:8}"
    return f"{place} {result['agents']:6} {result['rounds']:6} | {cells} | {ratios}"


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--agents", type=int, nargs="+", default=[1, 8, 32, 128])
    parser.add_argument("--workers", type=int, default=2, help="processes that the agents are spread over")
    parser.add_argument("--observation-bytes", type=int, default=20_000)
    parser.add_argument("--reply-bytes", type=int, default=2_000)
    parser.add_argument("--scale", type=float, default=1.0, help="factor on the number of rounds")
    parser.add_argument("--tls", action="store_true", help="measure over TLS as well, with keys made for it")
    parser.add_argument("--process", nargs="+", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.process:
        asyncio.run(be_process(*arguments.process))
        return
    arguments.table = sys.stderr if arguments.json else sys.stdout
    print(HEADER, file=arguments.table)
    with tempfile.TemporaryDirectory() as keys:
        make_authority(Path(keys), ["127.0.0.1"])
        os.environ[KEYS] = keys  # its processes have it from there
        result = asyncio.run(run(arguments))
    if arguments.json:
        print(json.dumps(result))
