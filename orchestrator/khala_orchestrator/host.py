"""One host: a game, a bus and a match, put together and taken apart in order.

Above it: the command line. The caller opens and closes the bus and the game: the bus, because a
host may be its own router, and the game, because only its caller knows which one it is.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Self

from khala_orchestrator.match.cards import run_card
from khala_orchestrator.match.match import Match
from khala_orchestrator.match.pacing import AtOnce, pacing_of
from khala_orchestrator.match.scenery import Scenery
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.turn import Turn
from khala_orchestrator.past.resume import ResumedTurn
from khala_orchestrator.publish.advisers import AdviceInbox
from khala_orchestrator.publish.announce import Announcer
from khala_orchestrator.publish.record import BestEffort, Listener, RecordingBus
from khala_orchestrator.roster import Roster
from khala_protocol.errors import RecordingError
from khala_protocol.garbage import tidy_memory
from khala_protocol.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Sequence
    from pathlib import Path
    from types import TracebackType

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.match import Asks
    from khala_orchestrator.match.side import MatchSide
    from khala_orchestrator.match.turn import Answer
    from khala_orchestrator.past.resume import Unfinished
    from khala_orchestrator.publish.record import OwnedSink
    from khala_orchestrator.roster import Seat
    from khala_protocol.bus import Bus
    from khala_protocol.messages import Briefing, Message, Report, Result, Scene, Terrain, Wire

_LONG_STEP_S = 0.5
"""After this time, the recording of a step is flushed before its end; a part of a step compresses a little less."""


async def host(
    config: MatchConfig,
    game: Sides,
    bus: Bus,
    *,
    watch: Callable[[Wire], None] = lambda _: None,
    past: Unfinished | None = None,
    asks: Asks = lambda *_: None,
) -> list[Result]:
    """Wait for the agents, play the match with them, and return its results.

    Args:
        config: the match to play.
        game: a game that was started for this task and seed.
        bus: a session on the bus that agents join.
        watch: is called with the run card, every report and every result.
        past: what was played of this match; `game` begins with the first episode that is not over.
        asks: is called in each step with the agents that are asked, also while `past` is played again.

    Raises:
        ResumeError: the game goes another way than in what was played.
        MissingAgents: required agents did not come in time.
        RecordingError: the recording cannot be written.
        GameError: the game died or hangs.
    """
    sides = sides_of(config)
    seats = [seat for side in sides for seat in side.seats]
    required = [side.seat(agent) for side in sides for agent in side.required]
    advisers = [side.seat(adviser.name) for side in sides for adviser in side.task.advisers]
    card = run_card(config, game.info)
    async with contextlib.AsyncExitStack() as stack:
        flush = _nothing
        if config.record is not None:
            recorder = stack.enter_context(_recorder(config, config.record, past))
            flush = recorder.flush
            bus = recording = RecordingBus(bus, recorder, seats)
            await stack.enter_async_context(Listener(recording, config.run))
        announcer = await stack.enter_async_context(Announcer(bus, config.run, seats, advisers))
        roster = await stack.enter_async_context(Roster(bus, config.run, seats))
        inbox = await stack.enter_async_context(AdviceInbox(bus, config.run, advisers))
        turn = await stack.enter_async_context(_turn(config, bus, roster, sides, inbox))
        await announcer.run(card)
        flush()  # a host that is killed before its first report can be resumed, too
        watch(card)
        observer = stack.enter_context(_PublishingObserver(announcer, watch, flush))
        scenery = Scenery(config.task, config.run, game, observer)
        match = Match(config, game, sides, turn, observer, pacing_of(config.task.clock), scenery, asks)
        for briefing in match.briefings(past.episode if past else 0):  # by which agents know that the host is there
            await announcer.brief(briefing)
        tidy_memory()
        await roster.assemble(required, config.assemble_s)
        if past is None:
            return [result async for result in match.play()]
        return [*past.results, *[result async for result in _resume(match, past, observer)]]


def _recorder(config: MatchConfig, path: Path, past: Unfinished | None) -> OwnedSink:
    recorder = Recorder(path) if past is None else _continue_recording(path, past)
    return BestEffort(recorder) if config.task.faults.recording_lost == "go_on" else recorder


def _continue_recording(path: Path, past: Unfinished) -> Recorder:
    """Return a recorder that has what is kept of a recording.

    The file has its name only then: who resumes takes the newest recording, and half a copy is not one.
    """
    part = path.with_suffix(".part")
    part.unlink(missing_ok=True)  # of a host that was killed here
    recorder = Recorder(part)
    for sample in past.kept():
        recorder.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns)
    recorder.flush()
    part.replace(path)
    return recorder


def _turn(config: MatchConfig, bus: Bus, roster: Roster, sides: Sequence[MatchSide], inbox: AdviceInbox) -> Turn:
    required = [side.seat(agent) for side in sides for agent in side.required]
    of_name = {side.name: side for side in sides}
    rule = config.task.faults.agent_gone
    grace_s = config.task.clock.grace_s if rule == "wait" else 0.0
    waited_for = () if rule == "go_on" else required

    def judge(seat: Seat, answer: Answer) -> str:
        return of_name[seat.side].judge(seat.agent, answer)

    return Turn(bus, config.run, roster, required=waited_for, grace_s=grace_s, advice=inbox.take, judge=judge)


def _resume(match: Match, past: Unfinished, observer: _PublishingObserver) -> AsyncIterator[Result]:
    """Play a match from where its recording ends; what was published then is not published again."""
    pacing = match.pacing
    match.pacing = AtOnce()
    observer.live = False

    async def go_live() -> None:
        match.pacing = pacing
        await observer.go_live()

    match.agents = ResumedTurn(past, match.agents, go_live)
    return match.play(past.episode)


class _PublishingObserver:
    """An observer that publishes what happens, calls `watch`, and flushes the recording after each step.

    During a long step it flushes what was recorded so far, so that a reader of the file sees the map that the agents
    are thinking about. A context manager.

    Attributes:
        live: False while a recording is played again: then it only keeps the briefings, and the map of the open step.
    """

    def __init__(self, announcer: Announcer, watch: Callable[[Wire], None], flush: Callable[[], None]) -> None:
        self._announcer = announcer
        self._watch = watch
        self._flush = flush
        self._held: list[Briefing] = []
        self._terrain: Terrain | None = None
        self._scene: Scene | None = None
        self._flushing: asyncio.TimerHandle | None = None
        self.live = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop_flushing()

    def _stop_flushing(self) -> None:
        if self._flushing is not None:
            self._flushing.cancel()

    def _flush_early(self) -> None:
        with contextlib.suppress(RecordingError):  # of a full disk, which the end of the step reports
            self._flush()

    async def go_live(self) -> None:
        """Publish from now on, beginning with the briefings of the episode and its map."""
        self.live = True
        for briefing in self._held:
            await self._announcer.brief(briefing)
        if self._terrain is not None:
            await self._announcer.terrain(self._terrain)
        if self._scene is not None:
            await self._announcer.scene(self._scene)

    async def brief(self, briefing: Briefing) -> None:
        if self.live:
            await self._announcer.brief(briefing)
        else:
            self._held.append(briefing)

    async def terrain(self, terrain: Terrain) -> None:
        if self.live:
            await self._announcer.terrain(terrain)
        else:
            self._terrain = terrain

    async def scene(self, scene: Scene) -> None:
        if self.live:
            await self._announcer.scene(scene)
            self._flushing = asyncio.get_running_loop().call_later(_LONG_STEP_S, self._flush_early)
        else:
            self._scene = scene

    async def message(self, message: Message) -> None:
        if self.live:
            await self._announcer.message(message)

    async def report(self, report: Report) -> None:
        if self.live:
            self._stop_flushing()
            await self._announcer.report(report)
            self._flush()
            self._watch(report)
        else:
            self._scene = None

    async def result(self, result: Result) -> None:
        await self._announcer.result(result)
        self._flush()
        self._watch(result)


def _nothing() -> None:
    """Flush nothing: there is no recording."""
