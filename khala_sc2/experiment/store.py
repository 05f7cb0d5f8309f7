"""The directory of an experiment: its file, a recording for each match, and an index of them in SQLite.

    NAME/experiment.yaml                    as it was given
    NAME/matches/KEY/recording.mcap         one directory for each match, under the hash of what it plays
    NAME/index.sqlite                       tables `matches`, `results` and `calls`

The recordings are the truth. The index is made of them, and made again when it is missing, broken or of another
version: see `khala_sc2.indexes`. A recording without a result is of a match that was interrupted or crashed, and stays
beside the one of the next try.
"""

from __future__ import annotations

import contextlib
import logging
import re
import sqlite3
import weakref
from collections import defaultdict
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from filelock import FileLock, Timeout

from khala_agents.llm.money import SUFFIX, MoneyLedger
from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.files import make_private, write_private
from khala_protocol.recording import Recording
from khala_sc2 import indexes
from khala_sc2.experiment.index import CALLS, Row, add, connect, create, played_in, results_in, schema, take
from khala_sc2.experiment.measures import measure_with_calls
from khala_sc2.experiment.played import PlayedMatch, judge
from khala_sc2.experiment.spec import Experiment
from khala_sc2.playing.matches import free_recording, tries_in
from khala_sc2.playing.spending import paid_usd

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path


log = logging.getLogger(__name__)

T = TypeVar("T")
FILE, INDEX, MATCHES, LOGS, LOCK = "experiment.yaml", "index.sqlite", "matches", "logs", ".lock"
_REPETITION = re.compile("[0-9]{1,9}")


class Store:
    """The directory of one experiment."""

    def __init__(self, directory: Path) -> None:
        """Open the directory, which need not be there yet."""
        self.directory = directory
        self._open: sqlite3.Connection | None = None
        self._is_locked = False

    @classmethod
    def open(cls, directory: Path, out: Path | None = None) -> Store:
        """Return the store of an experiment that has begun: of a directory, or of one with this name below `out`.

        Raises:
            ConfigError: there is none.
        """
        if out is not None and not directory.is_dir():
            directory = out / directory
        if not (directory / FILE).is_file():
            raise ConfigError(f"there is no experiment in {directory}: `khala experiment run FILE` begins one")
        return cls(directory)

    @property
    def logs(self) -> Path:
        """The directory for logs of processes."""
        return self.directory / LOGS

    def experiment(self) -> Experiment:
        """Return the experiment, from its file."""
        return load(self.directory / FILE, Experiment)

    def begin(self, file: Path) -> None:
        """Create the directory, and keep the file of the experiment; a newer one replaces it."""
        make_private(self.directory)
        if file.resolve() != (self.directory / FILE).resolve():
            write_private(self.directory / FILE, file.read_bytes())

    @contextlib.contextmanager
    def lock(self) -> Iterator[None]:
        """Keep other runners out.

        Raises:
            ConfigError: another one is at work here.
        """
        try:
            held = FileLock(self.directory / LOCK, mode=0o600).acquire(blocking=False)
        except Timeout:
            raise ConfigError(f"another process plays the experiment in {self.directory}: wait for it") from None
        with held:
            self._is_locked = True
            try:
                yield
            finally:
                self._is_locked = False

    def recording_for(self, key: str) -> Path:
        """Return an unused path for the recording of a match, in a directory that is there."""
        make_private(self.directory / MATCHES / key)
        return free_recording(self.directory / MATCHES / key)

    # --- the index ----------------------------------------------------------------------------------

    @property
    def _index(self) -> sqlite3.Connection:
        return self._open or self._keep(self._open_index())

    def _keep(self, index: sqlite3.Connection) -> sqlite3.Connection:
        self._open = index
        weakref.finalize(self, index.close)  # by whichever thread drops the store
        return index

    def _open_index(self) -> sqlite3.Connection:
        path = self.directory / INDEX
        if not path.exists() and not any(self._tries()):
            return create(path)
        try:
            with indexes.faults(path):
                return connect(path)
        except sqlite3.DatabaseError as error:
            return self._rebuild(error if path.exists() else None)

    def _rebuild(self, error: Exception | None) -> sqlite3.Connection:
        """Return the index after it was made again; in memory, where the directory takes nothing."""
        path = self.directory / INDEX
        log.warning("%s %s: it is rebuilt from the recordings", path, f"is broken ({error})" if error else "is missing")
        try:
            with contextlib.nullcontext() if self._is_locked else self.lock():
                return self._write()
        except (ConfigError, OSError) as why:
            log.warning("%s is kept in memory for now, and nothing is lost: %s", path, why)
            index = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
            index.executescript(schema())
            return self._fill(index)

    def _write(self) -> sqlite3.Connection:
        """Make a new index, and put it in the place of the old one when it is whole."""
        path = self.directory / INDEX
        part = path.with_name(f".{INDEX}.part")
        indexes.remove(part)
        try:
            with contextlib.closing(create(part)) as index, indexes.faults(part):
                self._fill(index)
            indexes.remove(path)
            part.replace(path)
        finally:
            indexes.remove(part)
        return connect(path)

    def _fill(self, index: sqlite3.Connection) -> sqlite3.Connection:
        for tries in self._tries():
            best = _best(tries)
            if (found := self.read(best, attempts=len(tries))) is not None:
                take(index, best, *found)
        return index

    def _tries(self) -> Iterator[list[Path]]:
        """Yield the recordings of each match that has any, the newest last."""
        return filter(None, map(tries_in, sorted((self.directory / MATCHES).glob("*"))))

    def _ask(self, read: Callable[[sqlite3.Connection], T]) -> T:
        """Return what is read of the index; it is made again if that shows that it is broken."""
        index = self._index
        try:
            with indexes.faults(self.directory / INDEX):
                return read(index)
        except (sqlite3.DatabaseError, ValueError, LookupError) as error:
            index.close()
            return read(self._keep(self._rebuild(error)))

    def add(self, played: PlayedMatch, rows: Sequence[Row]) -> None:
        """Note what became of a match; it replaces what was known of it.

        Raises:
            OSError: the disk is full, or takes nothing.
        """
        self._ask(lambda index: add(index, played, rows))

    def matches(self) -> dict[str, PlayedMatch]:
        """Return what is known of each match, by its key."""
        if not (self.directory / INDEX).exists() and not any(self._tries()):
            return {}
        return self._ask(played_in)

    def results(self) -> list[dict[str, Any]]:
        """Return a row for each episode and side: its measures, and what is known of its match."""
        return self._ask(results_in)

    def calls(self) -> list[dict[str, Any]]:
        """Return what became of calls, by match, episode, side, agent and action."""
        return self._ask(lambda index: [dict(zip(CALLS, row, strict=True)) for row in index.execute(
            "select match, episode, side, agent, action, became, count from calls order by rowid"
        )])  # fmt: skip

    def rebuild(self) -> int:
        """Make the index anew of the recordings, and return the number of matches.

        Raises:
            ConfigError: another process plays the experiment.
            OSError: the disk is full, or takes nothing; the index stays as it was.
        """
        if self._open is not None:
            self._open.close()
            self._open = None
        with self.lock():
            self._keep(self._write())
        return len(self.matches())

    def take(self, path: Path, *, attempts: int) -> None:
        """Read a recording into the index; one without a run card says nothing."""
        if (found := self.read(path, attempts=attempts)) is not None:
            self._ask(lambda index: take(index, path, *found))

    def read(self, path: Path, *, attempts: int, crash: str = "") -> tuple[PlayedMatch, list[Row]] | None:
        """Return what became of a recorded match, and its measures; None if there is no run card.

        Args:
            path: of the recording.
            attempts: how often the match was begun.
            crash: why it was not played to its end: `crash` or `timeout`; "" if it seems it was.
        """
        try:
            recording = Recording.open(path)
        except RecordingError:
            return None
        if (card := recording.run) is None:
            return None
        if not _REPETITION.fullmatch(card.labels.get("repetition", "0")):
            log.warning("%s has labels that no experiment gives: it is left out", path)
            return None
        rows = measure_with_calls(recording)
        played = judge(card, [row for row, _ in rows], str(path.relative_to(self.directory)), attempts, crash)
        is_priced = any(row.paid_usd is not None for row, _ in rows)
        cost_usd = sum(map(_paid_usd, tries_in(path.parent)))
        return replace(played, cost_usd=cost_usd if cost_usd or is_priced else None), rows

    def booked_usd(self) -> dict[str, float]:
        """Return by match the most that its tries have cost as far as they have ledgers, also if they were not read."""
        sums = defaultdict[str, float](float)
        for path in (self.directory / MATCHES).glob(f"*/recording*{SUFFIX}"):
            with MoneyLedger(path) as ledger:
                sums[path.parent.name] += ledger.booked_usd()
        return sums

    def adopt(self) -> None:
        """Take in recordings of a runner that was killed: what its matches have cost counts."""
        make_private(self.directory)
        known = self._ask(played_in)  # begins an index if there is none, and nothing to make it of
        for tries in self._tries():
            key = tries[0].parent.name
            if key not in known or known[key].attempts < len(tries):
                self.take(_best(tries), attempts=len(tries))


def _best(tries: Sequence[Path]) -> Path:
    """Return the newest recording that has the result of every episode, or else the newest with a run card."""
    if len(tries) == 1:
        return tries[0]
    found = [recording for path in reversed(tries) if (recording := _open_recording(path)) and recording.run]
    whole = (
        recording
        for recording in found
        if recording.run and len({result.episode for result in recording.results}) >= recording.run.episodes
    )
    best = next(whole, found[0] if found else None)
    return best.path if best else tries[-1]


def _open_recording(path: Path) -> Recording | None:
    with contextlib.suppress(RecordingError):
        return Recording.open(path)
    return None


def _paid_usd(path: Path) -> float:
    """Return what a try has cost of which there may be half a recording."""
    try:
        return paid_usd(path)
    except RecordingError:
        return 0.0
