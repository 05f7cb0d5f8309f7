"""What advisers write, from outside the match: people, or programs of theirs.

Below it: a subscription to the topic `advice`. Above it: `khala_orchestrator.match.turn`, which takes in each step what
has arrived. In a replay the recording says what was taken when, so that agents see the same again. The names of
advisers stand in the task file; anything under another name is dropped.
"""

from __future__ import annotations

import asyncio
import logging
from collections import defaultdict
from typing import TYPE_CHECKING, Self

from khala_orchestrator.roster import Seat
from khala_orchestrator.words.mailbox import MAX_MESSAGES
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError, WrongKey
from khala_protocol.keys import Topic, every_agent, parse
from khala_protocol.messages import Advice

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from types import TracebackType

    from khala_protocol.bus import Bus, Sample, Subscription

log = logging.getLogger(__name__)


class AdviceInbox:
    """The advice that has arrived and was not taken yet. An asynchronous context manager.

    Of each adviser as many messages wait as count in a step; more are dropped, with a warning.
    """

    def __init__(self, bus: Bus, run: str, advisers: Iterable[Seat]) -> None:
        self._bus = bus
        self._run = run
        self._advisers = frozenset(advisers)
        self._waiting: dict[Seat, list[Advice]] = defaultdict(list)
        self._subscription: Subscription[Sample] | None = None
        self._pump: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        if self._advisers:
            self._subscription = await self._bus.subscribe(every_agent(self._run, Topic.ADVICE), Delivery.SPEECH)
            self._pump = asyncio.create_task(self._hear(self._subscription), name="advice")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._subscription is not None and self._pump is not None:
            await self._subscription.close()
            await self._pump

    def take(self) -> Sequence[Advice]:
        """Return what has arrived since the last call, each adviser's messages in order of arrival."""
        taken = [advice for messages in self._waiting.values() for advice in messages]
        self._waiting.clear()
        return taken

    async def _hear(self, samples: Subscription[Sample]) -> None:
        async for sample in samples:
            try:
                self._note(self._read(sample))
            except PeerError as error:
                log.warning("advice under %s is dropped: %s", sample.key, error)

    def _read(self, sample: Sample) -> Advice:
        address = parse(sample.key)
        advice = decode_as(Advice, sample.payload)
        if (advice.run, advice.side, advice.agent) != (self._run, address.side, address.agent):
            raise WrongKey(f"it is of {advice.side}/{advice.agent} in run {advice.run}")
        if Seat(advice.side, advice.agent) not in self._advisers:
            raise WrongKey("the task names no such adviser")
        return advice

    def _note(self, advice: Advice) -> None:
        waiting = self._waiting[Seat(advice.side, advice.agent)]
        if len(waiting) < MAX_MESSAGES:
            waiting.append(advice)
        else:
            log.warning("adviser %s/%s writes too much: a message is dropped", advice.side, advice.agent)
