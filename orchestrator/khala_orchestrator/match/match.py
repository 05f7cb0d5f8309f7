"""The match: reset, observe, ask, act, until the episode is over.

The loop reads like the turn in docs/design/turn.md. It owns only the order: `khala_orchestrator.match.schedule` decides
who is asked and when a decision takes effect, `khala_orchestrator.match.turn` which replies are in time, and
`khala_orchestrator.match.side` what agents see, what their words do, and who hears which message. It needs no bus: a
recording can stand in for the agents (`AgentPool`).
"""

from __future__ import annotations

import time
from collections import defaultdict
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, TypeAlias

from khala_orchestrator.match.cards import briefing
from khala_orchestrator.match.pacing import AtOnce
from khala_orchestrator.match.schedule import Cadence, Schedule, StepId
from khala_orchestrator.match.tally import Tally, valid_together
from khala_protocol.messages import Timings

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence

    from khala_bridge.game.game import Sides, StepResult
    from khala_bridge.state import Snapshot
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.pacing import Pacing
    from khala_orchestrator.match.scenery import Scenery
    from khala_orchestrator.match.schedule import SeatChoice
    from khala_orchestrator.match.side import MatchSide
    from khala_orchestrator.match.turn import AgentPool, Answers, Question
    from khala_orchestrator.roster import Seat
    from khala_protocol.messages import Briefing, Message, Report, Result

Phase = Literal["observe", "act", "game"]
Asks: TypeAlias = "Callable[[StepId, Sequence[Seat]], None]"
"""Is called with a step and the agents that are asked in it, before they are."""


class MatchObserver(Protocol):
    """What is notified of events in a match."""

    async def brief(self, briefing: Briefing) -> None:
        """Take a briefing, before the first observation of an episode."""
        ...

    async def message(self, message: Message) -> None:
        """Take a message from one agent to another or to a channel, before the report of the step."""
        ...

    async def report(self, report: Report) -> None:
        """Take the report of a step."""
        ...

    async def result(self, result: Result) -> None:
        """Take the result of an episode."""
        ...


class SilentObserver:
    """A `MatchObserver` that does nothing."""

    async def brief(self, briefing: Briefing) -> None:
        """Do nothing."""

    async def message(self, message: Message) -> None:
        """Do nothing."""

    async def report(self, report: Report) -> None:
        """Do nothing."""

    async def result(self, result: Result) -> None:
        """Do nothing."""


class StepOutcome(NamedTuple):
    """The outcome of a step: a report and a snapshot for each side, and the agents that are lost for good, with why."""

    reports: Sequence[Report]
    snapshots: Sequence[Snapshot]
    lost: Mapping[Seat, str]


@dataclass
class Match:
    """The agents of one or two sides in one game, for a number of episodes."""

    config: MatchConfig
    game: Sides
    sides: Sequence[MatchSide]
    """In the order of the game's players."""
    agents: AgentPool
    match_observer: MatchObserver
    pacing: Pacing = field(default_factory=AtOnce)
    scenery: Scenery | None = None
    """Shows the map to those who watch; None if nobody does."""
    asks: Asks = lambda *_: None
    schedule: Schedule = field(init=False)

    def __post_init__(self) -> None:
        places = ((side, agent) for side in self.sides for agent in side.task.agents)
        cadences = {side.seat(agent.name): Cadence(agent.every_loops, agent.when) for side, agent in places}
        self.schedule = Schedule(self.config.task.clock, cadences)

    async def play(self, first: int = 0) -> AsyncIterator[Result]:
        """Play every episode from the first one on; yield the result of each side. One that is aborted is the last."""
        for episode in range(first, self.config.episodes):
            results = await self._episode(episode)
            for result in results:
                yield result
            if any(result.outcome == "aborted" for result in results):
                return

    def briefings(self, episode: int) -> Iterator[Briefing]:
        """Yield what each agent has to know in an episode."""
        for task in (side.task for side in self.sides):
            for agent in task.agents:
                yield briefing(task, agent, self.config.run, episode, self.config.episodes)

    async def _episode(self, episode: int) -> Sequence[Result]:
        began = time.perf_counter()
        await self._begin(episode)
        snapshots: Sequence[Snapshot] = await self.game.reset()
        self.pacing.begin()
        both = zip(self.sides, snapshots, strict=True)
        tallies = [self._tally(side, snapshot) for side, snapshot in both]
        at = StepId(episode, 0)
        lost: Mapping[Seat, str] = {}
        while not (lost or any(snapshot.ended for snapshot in snapshots) or at.step == self.config.task.max_steps):
            reports, snapshots, lost = await self._step(at, snapshots)
            for tally, report, snapshot in zip(tallies, reports, snapshots, strict=True):
                tally.add(report, snapshot)
                await self.match_observer.report(report)
            at = StepId(episode, at.step + 1)
        wall_s = time.perf_counter() - began
        results = valid_together([t.result(self.config.run, episode, wall_s=wall_s, agents_lost=lost) for t in tallies])
        for result in results:
            await self.match_observer.result(result)
        return results

    async def _step(self, at: StepId, snapshots: Sequence[Snapshot]) -> StepOutcome:
        watch = Stopwatch()
        loop = snapshots[0].game_loop
        lag_s = await self.pacing.until(loop)
        with watch.phase("observe"):
            for side, snapshot in zip(self.sides, snapshots, strict=True):
                side.look(snapshot)
            chosen = self._choose(at, loop)
            self.asks(at, chosen.seats)
        async with self.scenery.shown(at, snapshots) if self.scenery else nullcontext():
            answers = await self.agents.ask(self._questions(at, chosen.seats, watch), wait=self.config.task.clock.waits)
        self.schedule.decide(answers.by_seat, loop)
        with watch.phase("act"):
            due = self.schedule.take_due(loop)
            turns = [side.act(at, due, answers.advice) for side in self.sides]
            for message in (message for turn in turns for message in turn.post.taken):
                await self.match_observer.message(message)
        with watch.phase("game"):
            results = await self.game.act([turn.commands for turn in turns], self.schedule.loops(loop))
        timings = watch.timings(answers, lag_s)
        reports: Sequence[Report] = [
            side.report(at, turn, result, timings, answers.incidents, chosen.unasked)
            for side, turn, result in zip(self.sides, turns, results, strict=True)
        ]
        snapshots = [result.snapshot for result in results]
        if answers.lost or any(now.ended for now in snapshots) or at.step + 1 == self.config.task.max_steps:
            reports = self._whole(at, reports, results)
        return StepOutcome(reports, snapshots, answers.lost)

    def _choose(self, at: StepId, loop: int) -> SeatChoice:
        return self.schedule.choose(
            at,
            loop,
            happened=lambda seat: self._side(seat).triggers_of(seat.agent),
            is_needed=lambda seat: self._side(seat).is_needed(seat.agent),
        )

    async def _begin(self, episode: int) -> None:
        self.schedule.begin()
        for side in self.sides:
            side.begin()
        for message in self.briefings(episode):
            await self.match_observer.brief(message)

    def _questions(self, at: StepId, seats: Sequence[Seat], watch: Stopwatch) -> Iterator[Question]:
        """Yield a question per seat, made on demand: the first agent thinks while others' observations are made."""
        for seat in seats:
            with watch.phase("observe"):
                question = self._side(seat).question(seat.agent, at)
            yield question

    def _tally(self, side: MatchSide, snapshot: Snapshot) -> Tally:
        others = [f"side {other.name}" for other in self.sides if other is not side]
        opponent = self.game.info.opponent or self.config.task.against or ", ".join(others)
        task = self.config.task
        return Tally(
            snapshot,
            side.name,
            side.required,
            opponent=opponent,
            undecided=task.faults.undecided,
            variant=task.variant,
        )

    def _side(self, seat: Seat) -> MatchSide:
        return next(side for side in self.sides if side.name == seat.side)

    def _whole(self, at: StepId, reports: Sequence[Report], results: Sequence[StepResult]) -> Sequence[Report]:
        """Return the reports of the last step of an episode, with the decisions that were dropped."""
        loop = results[0].snapshot.game_loop
        pending = self.schedule.drop(loop)
        dropped = [side.report_dropped(at, pending, loop) for side in self.sides]
        pairs = zip(reports, dropped, strict=True)
        return [report.model_copy(update={"agents": (*report.agents, *more)}) for report, more in pairs]


class Stopwatch:
    """Seconds that each phase of a step took."""

    def __init__(self) -> None:
        self._took_s: dict[Phase, float] = defaultdict(float)

    @contextmanager
    def phase(self, name: Phase) -> Iterator[None]:
        """Add the time inside to a phase."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._took_s[name] += time.perf_counter() - began

    def timings(self, answers: Answers, lag_s: float) -> Timings:
        """Return all phases of a step; `Answers` brings the time of asking."""
        return Timings(
            observe_s=self._took_s["observe"],
            publish_s=answers.publish_s,
            wait_s=answers.wait_s,
            held_s=answers.held_s,
            act_s=self._took_s["act"],
            game_s=self._took_s["game"],
            lag_s=lag_s,
        )
