"""The process that plays one match of the service, as `khala run` does, and ends with it.

Before it knows the match it imports everything, starts a process of the game, which takes any map, and processes for
agents. Then it says so on stdout, and reads its job from stdin, as one line of JSON. Its last line on stdout says how
the match ended; without one, the worker was lost.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import signal
import sys
from typing import TYPE_CHECKING, Any

from khala.playing import environment, games
from khala.playing.local import Supplies, play
from khala.playing.matches import resume_match
from khala.playing.minds import Minds  # noqa: TC001  # pydantic evaluates it
from khala.playing.spare import Spares
from khala.service import logs
from khala_bridge.game.processes import Launched
from khala_bridge.observe import Observer
from khala_orchestrator.config import MatchConfig, load_task
from khala_protocol.bus.config import BusConfig  # noqa: TC001  # pydantic evaluates it
from khala_protocol.errors import KhalaError
from khala_protocol.messages import Frozen, Report
from khala_protocol.parent_watch import end_with_parent, named_parent
from khala_protocol.signals import cancelled_by_signal

if TYPE_CHECKING:
    from pathlib import Path

    from khala_orchestrator.past.resume import Unfinished
    from khala_protocol.messages import Wire

log = logging.getLogger(__name__)

USUAL_TASK = "2s3z_pair"
"""Any task: what is read once for all of them is read while there is time."""


class Job(Frozen):
    """One match for a worker."""

    config: MatchConfig
    minds: dict[str, Minds]
    """By side."""
    bus: BusConfig | None = None
    """How to join a router; None for one of its own."""
    resume: bool = False
    """Whether to go on with the newest recording of its directory."""

    @property
    def directory(self) -> Path:
        """Where its recording and its logs are."""
        assert self.config.record is not None, "the service records every match"
        return self.config.record.parent

    def match(self) -> tuple[MatchConfig, Unfinished | None]:
        """Return the match, and what was played of it."""
        if not self.resume:
            return self.config, None
        return resume_match(self.directory, self.directory.parent, assemble_s=self.config.assemble_s)


def main(arguments: list[str] | None = None) -> None:
    """Get ready, play one match, and end."""
    end_with_parent()
    options = argparse.ArgumentParser(prog="khala.service.worker")
    options.add_argument("--game", default="simulator")
    options.add_argument("--spares", type=int, default=0)
    options.add_argument("--log-json", action="store_true")
    given = options.parse_args(arguments)
    logs.set_up(as_json=given.log_json)
    ending: dict[str, Any] = {}
    try:
        done = asyncio.run(cancelled_by_signal(_work(given.game, given.spares)))
        ending = {"stopped": True} if isinstance(done, signal.Signals) else done
    except* KhalaError as group:
        ending = {"error": str(_first(group))}
    if ending:
        _say(ending)


async def _work(game: str, spares: int) -> dict[str, Any]:
    async with Spares(spares) as stock:
        launched = await asyncio.to_thread(_launched, game)
        try:
            await asyncio.to_thread(lambda: Observer(load_task(USUAL_TASK)))
            await stock.ready()
            _say({"ready": True})
            line = await _line()
            return await _play(Job.model_validate_json(line), game, stock, launched) if line else {}
        finally:
            launched.close()


async def _play(job: Job, game: str, stock: Spares, launched: Launched) -> dict[str, Any]:
    config, past = job.match()
    logs.here["run"] = config.run
    supplies = Supplies(bus=job.bus, spawn=stock, processes=launched)
    results = await play(config, job.minds, job.directory, game=game, watch=_remark, past=past, supplies=supplies)
    invalid = dict.fromkeys(result.invalid_because for result in results if not result.valid)
    return {"done": "; ".join(invalid)}


def _remark(message: Wire) -> None:
    """Log what a step had out of the ordinary, with its place."""
    if isinstance(message, Report):
        logs.here["step"] = message.step
        for agent in message.agents:
            if agent.status != "ok":
                log.warning("%s: %s", agent.status, agent.detail, extra={"agent": f"{agent.side}/{agent.agent}"})


def _launched(game: str) -> Launched:
    sc2path, _ = games.find(game)
    return Launched(sc2path, environment.plain() | named_parent())


async def _line() -> bytes:
    """Return one line of stdin; nothing if the parent wants no match."""
    reader = asyncio.StreamReader(limit=2**24)
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    return await reader.readline()


def _say(words: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()


def _first(group: BaseExceptionGroup[KhalaError]) -> BaseException:
    error: BaseException = group
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    return error


if __name__ == "__main__":
    main()
