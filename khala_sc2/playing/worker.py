"""The process that plays matches, one after the other: it reads jobs and writes endings, as `khala_sc2.playing.jobs` says.

The agents decide in this process (`khala_sc2.playing.one_process`), unless the job wants processes for them. It keeps its
game from match to match, and ends when its stdin does.

With `--live` it is for a match that somebody waits for. It gets ready before it knows which: it imports everything, and
starts a process of the game, which takes any map, and `--spares` processes for agents.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import sys
from dataclasses import replace
from io import FileIO
from typing import TYPE_CHECKING

from khala_agents.llm.limits import own_turns
from khala_bridge.game.processes import IdleGames, Launched
from khala_bridge.observe import Observer
from khala_orchestrator.config import load_task
from khala_orchestrator.past.resume import read_unfinished
from khala_protocol.errors import KhalaError
from khala_protocol.messages import Report
from khala_protocol.parent_watch import end_with_parent, named_parent
from khala_protocol.platforms import read_lines
from khala_protocol.signals import cancelled_by_signal
from khala_sc2.playing import environment, games, local, logs, one_process
from khala_sc2.playing.jobs import Ended, Job
from khala_sc2.playing.local import Supplies
from khala_sc2.playing.matches import newest_recording
from khala_sc2.playing.processes import LONGEST_LINE, redirect
from khala_sc2.playing.spare import Spares

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_agents.llm.limits import Gates
    from khala_protocol.messages import Wire

log = logging.getLogger(__name__)

USUAL_TASK = "2s3z_pair"
"""Any task: what is read once for all of them is read while there is time."""


def main(arguments: list[str] | None = None) -> None:
    """Play matches until stdin ends."""
    end_with_parent()
    options = argparse.ArgumentParser(prog="khala_sc2.playing.worker")
    options.add_argument("--game", default="simulator")
    options.add_argument("--live", action="store_true")
    options.add_argument("--spares", type=int, default=0)
    options.add_argument("--log-json", action="store_true")
    given = options.parse_args(arguments)
    logs.set_up(as_json=given.log_json)
    with _take_stdout() as answers:
        try:
            asyncio.run(cancelled_by_signal(_work(answers, game=given.game, live=given.live, spares=given.spares)))
        except KhalaError as error:  # it did not get ready, and ends before it has read its job
            _answer(answers, Ended(state="error", words=str(error)))


async def play(
    job: Job,
    *,
    game: str,
    watch: Callable[[Wire], None] = lambda _: None,
    gates: Gates = own_turns,
    supplies: Supplies | None = None,
) -> Ended:
    """Play a match, and return how it ended.

    Args:
        job: the match.
        game: `simulator`, `starcraft2`, or a directory.
        watch: is called with the run card, every report and every result.
        gates: where requests to models wait for their turn, if agents decide in this process.
        supplies: what is ready for it; the bus is the job's.
    """
    supplies = replace(supplies or Supplies(), bus=job.bus)
    try:
        async with asyncio.timeout(job.timeout_s):
            past = read_unfinished(newest_recording(job.beginning)) if job.beginning else None
            if job.processes:
                results = await local.play(
                    job.config, job.minds, job.directory, game=game, watch=watch, past=past, supplies=supplies
                )
            else:
                results = await one_process.play(
                    job.config, job.minds, game=game, watch=watch, past=past, processes=supplies.processes, gates=gates
                )
    except TimeoutError:
        if job.timeout_s is None:
            raise
        return Ended(state="timeout", words=f"it took longer than {job.timeout_s / 3600:g} hours")
    except (KhalaError, ExceptionGroup) as error:
        return Ended(state="error", words=str(_cause(error)))
    invalid = dict.fromkeys(result.invalid_because for result in results if not result.valid)
    return Ended(state="done", words="; ".join(invalid))


async def _work(answers: FileIO, *, game: str, live: bool, spares: int) -> None:
    async with Spares(spares) as stock:
        with contextlib.closing(await asyncio.to_thread(_launch, game) if live else IdleGames()) as processes:
            if live:
                await asyncio.to_thread(lambda: Observer(load_task(USUAL_TASK)))
                await stock.ready()
            watch = _log_step if live else lambda _: None
            supplies = Supplies(spawn=stock, processes=processes)
            jobs = await read_lines(sys.stdin.buffer, LONGEST_LINE)
            while line := await jobs.readline():
                job = Job.model_validate_json(line)
                logs.here.clear()
                logs.here["run"] = job.config.run
                try:
                    ended = await play(job, game=game, watch=watch, supplies=supplies)
                except asyncio.CancelledError:
                    _answer(answers, Ended(state="stopped", words="its process was told to end"))
                    raise
                _answer(answers, ended)


def _launch(game: str) -> Launched:
    sc2path, _ = games.find(game)
    return Launched(sc2path, environment.plain() | named_parent())


def _log_step(message: Wire) -> None:
    """Log what a step had out of the ordinary, with its place."""
    if isinstance(message, Report):
        logs.here["step"] = message.step
        for agent in message.agents:
            if agent.status != "ok":
                log.warning("%s: %s", agent.status, agent.detail, extra={"agent": f"{agent.side}/{agent.agent}"})


def _cause(error: Exception) -> Exception:
    """Return the first error of nested groups; raise a group that holds a fault of ours."""
    if not isinstance(error, ExceptionGroup):
        return error
    _, others = error.split(KhalaError)
    if others is not None:
        raise error
    return _cause(error.exceptions[0])


# --- the pipes to the parent --------------------------------------------------------------------------


def _take_stdout() -> FileIO:
    """Return the pipe to the parent; what a policy or a game prints leads nowhere from now on."""
    pipe = FileIO(os.dup(sys.stdout.fileno()), "w")
    redirect(sys.stdout.fileno(), os.devnull, os.O_WRONLY)
    return pipe


def _answer(answers: FileIO, ended: Ended) -> None:
    with contextlib.suppress(BrokenPipeError):  # the parent is gone
        answers.write(ended.model_dump_json().encode() + b"\n")


if __name__ == "__main__":
    main()
