"""A match on an open bus: its game and its host, and both once more if the game is lost.

`khala_sc2.playing.local` and `khala host` are above; they bring the bus and the agents, which stay while a game is started
again.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from khala_bridge.act import executor_of
from khala_bridge.errors import GameError, GameMissing
from khala_bridge.game.game import GameConfig, GamePatience, GameThread, Sides
from khala_bridge.game.invitation import Invitation
from khala_bridge.game.pysc2_game import PySC2Game
from khala_orchestrator.host import host
from khala_orchestrator.past.resume import read_unfinished
from khala_protocol.errors import RecordingError
from khala_protocol.parent_watch import named_parent
from khala_protocol.recording import Recording
from khala_sc2.playing import environment

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_bridge.game.processes import Processes
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.match import Asks
    from khala_orchestrator.past.resume import Unfinished
    from khala_protocol.bus import Bus
    from khala_protocol.messages import Result, Wire

log = logging.getLogger(__name__)

MAX_RESTARTS = 3
"""A game that dies more often in one run would die for ever, at the same decision."""


async def host_match(
    config: MatchConfig,
    sc2path: Path,
    bus: Bus,
    *,
    watch: Callable[[Wire], None] = lambda _: None,
    past: Unfinished | None = None,
    processes: Processes | None = None,
    asks: Asks = lambda *_: None,
) -> list[Result]:
    """Play a match, and go on in a new game if the game dies or hangs and the task says so.

    The recording of the lost game stays beside the whole one, as `recording.lost-1.mcap`.

    Args:
        config: the match to play.
        sc2path: the install of the game.
        bus: a session on the bus that agents join.
        watch: is called with the run card, every new report and every result.
        past: what was played of this match before.
        processes: where the process of the game comes from, and goes afterwards.
        asks: is called in each step with the agents that are asked.

    Raises:
        KhalaError: the user can fix something; the text says what.
    """
    restarts = 0
    while True:
        try:
            first = past.episode if past else 0
            async with game_of(config, sc2path, first_episode=first, processes=processes) as game:
                return await host(config, game, bus, watch=watch, past=past, asks=asks)
        except GameMissing:
            raise
        except GameError as error:
            restarts += 1
            past = _rescue(config) if restarts <= MAX_RESTARTS else None
            if past is None:
                raise
            log.warning(
                "%s; starting it again, and going on with step %d of episode %d", error, past.steps, past.episode
            )


def game_of(config: MatchConfig, sc2path: Path, *, first_episode: int = 0, processes: Processes | None = None) -> Sides:
    """Return the game of a match, not started yet; its process is one of `processes`, if there are any."""
    task = config.task
    sides = task.per_side()
    invitation = Invitation(log=config.record and config.record.with_name("guest.log"))
    started = GameConfig(
        sc2path=sc2path,
        map=task.map_spec,
        players=len(sides),
        opponent=task.opponent,
        realtime=task.clock.rule == "realtime",
        seed=config.seed + first_episode,
        render_px=task.render_px,
        environment=environment.plain() | named_parent(),
    )
    thread = GameThread(
        lambda: PySC2Game(started, processes, invitation),
        patience=GamePatience().against(task.opponent),
        give_up=invitation.withdrawn.set,
    )
    return Sides(thread, [executor_of(side) for side in sides])


def _rescue(config: MatchConfig) -> Unfinished | None:
    """Return what was played of a match whose game is lost, out of the way of a new recording; None if it must end."""
    if config.task.faults.game_lost == "end" or config.record is None or not config.record.exists():
        return None
    try:
        read_unfinished(Recording.open(config.record), config)  # is there anything, and can it be played again?
    except RecordingError as error:
        log.warning("the game cannot be started again: %s", error)
        return None
    return read_unfinished(Recording.open(_put_aside(config.record)), config)


def _put_aside(path: Path) -> Path:
    number = 1
    while (aside := path.with_name(f"{path.stem}.lost-{number}{path.suffix}")).exists():
        number += 1
    return path.rename(aside)
