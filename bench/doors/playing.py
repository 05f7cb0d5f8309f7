"""Play rows, one after the other or in several processes, and say how each of them fared."""

from __future__ import annotations

import asyncio
import contextlib
import io
import multiprocessing
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bench.doors.ending import end_on_sigterm
from bench.doors.registry import load_rows
from bench.doors.rows import Skipped

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bench.doors.rows import Row


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a row fared.

    Attributes:
        through: how it got through; "" if the door held.
        skipped: why it could not be played here; "" if it was.
        took_s: seconds that it took.
        noise: what libraries wrote on stderr meanwhile.
    """

    through: str = ""
    skipped: str = ""
    took_s: float = 0.0
    noise: str = ""

    @property
    def word(self) -> str:
        """Return the outcome in a word."""
        return "GOT THROUGH" if self.through else "skipped" if self.skipped else "held"


def play(row: Row) -> Outcome:
    """Play a row in an empty directory; a row that raises got through."""
    began = time.perf_counter()
    through = skipped = ""
    with (
        tempfile.TemporaryDirectory(prefix="khala-doors-") as directory,
        contextlib.redirect_stderr(io.StringIO()) as noise,
    ):
        try:
            through = asyncio.run(row.play(Path(directory)))
        except Skipped as reason:
            skipped = str(reason)
        except Exception as error:  # noqa: BLE001  # whatever it is, the other rows are played as well
            traceback.print_exc()
            through = f"{type(error).__name__}: {error}"
    return Outcome(through, skipped, time.perf_counter() - began, noise.getvalue())


def play_all(rows: Sequence[Row], numbers: Sequence[int], jobs: int) -> Iterator[tuple[int, Outcome]]:
    """Yield the numbers of rows with their outcomes, as they come.

    Args:
        rows: all rows of the doors that are tried.
        numbers: those of them to play.
        jobs: number of processes; 1 for this one alone.
    """
    if jobs == 1:
        yield from ((number, play(rows[number])) for number in numbers)
        return
    # rows hold functions that cannot be sent, so each process loads them; a session of Zenoh survives no fork
    context = multiprocessing.get_context("spawn")
    with context.Pool(jobs, initializer=end_on_sigterm) as pool:  # ends its processes when it is left
        chosen = [(number, rows[number].door, rows[number].what) for number in numbers]
        yield from pool.imap_unordered(_play_row, chosen)


def _play_row(given: tuple[int, str, str]) -> tuple[int, Outcome]:
    number, door, what = given
    return number, play(next(row for row in load_rows(door) if (row.door, row.what) == (door, what)))
