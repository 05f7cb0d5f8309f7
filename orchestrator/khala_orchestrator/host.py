"""One host: a game, a bus and a match, put together and taken apart in order.

Above it: the command line. The caller opens and closes the bus and the game: the bus, because a
host may be its own router, and the game, because only its caller knows which one it is.
"""

from __future__ import annotations

import contextlib
import gc
from typing import TYPE_CHECKING

from khala_bridge.act import Actor
from khala_bridge.observe import Observer
from khala_orchestrator.announce import Announcer
from khala_orchestrator.cards import run_card
from khala_orchestrator.mailbox import Mailbox
from khala_orchestrator.match import Match
from khala_orchestrator.record import Listener, RecordingBus
from khala_orchestrator.roster import Roster, Seat
from khala_orchestrator.turn import Turn
from khala_protocol.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.game.game import Sides
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match import MatchObserver
    from khala_orchestrator.turn import AgentPool
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
    seats = [Seat(config.task.side, agent.name) for agent in config.task.agents]
    required = [seat for seat, agent in zip(seats, config.task.agents, strict=True) if agent.required]
    card = run_card(config, game.info)
    async with contextlib.AsyncExitStack() as stack:
        flush = _nothing
        if config.record is not None:
            recorder = stack.enter_context(Recorder(config.record))
            bus, flush = RecordingBus(bus, recorder), recorder.flush
            await stack.enter_async_context(Listener(bus, config.run))
        announcer = await stack.enter_async_context(Announcer(bus, config.run, seats))
        roster = await stack.enter_async_context(Roster(bus, config.run, seats))
        turn = await stack.enter_async_context(Turn(bus, config.run, roster))
        await announcer.run(card)
        watch(card)
        await roster.assemble(required, config.assemble_s)
        gc.freeze()  # imports stay for good: scanning them again and again stops a step for 40 ms
        match = assemble(config, game, turn, _PublishingObserver(announcer, watch, flush))
        return [result async for result in match.play()]


def assemble(config: MatchConfig, game: Sides, agents: AgentPool, match_observer: MatchObserver) -> Match:
    """Return a match with everything between the game and the agents."""
    task = config.task
    reach = {
        Seat(task.side, agent.name): [Seat(task.side, other.name) for other in task.correspondents(agent)]
        for agent in task.agents
    }
    channels = task.channels if task.communication else ()
    return Match(
        config=config,
        game=game,
        observer=Observer(task),
        actor=Actor(task),
        agents=agents,
        mailbox=Mailbox(reach, channels),
        match_observer=match_observer,
    )


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
