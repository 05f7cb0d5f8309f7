"""Batches side by side: some in this process, or each in a worker process with memory that all share.

The compiled engine holds Python's lock while it plays, so that threads of one process would take turns; worker
processes do not. A word on a pipe begins a step, and another one says that it is done; all numbers are in the shared
memory. A worker ends when its pipe closes. Above: `khala_sc2.env.numeric.vector`. Below: `khala_sc2.env.numeric.batch`.
"""

from __future__ import annotations

import gc
import multiprocessing
import pickle
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from multiprocessing import connection
from multiprocessing.sharedctypes import RawArray
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_sc2.env.numeric.batch import Arrays, Batch, BatchSpec, shapes

if TYPE_CHECKING:
    import sys

    if sys.platform == "win32":
        from multiprocessing.connection import PipeConnection as Channel
    else:
        from multiprocessing.connection import Connection as Channel
    from collections.abc import Sequence
    from multiprocessing.process import BaseProcess

STEP: Final = b"step"
DONE: Final = b"done"
END: Final = b"end"
"""A worker that is started after another one has a copy of the other's pipe, so that closing it says nothing."""
_END_S: Final = 5.0


class WorkerError(RuntimeError):
    """A worker process failed or is gone; the message has what it said."""


class LocalShare:
    """Rows that this process plays itself, in the moment of `wait`."""

    def __init__(self, spec: BatchSpec, arrays: Arrays) -> None:
        self.batch = Batch(spec, arrays)
        self._seeds: Sequence[int | None] | None = None

    def begin(self, seeds: Sequence[int | None]) -> None:
        """Ask for new episodes."""
        self._seeds = seeds

    def step(self) -> None:
        """Ask for a step."""
        self._seeds = None

    def wait(self) -> None:
        """Do what was asked."""
        if self._seeds is None:
            self.batch.step()
        else:
            self.batch.begin(self._seeds)

    def close(self) -> None:
        """Forget the games."""
        for battle in self.batch.battles:
            battle.close()


@dataclass
class RemoteShare:
    """Rows that a worker process plays.

    Attributes:
        channel: to the worker; readable when it has done what was asked.
    """

    process: BaseProcess
    channel: Channel

    def begin(self, seeds: Sequence[int | None]) -> None:
        """Ask for new episodes."""
        self._say(pickle.dumps(list(seeds)))

    def step(self) -> None:
        """Ask for a step."""
        self._say(STEP)

    def _say(self, word: bytes) -> None:
        try:
            self.channel.send_bytes(word)
        except OSError as error:
            raise WorkerError(self._gone()) from error

    def wait(self) -> None:
        """Wait until what was asked is done.

        Raises:
            WorkerError: it failed.
        """
        try:
            word = self.channel.recv_bytes()
        except (EOFError, OSError) as error:
            raise WorkerError(self._gone()) from error
        if word != DONE:
            raise WorkerError(f"a worker process failed: {word.decode()}")

    def _gone(self) -> str:
        self.process.join(timeout=1)
        return f"a worker process is gone, with exit code {self.process.exitcode}: make the environments again"

    def close(self) -> None:
        """End the worker, once it has done what was asked."""
        with suppress(OSError):
            self.channel.send_bytes(END)
        self.channel.close()
        self.process.join(timeout=_END_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


class Shares:
    """All battles of a vector, as shares that play at the same time.

    Attributes:
        arrays: a row for each battle.
        parts: the shares, each with its rows.
    """

    def __init__(self, spec: BatchSpec, count: int, workers: int) -> None:
        """Make as many battles, in this process with one worker, else in as many worker processes."""
        self.parts: list[tuple[slice, LocalShare | RemoteShare]] = []
        if workers <= 1:
            self.arrays = {name: np.zeros((count, *shape), dtype) for name, (shape, dtype) in shapes(spec).items()}
            self.parts.append((slice(0, count), LocalShare(spec, self.arrays)))
            return
        memory = {
            name: RawArray("b", max(1, count * int(np.prod(shape)) * np.dtype(dtype).itemsize))
            for name, (shape, dtype) in shapes(spec).items()
        }
        self.arrays = _view(spec, memory, count)
        edges = np.linspace(0, count, min(workers, count) + 1).astype(int).tolist()
        for first, last in pairwise(edges):
            rows = slice(first, last)
            here, there = multiprocessing.Pipe()
            process = multiprocessing.get_context().Process(
                target=_work, args=(spec, memory, count, rows, there), daemon=True, name=f"khala-battles-{first}"
            )
            process.start()
            there.close()
            self.parts.append((rows, RemoteShare(process, here)))

    def first_done(self, waiting: Sequence[int]) -> int:
        """Return which of some shares has done first what was asked; it still has to be waited for."""
        shares = {part: self.parts[part][1] for part in waiting}
        channels = {share.channel: part for part, share in shares.items() if isinstance(share, RemoteShare)}
        return channels[connection.wait(channels)[0]] if channels else waiting[0]  # type: ignore[index]  # one of them

    def close(self) -> None:
        """End all."""
        for _, share in self.parts:
            share.close()


def _view(spec: BatchSpec, memory: Any, count: int) -> Arrays:
    return {
        name: np.frombuffer(memory[name], dtype, count * int(np.prod(shape))).reshape(count, *shape)
        for name, (shape, dtype) in shapes(spec).items()
    }


def _work(spec: BatchSpec, memory: Any, count: int, rows: slice, channel: Channel) -> None:
    """Play some rows as the pipe says, until it closes."""
    try:
        batch = Batch(spec, {name: array[rows] for name, array in _view(spec, memory, count).items()})
        while True:
            word = channel.recv_bytes()
            if word == END:
                return
            if word == STEP:
                batch.step()
            else:
                batch.begin(pickle.loads(word))  # noqa: S301  # from the process that started this one
                gc.collect()
                gc.freeze()  # tables and games, which live as long as the process
            channel.send_bytes(DONE)
    except (EOFError, OSError, KeyboardInterrupt):
        return
    except Exception as error:  # noqa: BLE001  # whatever it is, the caller must hear of it
        channel.send_bytes(f"{type(error).__name__}: {error}".encode())
