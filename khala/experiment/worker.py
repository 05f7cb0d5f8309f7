"""The process that plays matches of an experiment, one after the other.

A job is a line of JSON on stdin, the answer a line of JSON on stdout; stdin's end ends the process. The agents decide
in this process (`khala.playing.one_process`), unless the job wants processes for them.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import sys
from typing import TYPE_CHECKING

from khala.experiment.job import Done, Job
from khala.playing import one_process
from khala.playing.local import Supplies
from khala.playing.local import play as play_with_processes
from khala_agents.llm.limits import own_turns
from khala_bridge.game.processes import IdleGames
from khala_orchestrator.past.resume import read_unfinished
from khala_protocol.errors import KhalaError
from khala_protocol.parent_watch import end_with_parent
from khala_protocol.recording import Recording
from khala_protocol.signals import cancelled_by_signal
from khala_protocol.visible import VisibleFormatter

if TYPE_CHECKING:
    from khala_agents.llm.limits import Gates
    from khala_bridge.game.processes import Processes


def main(arguments: list[str] | None = None) -> None:
    """Play matches until stdin ends."""
    options = argparse.ArgumentParser(prog="khala.experiment.worker")
    options.add_argument("--game", default="simulator")
    given = options.parse_args(arguments)
    end_with_parent()
    log_quietly()
    asyncio.run(cancelled_by_signal(_work(given.game)))


def log_quietly() -> None:
    """Log what a person should know."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(VisibleFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.basicConfig(level=logging.WARNING, handlers=[handler])
    logging.getLogger("absl").setLevel(logging.ERROR)  # PySC2 warns at each step of abilities that it has no name for


async def _work(game: str) -> None:
    lines = await _stdin()
    with contextlib.closing(IdleGames()) as games:
        while line := await lines.readline():
            done = await played(Job.model_validate_json(line), game, games=games)
            sys.stdout.write(done.model_dump_json() + "\n")
            sys.stdout.flush()


async def played(job: Job, game: str, gates: Gates = own_turns, games: Processes | None = None) -> Done:
    """Play a match, and return how it ended.

    Args:
        job: the match.
        game: `simulator`, `starcraft2`, or a directory.
        gates: where requests to models wait for their turn.
        games: where the process of the game comes from, and goes afterwards.
    """
    try:
        async with asyncio.timeout(job.timeout_s):
            past = read_unfinished(Recording.open(job.beginning)) if job.beginning else None
            if job.processes:
                supplies = Supplies(processes=games)
                results = await play_with_processes(
                    job.config, job.minds, job.directory, game=game, past=past, supplies=supplies
                )
            else:
                results = await one_process.play(
                    job.config, job.minds, game=game, past=past, gates=gates, processes=games
                )
    except TimeoutError:
        return Done(state="timeout", words=f"it took longer than {job.timeout_s / 3600:g} hours")
    except (KhalaError, ExceptionGroup) as error:
        return Done(state="error", words=str(_cause(error)))
    invalid = dict.fromkeys(result.invalid_because for result in results if not result.valid)
    return Done(state="done", words="; ".join(invalid))


async def _stdin() -> asyncio.StreamReader:
    reader = asyncio.StreamReader(limit=2**24)
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    return reader


def _cause(error: Exception) -> Exception:
    """Return the first error of nested groups; raise a group that holds a fault of ours."""
    if not isinstance(error, ExceptionGroup):
        return error
    _, others = error.split(KhalaError)
    if others is not None:
        raise error
    return _cause(error.exceptions[0])


if __name__ == "__main__":
    main()
