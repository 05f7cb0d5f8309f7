"""Measure the time from an order to its first observation, cold and warm, and how fast several matches are at once.

python -m bench serve [--orders 5] [--matches 4]
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import statistics
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from bench.command_line import make_parser
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.keys import Topic, every_agent
from khala_protocol.service import OPEN, Submit
from khala_sc2.playing.matches import new
from khala_sc2.playing.minds import Minds
from khala_sc2.service import client

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_protocol.bus import Bus
    from khala_protocol.service import MatchCard

SETTLE_S = 20.0
"""Longest time for a worker to get ready: the first one of an idle machine of two cores takes 4 s."""


def main() -> None:
    options = make_parser(__doc__, json=False)
    options.add_argument("--orders", type=int, default=5)
    options.add_argument("--matches", type=int, default=4)
    options.add_argument("--task", default="2s3z_pair")
    options.add_argument("--settle", type=float, default=SETTLE_S)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as out:
        asyncio.run(_bench(given.task, given.orders, given.matches, given.settle, Path(out)))


async def _bench(task: str, orders: int, matches: int, settle_s: float, out: Path) -> None:
    for warm in (0, 1):
        async with _service(out, "--warm", str(warm), "--matches", "1") as bus:
            took = []
            for _ in range(orders):
                await asyncio.sleep(settle_s if warm else 0)
                began = time.perf_counter()
                card = await client.submit(bus, _order(task, max_steps=2), within_s=60)
                took.append(await _first_observation(bus, card.run) - began)
                await _over(bus, [card])
            print(f"workers that wait: {warm}   order to first observation: {_spread(took)}")
    for together in (1, matches):
        async with _service(out, "--warm", str(together), "--matches", str(together)) as bus:
            await asyncio.sleep(settle_s * together / 2)
            began = time.perf_counter()
            cards = [await client.submit(bus, _order(task, max_steps=100), within_s=60) for _ in range(together)]
            ended = await _over(bus, cards)
            took_s = time.perf_counter() - began
            steps = sum(card.step for card in ended)
            states = ", ".join(sorted({card.state for card in ended}))
            print(f"{together} at once: {steps} steps in {took_s:.1f} s, {steps / took_s:.1f} a second, all {states}")


@contextlib.asynccontextmanager
async def _service(out: Path, *options: str) -> AsyncIterator[Bus]:
    command = ("-m", "khala_sc2", "serve", "--json", "--listen", "tcp/127.0.0.1:0", "--out", str(out), *options)
    process = await asyncio.create_subprocess_exec(
        sys.executable, *command, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL
    )
    assert process.stdout is not None
    try:
        endpoint = json.loads(await process.stdout.readline())["endpoints"][0]
        bus = await open_bus(BusConfig(connect=(endpoint,)))
        yield bus
        await bus.close()
    finally:
        process.terminate()
        await process.wait()


def _order(task: str, max_steps: int) -> Submit:
    config = new(task, None, Path(), seed=1, episodes=1, assemble_s=60.0, max_steps=max_steps)
    match = config.model_dump(mode="json", exclude={"record", "run"})
    return Submit(run=config.run, number=client.new_number(), match=match, minds=asdict(Minds(latency_s=0.2)))


async def _first_observation(bus: Bus, run: str) -> float:
    observations = await bus.subscribe(every_agent(run, Topic.OBSERVATION), Delivery.STATE)
    await anext(observations)
    arrived = time.perf_counter()
    await observations.close()
    return arrived


async def _over(bus: Bus, cards: list[MatchCard]) -> list[MatchCard]:
    """Return the cards of these matches once all are over."""
    while True:
        found = [client.find(await client.list_matches(bus), card.run) for card in cards]
        if not any(card.state in OPEN for card in found):
            return found
        await asyncio.sleep(0.2)


def _spread(took: list[float]) -> str:
    return f"median {statistics.median(took):.2f} s, {min(took):.2f} to {max(took):.2f} s of {len(took)}"
