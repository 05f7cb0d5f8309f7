"""Seats that persons take: an agent of a match whose decisions are awaited from a person.

A seat is a policy like any other, on a worker like any other: the same observations, the same deadline, one reply. It
knows no page: `khala_sc2.view.seats` shows it in a browser, and hands in what the person says. A seat adds presence.
Its worker joins the bus when a window of the person opens, and leaves it when no window has been open for `AWAY_S`. So
for the host a person who leaves is an agent that is gone, and one who comes back is an agent that was restarted.

Several windows may show a seat, and one of them plays it: the first one, or the one that took it over.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from khala_agents.policy import Policy
from khala_agents.worker import run_worker
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Result
from khala_sc2.playing.seats import NotAsked, Seen

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from khala_agents.policy import Context, Said
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.roster import Seat
    from khala_protocol.bus import Bus, Sample, Subscription
    from khala_protocol.messages import Briefing, Observation

AWAY_S: Final = 30.0
"""So long a seat stays on the bus without a window: a page that is loaded again, or a phone that changes its network,
is back sooner. The deadlines of the host go on meanwhile."""
COME_S: Final = 600.0
"""How long a host waits for its persons at the start, at least: they have to be sent a link."""
LAST_S: Final = 2.0
"""How long the last result may take to a person, once the match is over."""


@dataclass(slots=True, eq=False)
class PersonQuestion:
    """An observation that a person is asked about.

    Attributes:
        seen: what the person sees.
        time_s: seconds to answer in all; None for no limit.
        deadline_s: when the time is over, on the clock of the event loop; None for never.
        answer: what the person said; cancelled when the time is over or a newer question has come.
    """

    seen: Seen
    time_s: float | None
    deadline_s: float | None
    answer: asyncio.Future[str]

    @property
    def place(self) -> tuple[int, int]:
        """Episode and step."""
        return self.seen.observation.episode, self.seen.observation.step

    def asks(self, observation: Observation) -> bool:
        """Return whether an observation asks the same."""
        seen = self.seen.observation
        return (seen.episode, seen.step, seen.text) == (observation.episode, observation.step, observation.text)

    @property
    def waits(self) -> bool:
        """Whether it still waits for an answer."""
        return not self.answer.done()

    @property
    def sent(self) -> str | None:
        """The answer; None without one."""
        return self.answer.result() if self.answer.done() and not self.answer.cancelled() else None

    @property
    def left_s(self) -> float | None:
        """Seconds until the time is over, not below 0; None for no limit."""
        if self.deadline_s is None:
            return None
        return max(0.0, self.deadline_s - asyncio.get_running_loop().time())


class PersonSeat(Policy):
    """The seat of one person. Its methods are for one event loop.

    Attributes:
        seat: side and name of the agent.
        briefing: who the agent is, once the host has said it.
        question: the newest one, answered or not.
        results: of the agent's side, one for each episode that is over.
        over: whether the match is over.
    """

    human = True

    def __init__(self, seat: Seat) -> None:
        self.seat = seat
        self.briefing: Briefing | None = None
        self.question: PersonQuestion | None = None
        self.results: list[Result] = []
        self.over = False
        self._owner = ""
        self._windows = Counter[str]()
        self._news = asyncio.Event()

    @property
    def news(self) -> asyncio.Event:
        """An event that is set with the next change. Take it before you look, and no change is missed."""
        return self._news

    # --- as a policy --------------------------------------------------------------------------------

    async def prepare(self, briefing: Briefing) -> None:
        """Keep the briefing for the person."""
        self.briefing = briefing
        self._tell()

    async def decide(self, context: Context) -> Said:
        """Return what the person says; what was said already, if the same is asked again."""
        observation = context.observation
        if (before := self.question) is not None and before.sent is not None and before.asks(observation):
            return before.sent
        arrived = await context.pictures.get(observation.images)
        pictures = [arrived[ref.sha256] for ref in observation.images if ref.sha256 in arrived]
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        seen = Seen(context.briefing, observation, pictures)
        self.briefing = context.briefing
        self.question = PersonQuestion(seen, context.time_s, context.deadline, answer)
        self._tell()
        try:
            return await answer
        finally:
            self._tell()

    # --- as a person's windows see it ---------------------------------------------------------------

    @contextlib.contextmanager
    def window(self, name: str) -> Iterator[None]:
        """Hold a window open. It plays the seat unless one that is open does.

        Args:
            name: of the window, the same when it comes back.
        """
        if not self._windows[self._owner]:
            self._owner = name
        self._windows[name] += 1
        self._tell()
        try:
            yield
        finally:
            self._windows[name] -= 1
            self._tell()

    def is_owner(self, window: str) -> bool:
        """Return whether a window plays the seat."""
        return window == self._owner

    def take(self, window: str) -> None:
        """Have a window play the seat from now on, in place of the one that did."""
        self._owner = window
        self._tell()

    def answer(self, window: str, place: tuple[int, int], text: str) -> None:
        """Answer a question.

        Raises:
            NotAsked: it waits for no answer, or another window plays the seat; the text says what to do.
        """
        if not self.is_owner(window):
            raise NotAsked("another window plays this seat: take it over first")
        question = self.question
        if question is None or self.over:
            raise NotAsked("nothing is asked now")
        if question.place == place and question.sent is not None:
            raise NotAsked("this step was answered already: the first answer counts")
        if question.place != place or not question.waits:
            raise NotAsked("the time for this step is over: your draft is kept for the next one")
        question.answer.set_result(text)
        self._tell()

    # --- as the match sees it -----------------------------------------------------------------------

    def note_result(self, result: Result) -> None:
        """Take in the result of an episode."""
        if result.side != self.seat.side or any(known.episode == result.episode for known in self.results):
            return
        self.results.append(result)
        episodes = 1 if self.briefing is None else self.briefing.episodes
        self.over = result.outcome == "aborted" or result.episode >= episodes - 1
        self._tell()

    def end(self) -> None:
        """End the match for the person."""
        self.over = True
        self._tell()

    async def until_taken(self) -> None:
        """Wait until a window is open, or the match is over."""
        while not (self._windows.total() or self.over):
            await self._news.wait()

    async def until_left(self) -> None:
        """Wait until no window has been open for `AWAY_S`, or the match is over."""
        while not self.over:
            if self._windows.total():
                await self._news.wait()
                continue
            try:
                async with asyncio.timeout(AWAY_S):
                    await self.until_taken()
            except TimeoutError:
                return

    def _tell(self) -> None:
        self._news.set()
        self._news = asyncio.Event()


def with_persons(config: MatchConfig, seats: Collection[Seat]) -> MatchConfig:
    """Return a match whose run card says which agents persons play, and whose host waits until they have come."""
    if not seats:
        return config
    humans = frozenset((seat.side, seat.agent) for seat in seats)
    return config.model_copy(update={"humans": humans, "assemble_s": max(config.assemble_s, COME_S)})


async def play_seat(seat: PersonSeat, bus: Bus, run: str) -> None:
    """Play a seat from when its person has come until the match is over.

    Args:
        seat: of the person.
        bus: a session that may speak for the agent; stays open.
        run: name of the run.
    """
    results = await bus.subscribe(run_key(run, Topic.RESULT), Delivery.STATE)
    hearing = asyncio.create_task(_hear_results(results, seat), name=f"results {seat.seat}")
    try:
        while not seat.over:
            await seat.until_taken()
            ending = await _play_while_there(seat, bus, run)
            if ending == "bus closed":
                seat.end()
            elif ending == "result":
                await asyncio.wait({hearing}, timeout=LAST_S)
                seat.end()
    finally:
        await results.close()
        await asyncio.wait({hearing})


async def _play_while_there(seat: PersonSeat, bus: Bus, run: str) -> str:
    """Play as an agent on the bus until the person leaves or the match ends; return why the worker ended."""
    stop = asyncio.Event()
    leaving = asyncio.create_task(seat.until_left(), name=f"presence {seat.seat}")
    leaving.add_done_callback(lambda _: stop.set())
    try:
        return (await run_worker(bus, run, *seat.seat, seat, stop=stop)).ended
    finally:
        leaving.cancel()


async def _hear_results(results: Subscription[Sample], seat: PersonSeat) -> None:
    async for sample in results:
        with contextlib.suppress(PeerError):
            seat.note_result(decode_as(Result, sample.payload))
        if seat.over:
            return
