"""One host: a game, a bus and a match, put together and taken apart in order.

Above it: the command line. The caller opens and closes the bus and the game: the bus, because a
host may be its own router, and the game, because only its caller knows which one it is.
"""

from __future__ import annotations

import contextlib
import gc
from typing import TYPE_CHECKING

from khala_orchestrator.announce import Announcer
from khala_orchestrator.cards import run_card
from khala_orchestrator.match import Match
from khala_orchestrator.pacing import pacing_of
from khala_orchestrator.record import Listener, RecordingBus
from khala_orchestrator.roster import Roster
from khala_orchestrator.side import Side
from khala_orchestrator.turn import Turn
from khala_protocol.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.bus import Bus
    from khala_protocol.messages import Briefing, Message, Report, Result, Wire


async def host(
    config: MatchConfig, game: Sides, bus: Bus, *, watch: Callable[[Wire], None] = lambda _: None
) -> list[Result]:
    """Wait for the agents, play the match with them, and return its results.

    Args:
        config: the match to play.
        game: a game that was started for this task and seed.
        bus: a session on the bus that agents join.
        watch: is called with the run card, every report and every result.

    Raises:
        MissingAgents: required agents did not come in time.
        RecordingError: the recording cannot be written.
        GameError: the game died or hangs.
    """
    sides = sides_of(config)
    seats = [seat for side in sides for seat in side.seats]
    required = [side.seat(agent) for side in sides for agent in side.required]
    card = run_card(config, game.info)
    async with contextlib.AsyncExitStack() as stack:
        flush = _nothing
        if config.record is not None:
            recorder = stack.enter_context(Recorder(config.record))
            bus, flush = RecordingBus(bus, recorder, seats), recorder.flush
            await stack.enter_async_context(Listener(bus, config.run))
        announcer = await stack.enter_async_context(Announcer(bus, config.run, seats))
        roster = await stack.enter_async_context(Roster(bus, config.run, seats))
        grace_s = config.task.clock.grace_s
        turn = await stack.enter_async_context(Turn(bus, config.run, roster, required=required, grace_s=grace_s))
        await announcer.run(card)
        watch(card)
        await roster.assemble(required, config.assemble_s)
        gc.freeze()  # imports stay for good: scanning them again and again stops a step for 40 ms
        observer = _PublishingObserver(announcer, watch, flush)
        match = Match(config, game, sides, turn, observer, pacing_of(config.task.clock))
        return [result async for result in match.play()]


def sides_of(config: MatchConfig) -> list[Side]:
    """Return the sides of a match, in the order of the game's players."""
    return [Side(task, config.run) for task in config.task.per_side()]


class _PublishingObserver:
    """An observer that publishes what happens, calls `watch`, and flushes the recording after each step."""

    def __init__(self, announcer: Announcer, watch: Callable[[Wire], None], flush: Callable[[], None]) -> None:
        self._announcer = announcer
        self._watch = watch
        self._flush = flush

    async def brief(self, briefing: Briefing) -> None:
        await self._announcer.brief(briefing)

    async def message(self, message: Message) -> None:
        await self._announcer.message(message)

    async def report(self, report: Report) -> None:
        await self._announcer.report(report)
        self._flush()
        self._watch(report)

    async def result(self, result: Result) -> None:
        await self._announcer.result(result)
        self._flush()
        self._watch(result)


def _nothing() -> None:
    """Flush nothing: there is no recording."""
