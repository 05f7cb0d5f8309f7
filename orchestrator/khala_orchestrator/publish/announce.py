"""Say that the host is there, and publish its run card, briefings, messages, reports, results, terrain and scenes.

Below it: the bus. Above it: `khala_orchestrator.match.match`, which decides what is published, and this module where.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from khala_orchestrator.roster import Seat
from khala_protocol.bus import Delivery
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key, host_key, run_key

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import TracebackType

    from khala_protocol.bus import Bus, Publisher, Token
    from khala_protocol.messages import Briefing, Message, Report, Result, Run, Scene, Terrain

_DELIVERY = {
    Topic.RUN: Delivery.STATE, Topic.REPORT: Delivery.LOG, Topic.RESULT: Delivery.STATE,
    Topic.TERRAIN: Delivery.STATE, Topic.SCENE: Delivery.STATE,
}  # fmt: skip


class Announcer:
    """The host's publishers, and its liveliness token. An asynchronous context manager."""

    def __init__(self, bus: Bus, run: str, seats: Iterable[Seat], advisers: Iterable[Seat] = ()) -> None:
        self._bus = bus
        self._run = run
        self._seats = tuple(seats)
        self._advisers = tuple(advisers)
        self._topics: dict[Topic, Publisher] = {}
        self._briefings: dict[Seat, Publisher] = {}
        self._newest: dict[Seat, Briefing] = {}
        self._messages: dict[Seat, Publisher] = {}
        self._token: Token | None = None

    async def __aenter__(self) -> Self:
        for topic, delivery in _DELIVERY.items():
            self._topics[topic] = await self._bus.publisher(run_key(self._run, topic), delivery)
        for seat in self._seats:
            key = agent_key(self._run, seat.side, seat.agent, Topic.BRIEFING)
            self._briefings[seat] = await self._bus.publisher(key, Delivery.STATE)
        for seat in (*self._seats, *self._advisers):
            key = agent_key(self._run, seat.side, seat.agent, Topic.MESSAGE)
            self._messages[seat] = await self._bus.publisher(key, Delivery.LOG)
        self._token = await self._bus.announce(host_key(self._run))
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for publisher in (*self._topics.values(), *self._briefings.values(), *self._messages.values()):
            await publisher.close()
        if self._token is not None:
            await self._token.close()

    async def run(self, card: Run) -> None:
        """Publish the run card."""
        await self._topics[Topic.RUN].put(encode(card))

    async def brief(self, briefing: Briefing) -> None:
        """Publish the briefing of one agent, unless it is the one that holds."""
        seat = Seat(briefing.side, briefing.agent)
        if self._newest.get(seat) != briefing:
            self._newest[seat] = briefing
            await self._briefings[seat].put(encode(briefing))

    async def message(self, message: Message) -> None:
        """Publish a message to an agent or to a channel, under the name of the sender."""
        await self._messages[Seat(message.side, message.agent)].put(encode(message))

    async def report(self, report: Report) -> None:
        """Publish the report of a step."""
        await self._topics[Topic.REPORT].put(encode(report))

    async def result(self, result: Result) -> None:
        """Publish the result of an episode."""
        await self._topics[Topic.RESULT].put(encode(result))

    async def terrain(self, terrain: Terrain) -> None:
        """Publish the ground of an episode."""
        await self._topics[Topic.TERRAIN].put(encode(terrain))

    async def scene(self, scene: Scene) -> None:
        """Publish the map at a step."""
        await self._topics[Topic.SCENE].put(encode(scene))
