"""The work of `khala run`: what can begin at once begins at once.

To import what a match needs takes this process a second and a half, that of the agents one second, and the game half a
second. So the others are started first, with what is known by then: agents as a process that waits to be told which
ones to be, the game as one that has no map yet. `khala_sc2.cli` is above, and `khala_sc2.commands.run_options` declares the
options; `khala_sc2.playing.local` plays the match.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from khala_protocol.commandline import say
from khala_protocol.signals import cancelled_by_signal
from khala_sc2.commands.exit_codes import SIGNALLED
from khala_sc2.playing.spare import Spares

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from khala_bridge.game.processes import Launched
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Result
    from khala_sc2.commands.run_options import MindOptions


@dataclass(frozen=True, slots=True)
class WantedRun:
    """What the command line says of a match on this machine; names are those of its options."""

    task: str | None
    resume: Path | None
    run: str | None
    out: Path
    game: str
    match: Mapping[str, Any]
    """How it is played, as `khala_sc2.playing.matches.new_or_resumed` takes it."""
    minds: MindOptions


def run(wanted: WantedRun, *, as_json: bool) -> None:
    """Play a match on this machine, print the results, and end in order on SIGINT and SIGTERM."""
    known: list[MatchConfig] = []
    results = asyncio.run(cancelled_by_signal(_play(wanted, known)))
    if not known:
        assert isinstance(results, signal.Signals)
        say("interrupted before the match began", err=True)
        raise typer.Exit(SIGNALLED + results)
    from khala_sc2.commands.host import end  # noqa: PLC0415  # see above

    end(known[0], results, as_json=as_json)


async def _play(wanted: WantedRun, known: list[MatchConfig]) -> list[Result]:
    """Return the results; `known` gets the match as soon as it is known."""
    async with Spares(1) as stock:
        with _game_for(wanted) as launched:
            from khala_orchestrator.console import Progress, stderr_console  # noqa: PLC0415
            from khala_sc2.playing.local import Supplies, play  # noqa: PLC0415  # a second, in which the others import as well
            from khala_sc2.playing.matches import new_or_resumed  # noqa: PLC0415
            from khala_sc2.playing.minds import Minds, minds_of, trust_options  # noqa: PLC0415

            config, past = new_or_resumed(wanted.task, wanted.resume, wanted.run, wanted.out, **wanted.match)
            named = wanted.minds.of_sides()
            common = Minds(**wanted.minds.of_all())
            trust_options(common, named)
            minds = minds_of([side.side for side in config.task.per_side()], common, named)
            known.append(config)
            supplies = Supplies(spawn=stock, processes=launched)
            logs = wanted.out / config.run
            with Progress(stderr_console(), config.task.max_steps, logs) as progress:
                return await play(
                    config, minds, logs, game=wanted.game, watch=progress, past=past,
                    supplies=supplies,
                )  # fmt: skip


@contextlib.contextmanager
def _game_for(wanted: WantedRun) -> Iterator[Launched | None]:
    """Start a process of the game, if it is for one player against the computer and draws nothing; end it if unused."""
    from khala_orchestrator.config import load_task  # noqa: PLC0415  # see above

    task = None if wanted.task is None else load_task(wanted.task)
    others = wanted.match["images"] or wanted.match["opponent"]
    if task is None or others or task.render_px or len(task.per_side()) > 1 or task.opponent.kind != "computer":
        yield None
        return
    from khala_bridge.game.processes import Launched  # noqa: PLC0415
    from khala_protocol.parent_watch import named_parent  # noqa: PLC0415
    from khala_sc2.playing import environment, games  # noqa: PLC0415

    sc2path, _ = games.find(wanted.game)
    with contextlib.closing(Launched(sc2path, environment.plain() | named_parent())) as launched:
        yield launched
