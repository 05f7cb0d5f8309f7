"""Which agents are present: found by their liveliness tokens.

Below it: the bus. Above it: `khala_orchestrator.match.match`, which starts when all required agents are there, and
`khala_orchestrator.match.turn`, which stops waiting for one that has left. Two instances of the same agent (a restart
that overlaps, or two people with one name) are one presence here, and a warning in the log.
"""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, NamedTuple, Self

from khala_protocol.errors import KhalaError, WrongKey
from khala_protocol.keys import Topic, every_agent, parse

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable
    from types import TracebackType

    from khala_protocol.bus import Bus, Liveness, Subscription

log = logging.getLogger(__name__)

MAX_INSTANCES = 16
"""Processes of one agent that are taken note of: each costs the host a question, and nobody needs two."""
MAX_STRANGERS = 100
"""Agents without a seat that are named in the log, each once."""
NEWS_S = 1.0
"""Time after our link is back within which all agents that are still there have been reported."""


class Seat(NamedTuple):
    """The place of one agent in a run."""

    side: str
    agent: str

    def __str__(self) -> str:
        return f"{self.side}/{self.agent}"


class MissingAgents(KhalaError):
    """Required agents did not come in time."""

    def __init__(self, missing: Iterable[Seat], waited_s: float) -> None:
        self.missing = tuple(missing)
        names = ", ".join(str(seat) for seat in self.missing)
        super().__init__(
            f"no agent took the place of {names} within {waited_s:g} s: start one with "
            f"`khala agent {self.missing[0].agent} --side {self.missing[0].side} --run … --connect …`"
        )


class Roster:
    """The seats of a run, and which of them are taken. An asynchronous context manager."""

    def __init__(self, bus: Bus, run: str, seats: Iterable[Seat]) -> None:
        self.seats = tuple(seats)
        self._bus = bus
        self._run = run
        self._instances: dict[Seat, set[str]] = {seat: set() for seat in self.seats}
        self._strangers: set[Seat] = set()
        self._cut = False
        self._doubtful: dict[Seat, set[str]] = {seat: set() for seat in self.seats}
        """Instances that were there when our link went down, and of which nothing was heard since."""
        self._changed = asyncio.Condition()
        self._gone: Callable[[Seat], None] = _ignore
        self._here: Callable[[Seat], Awaitable[None]] = _ignore_here
        self._subscription: Subscription[Liveness] | None = None
        self._pump: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._subscription = await self._bus.watch(every_agent(self._run, Topic.ALIVE))
        self._pump = asyncio.create_task(self._follow(self._subscription), name="roster")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._subscription is not None and self._pump is not None
        await self._subscription.close()
        await self._pump

    def is_present(self, seat: Seat) -> bool:
        """Return whether at least one instance of this agent is present, as far as is known."""
        return bool(self._instances[seat])

    def is_reachable(self, seat: Seat) -> bool:
        """Return whether an agent is present and our own link is up."""
        return self.is_present(seat) and not self._cut

    def missing(self) -> tuple[Seat, ...]:
        """Return the seats that no agent has taken."""
        return tuple(seat for seat in self.seats if not self.is_present(seat))

    def on_change(self, *, gone: Callable[[Seat], None], here: Callable[[Seat], Awaitable[None]]) -> None:
        """Call `gone` whenever the last instance of an agent leaves, and `here` whenever one comes.

        With our own link down, all of them leave; those that are still there come again when it is back.
        """
        self._gone, self._here = gone, here

    async def assemble(self, required: Iterable[Seat], timeout_s: float) -> None:
        """Wait until all required seats are taken.

        Raises:
            MissingAgents: some are not taken after `timeout_s` seconds.
        """
        wanted = tuple(required)
        try:
            async with asyncio.timeout(timeout_s), self._changed:
                await self._changed.wait_for(lambda: all(self.is_present(seat) for seat in wanted))
        except TimeoutError:
            raise MissingAgents((s for s in wanted if not self.is_present(s)), timeout_s) from None

    async def _follow(self, tokens: Subscription[Liveness]) -> None:
        async for token in tokens:
            self._cut = not (token.alive or token.link_up)
            await self._note(token)
            async with self._changed:
                self._changed.notify_all()

    async def _note(self, token: Liveness) -> None:
        try:
            address = parse(token.key)
        except WrongKey as error:
            log.warning("%s", error)
            return
        assert address.side is not None and address.agent is not None and address.instance is not None
        seat = Seat(address.side, address.agent)
        instances = self._instances.get(seat)
        if instances is None:
            self._name_stranger(seat)
        elif token.alive:
            self._be_sure_soon()
            self._doubtful[seat].discard(address.instance)
            if len(instances) == MAX_INSTANCES:
                return
            instances.add(address.instance)
            if len(instances) > 1:
                log.warning("%d processes are agent %s: the first reply of a step counts", len(instances), seat)
            await self._here(seat)
        elif self._cut:  # with our own link down, every agent seems to leave at once
            self._doubtful[seat].add(address.instance)
            self._gone(seat)
        else:
            self._remove(seat, {address.instance})

    def _name_stranger(self, seat: Seat) -> None:
        """Say once that an agent has no seat; its name may be a slip."""
        if seat not in self._strangers and len(self._strangers) < MAX_STRANGERS:
            self._strangers.add(seat)
            log.warning("agent %s is not in this match", seat)

    def _remove(self, seat: Seat, left: set[str]) -> None:
        if self._instances[seat] & left:
            self._instances[seat] -= left
            if not self._instances[seat]:
                self._gone(seat)

    def _be_sure_soon(self) -> None:
        """Count as gone, in a moment, the instances that are not there any more now that our link is back."""
        if any(self._doubtful.values()):
            asyncio.get_running_loop().call_later(NEWS_S, self._be_sure)

    def _be_sure(self) -> None:
        for seat, left in self._doubtful.items():
            if left and not self._cut:
                self._remove(seat, left.copy())
                left.clear()


def _ignore(seat: Seat) -> None:
    """Do nothing: no turn waits yet."""


async def _ignore_here(seat: Seat) -> None:
    """Do nothing: no turn asks yet."""
