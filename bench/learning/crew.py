"""Processes that share the work of a course: each has the model, and plays groups of battles or learns rows.

Above: `bench.learning.learns`; below: the model and the battles. Weights come with every piece of work, so it does not
matter which process takes it.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import signal
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self, TypeAlias

import numpy as np
import torch

from bench.learning.battles import Boards, PlayedBattle
from bench.learning.model import ModelPlayer, Row, SmallModel
from khala_bridge.errors import GameError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from khala_bridge.task.config import TaskConfig

    Adapter: TypeAlias = Sequence[NDArray[np.float32]]


PART: Final = 16
"""Battles that a process plays in lockstep: the model answers 16 prompts in hardly more time than one."""

PARENT_DIED: Final = 1
"""What `prctl` of Linux calls the signal that a process gets when its parent ends."""

GAMES_LOST: Final = 3
"""Times that a part is played again because a game was lost."""


class Part(NamedTuple):
    """Battles for a process."""

    seeds: Sequence[int]
    temperature: float
    """Of the tokens; 0 for the likeliest."""
    sampled: int
    """Seed of the sampling."""


class _Worker(NamedTuple):
    model: SmallModel
    boards: Boards
    most: int


class Crew:
    """The processes, forked from this one: the frozen weights are in memory once.

    Each uses a single thread, because threads of a busy machine wait for each other.

    Args:
        count: of processes.
        task: with one agent.
        model: that plays and learns.
        most: tokens of an answer.
    """

    def __init__(self, count: int, task: TaskConfig, model: SmallModel, most: int) -> None:
        self._count = count
        fork = multiprocessing.get_context("fork")
        self._pool = ProcessPoolExecutor(count, fork, _begin, (_Worker(model, Boards(task, PART), most),))

    def __enter__(self) -> Self:
        """Start no process yet."""
        return self

    def __exit__(self, *failure: object) -> None:
        """End the processes after the work that they have begun."""
        self._pool.shutdown(cancel_futures=True)

    def play(self, adapter: Adapter, parts: Sequence[Part]) -> Iterator[PlayedBattle]:
        """Yield the battles of each part when all of them are over."""
        for done in as_completed([self._pool.submit(_play, adapter, part) for part in parts]):
            yield from done.result()

    def gradients(self, adapter: Adapter, rows: Sequence[Row]) -> tuple[Adapter, float]:
        """Return the gradient of a batch, by parameter, and its loss, the mean over its tokens.

        Args:
            adapter: values of the trained parameters.
            rows: at least one.
        """
        tokens = sum(len(row.answer) for row in rows)
        parts = [rows[start :: self._count] for start in range(min(self._count, len(rows)))]
        found = [done.result() for done in [self._pool.submit(_gradients, adapter, part, tokens) for part in parts]]
        sums = [np.sum(values, axis=0) for values in zip(*(gradients for gradients, _ in found), strict=True)]
        return sums, sum(loss for _, loss in found)


_workers: list[_Worker] = []
"""That of this process."""


def _begin(worker: _Worker) -> None:
    ctypes.CDLL(None).prctl(PARENT_DIED, signal.SIGKILL)  # else a course that is killed leaves its processes behind
    _workers.append(worker)


def _play(adapter: Adapter, part: Part) -> list[PlayedBattle]:
    (worker,) = _workers
    worker.model.take_adapter(adapter)
    torch.manual_seed(part.sampled)
    player = ModelPlayer(worker.model, most=worker.most, temperature=part.temperature)
    for _ in range(GAMES_LOST):
        try:
            return list(worker.boards.play(player, part.seeds))
        except GameError:  # a game that does not answer, as on a machine with many others
            worker.boards.close()
    return list(worker.boards.play(player, part.seeds))


def _gradients(adapter: Adapter, rows: Sequence[Row], tokens: int) -> tuple[Any, float]:
    (worker,) = _workers
    worker.model.take_adapter(adapter)
    return worker.model.gradients(rows, tokens)
