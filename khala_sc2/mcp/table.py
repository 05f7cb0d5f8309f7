"""A match whose seats are played by sessions, each at its own pace.

Above: `khala_sc2.mcp.server`, which gives one seat to an MCP client. Below: `khala_sc2.playing.seats`, which plays the match.
"""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Self

from khala_protocol.errors import KhalaError
from khala_sc2.playing.seats import NotAsked, Seat, SeatedMatch

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
    from types import TracebackType

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import AgentReport, Report, Result
    from khala_sc2.playing.minds import Minds
    from khala_sc2.playing.seats import SeatsTurn, Seen


MOST_MESSAGES: Final = 16
"""That one answer takes along; a client could add others without end."""


@dataclass(frozen=True, slots=True)
class TableLook:
    """What a player finds when it looks.

    Attributes:
        seen: what it has to answer; None if it is not asked.
        left_s: seconds until the match goes on without it; None for no limit.
        fates: what became of its answers since its look before.
        results: of episodes that have ended since.
        over: whether the match is over.
        others: who is asked as well, and has not answered.
    """

    seen: Seen | None
    left_s: float | None
    fates: Sequence[AgentReport]
    results: Sequence[Result]
    over: bool
    others: Sequence[Seat]


@dataclass(slots=True)
class _Place:
    """What one seat has to answer, and what its player has not seen yet."""

    seen: Seen | None = None
    """The newest observation, answered or not."""
    arrived_s: float = 0.0
    waits: bool = False
    """Whether it still waits for an answer."""
    looked: bool = False
    """Whether the player has seen it."""
    messages: list[tuple[str, str]] = field(default_factory=list)
    fates: list[AgentReport] = field(default_factory=list)
    results: list[Result] = field(default_factory=list)


class Table:
    """A match, and the places at it. An asynchronous context manager; the match begins with the first look."""

    def __init__(
        self,
        config: MatchConfig,
        seats: Iterable[Seat],
        minds: Mapping[str, Minds] = MappingProxyType({}),
        *,
        game: str = "simulator",
    ) -> None:
        """Take a match; arguments and errors are those of `SeatedMatch`."""
        self.config = config
        self._match = SeatedMatch(config, seats, minds, game=game)
        self._places = {seat: _Place() for seat in self._match.seats}
        self._changed = asyncio.Event()
        self._step: Report | None = None
        self._over = False
        self._playing: asyncio.Task[None] | None = None

    @property
    def seats(self) -> Sequence[Seat]:
        """The seats that sessions play."""
        return self._match.seats

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._playing is not None:
            if not self._over:  # the rest of a match that is over is to close its recording and its game
                self._playing.cancel()
            await asyncio.wait({self._playing})
            if error is None and not self._playing.cancelled():
                self._playing.result()

    def newest(self, seat: Seat) -> Seen | None:
        """Return the newest observation of a seat, answered or not; None before its first one."""
        return self._places[seat].seen

    async def look(self, seat: Seat, *, within_s: float, on_step: Callable[[Report], Awaitable[None]]) -> TableLook:
        """Wait until a seat is asked, or an episode is over, and return what its player finds.

        Args:
            seat: whose player looks.
            within_s: longest time to wait.
            on_step: is awaited with the last step of the match, while the player waits.

        Raises:
            KhalaError: the match failed; the text says what to do.
        """
        place = self._places[seat]
        known = self._step
        playing = self._begin()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(within_s):
                while not (place.waits or place.results or self._over or playing.done()):
                    await self._changed.wait()
                    if self._step is not known and self._step is not None:
                        known = self._step
                        await on_step(known)
        if playing.done():
            playing.result()
        return self._taken(place)

    def _taken(self, place: _Place) -> TableLook:
        fates, place.fates = place.fates, []
        results, place.results = place.results, []
        others = [seat for seat, other in self._places.items() if other is not place and other.waits]
        if place.seen is None or not place.waits:
            return TableLook(None, None, fates, results, self._over, others)
        place.looked = True
        within_s = place.seen.observation.answer_within_s
        now_s = asyncio.get_running_loop().time()
        left_s = None if within_s is None else max(0.0, within_s - (now_s - place.arrived_s))
        return TableLook(place.seen, left_s, fates, results, self._over, others)

    def message(self, seat: Seat, to: str, text: str) -> None:
        """Put a message into the next answer of a seat.

        Raises:
            NotAsked: the seat has not been asked for anything yet.
            KhalaError: it cannot write to such a recipient, or has written too much.
        """
        place = self._places[seat]
        if place.seen is None:
            raise NotAsked(f"{seat} has seen nothing yet: call observe first")
        briefing = place.seen.briefing
        known = [*(contact.name for contact in briefing.correspondents), *briefing.channels]
        if to not in known:
            raise KhalaError(f"{seat} cannot write to {to!r}: it can write to {', '.join(known) or 'nobody'}")
        if len(place.messages) >= MOST_MESSAGES:
            raise KhalaError(f"{MOST_MESSAGES} messages wait for your next act already: call act, which sends them")
        place.messages.append((to, text))

    def act(self, seat: Seat, reply: str) -> None:
        """Answer the observation that the player of a seat has seen last, with its messages behind the reply.

        Raises:
            NotAsked: the seat waits for no answer, or for one to an observation that its player has not seen.
        """
        place = self._places[seat]
        if self._over:
            raise NotAsked("the match is over: nobody waits for an answer")
        if not place.waits:
            raise NotAsked(f"{seat} waits for no answer now: call observe, which waits until it does")
        if not place.looked:
            raise NotAsked("the time for an answer to what you saw is over: call observe, and answer what it says")
        self._match.act(seat, with_messages(reply, place.messages))
        place.waits = False
        place.messages = []

    def _begin(self) -> asyncio.Task[None]:
        if self._playing is None:
            self._playing = asyncio.create_task(self._play(), name=f"table of {self.config.run}")
            self._playing.add_done_callback(lambda _: self._tell())
        return self._playing

    async def _play(self) -> None:
        async with self._match as match:
            while not self._over:
                self._take(await match.news())
                self._tell()

    def _tell(self) -> None:
        """Wake all who wait now; those who come later wait for the next news."""
        self._changed.set()
        self._changed = asyncio.Event()

    def _take(self, turn: SeatsTurn) -> None:
        self._over = turn.over
        for report in turn.reports:
            self._step = report
            for agent in report.agents:
                if place := self._places.get(Seat(report.side, agent.agent)):
                    place.fates.append(agent)
        for seat, place in self._places.items():
            place.results += [result for result in turn.results if result.side == seat.side]
            seen = turn.asked.get(seat)
            if seen is not None and seen is not place.seen:
                place.seen = seen
                place.looked = False
                place.arrived_s = asyncio.get_running_loop().time()
            place.waits = seen is not None


def with_messages(reply: str, messages: Sequence[tuple[str, str]]) -> str:
    """Return a reply with messages to other agents behind it."""
    plain = [(to, text.replace("'''", '"')) for to, text in messages]  # three quotes would end the text
    said = [f"    <MessageTo({to}, '''{text}''')>" for to, text in plain]
    return "\n".join([reply, "Communications:", *said]) if said else reply
