"""Forks: each with a name, a beginning from the recording and its part of the money; played, several at once."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_orchestrator.past.fork import advice_of, write_beginning
from khala_protocol.files import make_private
from khala_protocol.messages import Report
from khala_protocol.recording import Recording
from khala_sc2.playing.jobs import Job
from khala_sc2.playing.minds import groups_of, share_budget
from khala_sc2.playing.spending import paid_usd

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.past.fork import Trunk
    from khala_protocol.messages import AgentReport, Message, Result
    from khala_sc2.experiment.engine import Engine
    from khala_sc2.playing.minds import Minds

LONGEST_NAME = 40
"""Of the forked run, as part of the names of its forks; a name has at most 64 characters."""
HOURS = 6.0
"""A fork that takes longer is ended."""


@dataclass(frozen=True, slots=True)
class Fork:
    """A match that is forked from another, and is to be played."""

    trunk: Trunk
    config: MatchConfig
    minds: Mapping[str, Minds]
    """By side, without a budget."""
    advice: Sequence[Message] = ()

    @property
    def step(self) -> int:
        """The first step that its own agents decide."""
        assert self.config.forked is not None
        return self.config.forked.step

    @property
    def record(self) -> Path:
        """Where it is recorded."""
        assert self.config.record is not None
        return self.config.record


@dataclass(frozen=True, slots=True)
class Future:
    """What became of a fork."""

    fork: Fork
    results: Sequence[Result] = ()
    """One for each side; none if it could not be played."""
    spent_usd: float = 0.0
    decisions: int = 0
    """Of its own agents."""
    failed: int = 0
    """Of these, how many were no reply of the model or policy in time."""
    error: str = ""
    """Why it could not be played."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What is forked, and how.

    Attributes:
        trunk: the recorded episode.
        minds: by side, who decides from the step on.
        out: where each fork gets its directory, `fork-<step>-<n>`.
        advice: what is said to agents before the step, as `advice_of` takes it.
        memory: what prompts have of the steps before; None: as recorded.
    """

    trunk: Trunk
    minds: Mapping[str, Minds]
    out: Path
    advice: Sequence[str] = ()
    memory: str | None = None

    @property
    def who(self) -> str:
        """Who decides from the step on, in words."""
        names = [minds.policy or "/".join(filter(None, (minds.model, minds.model_name))) for minds in self._minds()]
        return ", ".join(dict.fromkeys(names))

    def _minds(self) -> Iterator[Minds]:
        return (minds for _, minds, _ in groups_of(self.trunk.config.task, self.minds))

    def forks(self, step: int, times: int) -> list[Fork]:
        """Return forks at a step, each in a new directory.

        Raises:
            KhalaError: there is no such step, or the advice or the memory is wrong.
        """
        return [self._fork(step) for _ in range(times)]

    def _reserve(self, step: int) -> str:
        """Make a directory that no other process has, and return its name."""
        make_private(self.out)
        first = 1 + max((int(path.name.rpartition("-")[2]) for path in self.out.glob(f"fork-{step}-[0-9]*")), default=0)
        for number in itertools.count(first):
            with contextlib.suppress(FileExistsError):
                (self.out / f"fork-{step}-{number}").mkdir(mode=0o700)
                break
        return f"fork-{step}-{number}"

    def _fork(self, step: int) -> Fork:
        directory = self._reserve(step)
        run = f"{self.trunk.config.run[:LONGEST_NAME]}-{directory}"
        config = self.trunk.fork(step, run, memory=self.memory)
        config = config.model_copy(update={"record": self.out / directory / "recording.mcap"})
        return Fork(self.trunk, config, self.minds, advice_of(config, self.advice))


class Purse:
    """Money for a number of forks: each may spend an equal part of what those before it left."""

    def __init__(self, budget_usd: float | None, forks: int) -> None:
        self._left_usd = budget_usd
        self._forks = forks

    def take(self) -> float | None:
        """Return what the next fork may spend; None for no limit."""
        if self._left_usd is None:
            return None
        part = self._left_usd / self._forks
        self._left_usd -= part
        self._forks -= 1
        return part

    def give_back(self, usd: float) -> None:
        """Take back what a fork did not spend."""
        self._left_usd = (self._left_usd or 0.0) + max(usd, 0.0)


async def play_all(
    forks: Sequence[Fork],
    engine: Engine,
    *,
    budget_usd: float | None = None,
    done: Callable[[Future], None] = lambda _: None,
) -> list[Future]:
    """Play forks, as many at a time as the engine has slots.

    Args:
        forks: what to play.
        engine: plays a match.
        budget_usd: what all forks may spend together.
        done: is called with each when it is over.

    Returns:
        what became of them, in their order.
    """
    purse = Purse(budget_usd, len(forks))
    room = asyncio.Semaphore(engine.slots)

    async def one(fork: Fork) -> Future:
        async with room:
            part_usd = purse.take()
            future = await _play(fork, engine, part_usd)
            if part_usd:
                purse.give_back(part_usd - future.spent_usd)
            done(future)
            return future

    async with asyncio.TaskGroup() as group:
        tasks = [group.create_task(one(fork), name=fork.config.run) for fork in forks]
    return [task.result() for task in tasks]


async def _play(fork: Fork, engine: Engine, budget_usd: float | None) -> Future:
    beginning = fork.record.with_name("beginning.mcap")
    try:
        await asyncio.to_thread(write_beginning, fork.trunk.recording, fork.config, beginning, fork.advice)
        minds = dict(fork.minds) if budget_usd is None else share_budget(fork.minds, budget_usd)
        job = Job(config=fork.config, minds=minds, timeout_s=3600 * HOURS, beginning=beginning)
        ended = await engine.play(job)
        if ended.state != "done":
            return Future(fork, error=ended.words, spent_usd=_paid_usd(fork.record))
        return await asyncio.to_thread(_future, fork)
    finally:
        beginning.unlink(missing_ok=True)


def _paid_usd(record: Path) -> float:
    return paid_usd(record) if record.exists() else 0.0


def _future(fork: Fork) -> Future:
    recording = Recording.open(fork.record)
    ok = [agent.status == "ok" for agent in _own_decisions(recording, fork.step)]
    return Future(fork, recording.results, _paid_usd(fork.record), len(ok), ok.count(False))


def _own_decisions(recording: Recording, first: int) -> Iterator[AgentReport]:
    for report in recording.of(Report):
        yield from (a for a in report.agents if (report.step if a.asked_step is None else a.asked_step) >= first)
