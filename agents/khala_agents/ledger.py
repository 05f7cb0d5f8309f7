"""The usage of an agent's requests to its model: summed up for its replies, and published for the recording.

A policy reports each request as soon as it is over. That must cost the policy nothing, so exchanges wait here until
there is time to send them. Only `khala_agents.worker` uses this module.
"""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING

from khala_protocol.codec import encode
from khala_protocol.errors import BusClosed, BusError
from khala_protocol.messages import ModelCall, Usage

if TYPE_CHECKING:
    from khala_protocol.bus import Publisher

log = logging.getLogger(__name__)

Step = tuple[int, int]


class UsageLedger:
    """The exchanges of one agent.

    Attributes:
        usage: of all exchanges.
    """

    def __init__(self, agent: str) -> None:
        self.usage = Usage()
        self._agent = agent
        self._step: Step | None = None
        self._spent: list[Usage] = []
        self._beside = Usage()
        self._waiting: asyncio.Queue[ModelCall] = asyncio.Queue()

    def open(self, step: Step) -> None:
        """Open the account of a step, given as episode and number."""
        self._step = step
        self._spent = []

    def note(self, exchange: ModelCall) -> None:
        """Note an exchange; a decision's of an older step is published, but not counted for this step.

        What was asked beside decisions is counted for the next reply.
        """
        if exchange.purpose != "decision":
            self._beside += exchange.usage
        elif (exchange.episode, exchange.step) == self._step:
            self._spent.append(exchange.usage)
        self.usage += exchange.usage
        self._waiting.put_nowait(exchange)

    def account(self) -> tuple[int, Usage]:
        """Return the number of requests of the open step, and their usage with that beside it."""
        beside, self._beside = self._beside, Usage()
        return len(self._spent), sum(self._spent, beside)

    async def publish(self, publisher: Publisher) -> None:
        """Publish exchanges as they arrive, until cancelled."""
        while True:
            await self._put(await self._waiting.get(), publisher)

    async def flush(self, publisher: Publisher) -> None:
        """Publish the exchanges that still wait."""
        try:
            while not self._waiting.empty():
                await self._put(self._waiting.get_nowait(), publisher)
        except BusClosed:
            log.info("agent %s: the bus was closed before all exchanges were sent", self._agent)

    async def _put(self, exchange: ModelCall, publisher: Publisher) -> None:
        try:
            await publisher.put(encode(exchange))
        except BusClosed:
            raise
        except BusError as error:
            log.warning("agent %s: an exchange of step %d is lost: %s", self._agent, exchange.step, error)
