"""Seats for a caller: whoever asks for turns, and answers them, plays agents of a match.

    async with SeatedMatch(config, seats_of(config.task)) as match:
        while not (turn := await match.turn()).over:
            for seat, seen in turn.asked.items():
                match.act(seat, reply_to(seen.observation.text))

The match is one of `khala_sc2.playing.one_process`: the same host, the same workers, the same recording. Only the policy of
a seat waits for the caller. Above it are doors of other tools, such as an environment for reinforcement learning.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections import deque
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

from khala_agents.policy import Policy
from khala_orchestrator.match.schedule import StepId
from khala_orchestrator.roster import Seat
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.errors import ConfigError, KhalaError
from khala_protocol.messages import Report, Result
from khala_sc2.playing import one_process

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from types import TracebackType

    from khala_agents.policy import Context, Said
    from khala_bridge.game.processes import Processes
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Briefing, ImageRef, Observation, Wire
    from khala_sc2.playing.minds import Minds

__all__ = [
    "CallerPolicy",
    "NotAsked",
    "Seat",
    "SeatedMatch",
    "SeatsTurn",
    "Seen",
    "seat_named",
    "seats_of",
    "without_time_limit",
]


class NotAsked(KhalaError):
    """The caller answered for an agent that waits for no answer."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What an agent of the caller sees when it is asked.

    Attributes:
        briefing: who it is and what it may do, in this episode.
        observation: what it is to answer.
        pictures: those that the observation names, in their order, as files in its format; one that did not arrive is
            left out.
    """

    briefing: Briefing
    observation: Observation
    pictures: Sequence[bytes] = ()

    def arrived_pictures(self) -> Iterator[tuple[ImageRef, bytes]]:
        """Yield the pictures, each with what the observation says of it."""
        files = {hashlib.sha256(picture).hexdigest(): picture for picture in self.pictures}
        return ((ref, files[ref.sha256]) for ref in self.observation.images if ref.sha256 in files)


@dataclass(frozen=True, slots=True)
class SeatsTurn:
    """What the caller has to answer, and what has happened since its turn before.

    Attributes:
        asked: by seat, what each agent sees that waits for the caller's answer.
        reports: of the steps since the turn before, of the sides on which the caller has agents. They say what became
            of its replies.
        results: of an episode that is over, for these sides. Such a turn asks nobody; the next one is of the next
            episode.
        over: whether the match is over, with this turn or before it.
    """

    asked: Mapping[Seat, Seen] = field(default_factory=dict)
    reports: Sequence[Report] = ()
    results: Sequence[Result] = ()
    over: bool = False


class CallerPolicy(Policy):
    """The policy of one seat: it decides what the caller answers. `SeatedMatch` makes them."""

    def __init__(self, seat: Seat, open_questions: _OpenQuestions) -> None:
        self._seat = seat
        self._open_questions = open_questions

    async def decide(self, context: Context) -> Said:
        """Return the caller's answer."""
        refs = context.observation.images
        arrived = await context.pictures.get(refs)
        pictures = [arrived[ref.sha256] for ref in refs if ref.sha256 in arrived]
        return await self._open_questions.answer(self._seat, Seen(context.briefing, context.observation, pictures))


class SeatedMatch:
    """A match in this process, some of whose agents are played by the caller. An asynchronous context manager.

    Its methods are for the event loop in which it was entered. The game stands still between turns, unless the clock is
    `realtime`; then an agent waits for an answer until its deadline, and the others go on.

    Attributes:
        seats: those that the caller plays.
        broker: endpoint of the bus, for external listeners.
    """

    def __init__(
        self,
        config: MatchConfig,
        seats: Iterable[Seat],
        minds: Mapping[str, Minds] = MappingProxyType({}),
        *,
        game: str = "simulator",
        processes: Processes | None = None,
    ) -> None:
        """Take a match.

        Args:
            config: the match to play; `unhurried` gives the caller all the time that it wants.
            seats: those that the caller plays.
            minds: by side, how all other agents decide.
            game: `simulator`, `starcraft2`, or a directory.
            processes: where the process of the game comes from, and goes afterwards.

        Raises:
            ConfigError: there is no such seat, or nobody decides for an agent.
        """
        self.seats = tuple(seats)
        self.broker = MemoryBroker()
        _check(config.task, self.seats, minds)
        self._config, self._minds, self._game, self._processes = config, minds, game, processes
        self._sides = {seat.side for seat in self.seats}
        self._questions = _OpenQuestions()
        self._reports: list[Report] = []
        self._results: list[Result] = []
        self._ended: deque[SeatsTurn] = deque()
        self._over = False
        self._playing: asyncio.Task[list[Result]] | None = None

    async def __aenter__(self) -> Self:
        self._playing = asyncio.create_task(self._play(), name=f"match {self._config.run}")
        self._playing.add_done_callback(lambda _: self._questions.changed.set())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._playing is not None
        if not self._over:  # after the last result, what remains is to close the recording and the game
            self._playing.cancel()
        await asyncio.wait({self._playing})
        if error is None and not self._playing.cancelled():
            self._playing.result()

    async def turn(self) -> SeatsTurn:
        """Wait until all agents of the caller that are asked now have their observations, or an episode is over.

        Called again before all of them are answered, it returns those that still wait.

        Raises:
            KhalaError: the match failed; the text says what to do.
        """
        assert self._playing is not None
        while not (self._ended or self._questions.are_complete):
            if self._playing.done():
                self._playing.result()
                return SeatsTurn(over=True)
            self._questions.changed.clear()
            await self._questions.changed.wait()
        if self._ended:
            return self._ended.popleft()
        return SeatsTurn(asked=self._questions.seen(), reports=self._take_reports())

    async def news(self) -> SeatsTurn:
        """Wait until something is new, and return all that there is: for agents of the caller with paces of their own.

        An agent is asked, its time for an answer is over, a step is reported, or an episode has ended. `asked` has
        every agent that waits for an answer now, one that was returned before as well.

        Raises:
            KhalaError: as in `turn`.
        """
        assert self._playing is not None
        if not (self._ended or self._playing.done()):
            await self._questions.changed.wait()
        self._questions.changed.clear()
        if self._ended:
            return self._ended.popleft()
        if self._playing.done():
            self._playing.result()
            return SeatsTurn(over=True)
        return SeatsTurn(asked=self._questions.seen(), reports=self._take_reports())

    def act(self, seat: Seat, said: Said) -> None:
        """Answer for an agent: with a reply, or a reply with its usage.

        Raises:
            NotAsked: it waits for no answer.
        """
        self._questions.close(seat, said)

    async def _play(self) -> list[Result]:
        callers = {seat: CallerPolicy(seat, self._questions) for seat in self.seats}
        return await one_process.play(
            self._config,
            self._minds,
            game=self._game,
            watch=self._watch,
            processes=self._processes,
            callers=callers,
            asks=self._asks,
            broker=self.broker,
        )

    def _asks(self, at: StepId, seats: Sequence[Seat]) -> None:
        self._questions.expect(at, [seat for seat in seats if seat in self.seats])

    def _watch(self, message: Wire) -> None:
        if isinstance(message, Report) and message.side in self._sides:
            self._reports.append(message)
            self._questions.changed.set()
        elif isinstance(message, Result):
            self._results.append(message)
            if len(self._results) == len(self._config.task.per_side()):
                self._end_episode()

    def _end_episode(self) -> None:
        results, self._results = self._results, []
        aborted = any(result.outcome == "aborted" for result in results)
        self._over = aborted or results[0].episode == self._config.episodes - 1
        theirs = tuple(result for result in results if result.side in self._sides)
        self._ended.append(SeatsTurn(reports=self._take_reports(), results=theirs, over=self._over))
        self._questions.changed.set()

    def _take_reports(self) -> tuple[Report, ...]:
        reports, self._reports = self._reports, []
        return tuple(reports)


def seats_of(task: TaskConfig) -> list[Seat]:
    """Return the seats that a caller may take: those of all agents, in the order of the match."""
    return [Seat(side.side, agent.name) for side in task.per_side() for agent in side.agents]


def seat_named(name: str, there_are: Sequence[Seat], *, source: str) -> Seat:
    """Return the seat of an agent, which is named with its side if agents of two sides have the same name.

    Raises:
        ConfigError: there is none, or there are several; it names the source.
    """
    found = [seat for seat in there_are if name in (seat.agent, str(seat))]
    if len(found) == 1:
        return found[0]
    what = f"there are {' and '.join(map(str, found))}" if found else f"there is no {name}"
    raise ConfigError(f"{what}: give one of {', '.join(map(str, there_are))}", source=source)


def without_time_limit(task: TaskConfig) -> TaskConfig:
    """Return the task without a limit of time for an answer."""
    return task.model_copy(update={"clock": task.clock.model_copy(update={"max_wait_s": None})})


def _check(task: TaskConfig, seats: Sequence[Seat], minds: Mapping[str, Minds]) -> None:
    there_are = seats_of(task)
    if unknown := [seat for seat in seats if seat not in there_are]:
        raise ConfigError(f"the task {task.name} has no seat {unknown[0]}: it has {', '.join(map(str, there_are))}")
    if left := [seat for seat in there_are if seat not in seats and seat.side not in minds]:
        raise ConfigError(f"nobody decides for {left[0]}: take its seat as well, or give minds for side {left[0].side}")


@dataclass(slots=True)
class _Question:
    seen: Seen
    answer: asyncio.Future[Said]


@dataclass(slots=True)
class _OpenQuestions:
    """The questions to agents of the caller that wait for its answer.

    Attributes:
        changed: is set when there may be something new for the caller.
    """

    changed: asyncio.Event = field(default_factory=asyncio.Event)
    _open: dict[Seat, _Question] = field(default_factory=dict)
    _newest: dict[Seat, StepId] = field(default_factory=dict)
    """By seat, its newest question, answered or not: a match that goes on in a new game asks for its open step
    again."""
    _expected: tuple[StepId, Sequence[Seat]] = (StepId(0, 0), ())

    @property
    def are_complete(self) -> bool:
        """Whether somebody waits for an answer, and nobody who is asked now has yet to get its observation."""
        at, seats = self._expected
        return bool(self._open) and all(self._newest.get(seat) == at for seat in seats)

    def expect(self, at: StepId, seats: Sequence[Seat]) -> None:
        """Note who is asked in a step."""
        self._expected = at, seats

    def seen(self) -> dict[Seat, Seen]:
        """Return what those see who wait for an answer."""
        return {seat: question.seen for seat, question in self._open.items()}

    async def answer(self, seat: Seat, seen: Seen) -> Said:
        """Return the caller's answer to a question, once it is there."""
        question = _Question(seen, asyncio.get_running_loop().create_future())
        self._open[seat] = question
        self._newest[seat] = StepId(seen.observation.episode, seen.observation.step)
        self.changed.set()
        try:
            return await question.answer
        finally:
            if self._open.get(seat) is question:  # it was cancelled: too late, or a newer one is there
                del self._open[seat]
                self.changed.set()

    def close(self, seat: Seat, said: Said) -> None:
        """Answer a question.

        Raises:
            NotAsked: there is none for this seat.
        """
        question = self._open.pop(seat, None)
        if question is None:
            waiting = ", ".join(map(str, self._open)) or "nobody"
            raise NotAsked(f"{seat} waits for no answer, {waiting} does: `turn` says who is asked")
        if not question.answer.done():
            question.answer.set_result(said)
