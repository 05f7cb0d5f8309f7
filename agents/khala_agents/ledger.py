"""What an agent's requests to its model took: summed up for its replies, and published for the recording.

A policy tells of each request as soon as it is over; that must cost it nothing, so exchanges wait here until there is
time to send them. Only `khala_agents.worker` uses it.
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
        usage: of all of them.
    """

    def __init__(self, agent: str) -> None:
        self.usage = Usage()
        self._agent = agent
        self._step: Step | None = None
        self._spent: list[Usage] = []
        self._waiting: asyncio.Queue[ModelCall] = asyncio.Queue()

    def open(self, step: Step) -> None:
        """Begins the account of a step, given as episode and number."""
        self._step, self._spent = step, []

    def note(self, exchange: ModelCall) -> None:
        """Takes an exchange. What belongs to an older step is published, and not on the account of this one."""
        if (exchange.episode, exchange.step) == self._step:
            self._spent.append(exchange.usage)
        self.usage += exchange.usage
        self._waiting.put_nowait(exchange)

    def account(self) -> tuple[int, Usage]:
        """Requests of the open step, and what they took."""
        return len(self._spent), sum(self._spent, Usage())

    async def publish(self, publisher: Publisher) -> None:
        """Publishes exchanges as they come, until it is cancelled."""
        while True:
            await self._put(await self._waiting.get(), publisher)

    async def flush(self, publisher: Publisher) -> None:
        """Publishes what is still waiting."""
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
