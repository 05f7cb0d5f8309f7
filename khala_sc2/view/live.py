"""A match on a bus → a recording that grows, which is then looked at as any other.

It subscribes to every topic of the run, as an observer, and publishes nothing: the match does not notice it. What its
link cannot carry is lost here alone. A late joiner gets the newest of each state, and all that follows.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING

from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as
from khala_protocol.errors import ConfigError, PeerError
from khala_protocol.keys import RUN_TOPICS, Topic, every_agent, every_run, run_key
from khala_protocol.messages import Result, Run

if TYPE_CHECKING:
    from khala_protocol.bus import Bus, Sample, Subscription
    from khala_protocol.recording import Recorder

DELIVERIES = {
    Topic.RUN: Delivery.STATE, Topic.RESULT: Delivery.STATE, Topic.REPORT: Delivery.LOG,
    Topic.TERRAIN: Delivery.STATE, Topic.SCENE: Delivery.STATE, Topic.BRIEFING: Delivery.STATE,
    Topic.OBSERVATION: Delivery.STATE, Topic.IMAGE: Delivery.STATE, Topic.REPLY: Delivery.SPEECH,
    Topic.MESSAGE: Delivery.LOG, Topic.EXCHANGE: Delivery.LOG,
}  # fmt: skip
"""What is recorded, and how it is published."""
FLUSH_S = 0.1
"""What has arrived can be read after this time."""
FIND_S = 3.0
"""How long to collect run cards, which every running match has published."""
BEGIN_S = 60.0
"""How long to wait for a match that is named: one that was just ordered may be about to begin."""
LAST_S = 1.0
"""After the last result, how long to wait for what is still on its way."""


class Following:
    """The recording of a match on a bus.

    Args:
        bus: a session on the bus of the match.
        card: of the run.
        recorder: where everything goes.
    """

    def __init__(self, bus: Bus, card: Run, recorder: Recorder) -> None:
        self._bus, self._card, self._recorder = bus, card, recorder
        self._sides = {agent.side for agent in card.agents}
        self._over = asyncio.Event()
        self._dirty = False

    async def follow(self) -> None:
        """Record until the match is over, and end the recording."""
        async with contextlib.AsyncExitStack() as stack:
            stack.callback(self._recorder.close)
            tasks = [
                asyncio.create_task(self._record(await self._hear(stack, topic)), name=f"record {topic}")
                for topic in DELIVERIES
            ]
            tasks.append(asyncio.create_task(self._flush(), name="flush"))
            try:
                await self._over.wait()
                await asyncio.sleep(LAST_S)
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.wait(tasks)

    async def _hear(self, stack: contextlib.AsyncExitStack, topic: Topic) -> Subscription[Sample]:
        key = run_key(self._card.run, topic) if topic in RUN_TOPICS else every_agent(self._card.run, topic)
        subscription = await self._bus.subscribe(key, DELIVERIES[topic])
        stack.push_async_callback(subscription.close)
        return subscription

    async def _record(self, samples: Subscription[Sample]) -> None:
        async for sample in samples:
            self._recorder.write(sample.key, sample.payload)
            self._dirty = True
            if sample.key.endswith(f"/{Topic.RESULT}"):
                self._note_result(sample.payload)

    def _note_result(self, payload: bytes) -> None:
        with contextlib.suppress(PeerError):
            result = decode_as(Result, payload)
            if result.outcome == "aborted" or result.episode >= self._card.episodes - 1:
                self._sides.discard(result.side)
            if not self._sides:
                self._over.set()

    async def _flush(self) -> None:
        while True:
            await asyncio.sleep(FLUSH_S)
            if self._dirty:
                self._dirty = False
                self._recorder.flush()


async def running_match(bus: Bus, run: str | None) -> Run:
    """Return the card of a running match; if none is named, of the only one there is.

    Raises:
        ConfigError: there is none, or there are several.
    """
    cards: dict[str, Run] = {}
    within_s = BEGIN_S if run else FIND_S
    subscription = await bus.subscribe(run_key(run, Topic.RUN) if run else every_run(Topic.RUN), Delivery.STATE)
    try:
        async with asyncio.timeout(within_s):
            async for sample in subscription:
                with contextlib.suppress(PeerError):
                    card = decode_as(Run, sample.payload)
                    cards[card.run] = card
                if run and cards:
                    break
    except TimeoutError:
        pass
    finally:
        await subscription.close()
    match list(cards.values()):
        case [card]:
            return card
        case []:
            what = f"no match of the name {run!r}" if run else "no match"
            raise ConfigError(f"{what} was found within {within_s:g} s: is it running, and at this endpoint?")
        case several:
            names = ", ".join(sorted(card.run for card in several))
            raise ConfigError(f"several matches are played here: name one of {names}")
