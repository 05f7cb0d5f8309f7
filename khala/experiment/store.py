"""The directory of an experiment: its file, a recording for each match, and an index of them in SQLite.

    NAME/experiment.yaml                    as it was given
    NAME/matches/KEY/recording.mcap         one directory for each match, under the hash of what it plays
    NAME/index.sqlite                       tables `matches`, `results` and `calls`

The recordings are the truth: `rebuild` makes the index of them. A recording without a result is of a match that was
interrupted or crashed, and stays beside the one of the next try.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import shutil
import sqlite3
import weakref
from collections import defaultdict
from dataclasses import astuple, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from khala.experiment.measures import CallCount, Measures, measure_with_calls
from khala.experiment.plan import FACTOR
from khala.experiment.spec import Experiment
from khala.matches import free_recording
from khala.spending import paid_usd
from khala_agents.llm.money import SUFFIX, Ledger
from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from khala.experiment.plan import PlannedMatch
    from khala_protocol.messages import Run

Row = tuple[Measures, list[CallCount]]
State = Literal["done", "invalid", "crashed"]
"""`invalid`: it was played, and says nothing about its agents; `crashed`: it was not played to its end."""
FILE, INDEX, MATCHES, LOGS, LOCK = "experiment.yaml", "index.sqlite", "matches", "logs", ".lock"
VERSION = 1
SCHEMA = """
create table matches (
    key text primary key, cell text not null, seed integer not null, repetition integer not null,
    state text not null, cause text not null, attempts integer not null, recording text not null,
    wall_s real, cost_usd real, tokens integer, card text not null
);
create table calls (
    match text not null, episode integer not null, side text not null,
    agent text not null, action text not null, became text not null, count integer not null
);
create index calls_of_match on calls(match);
"""
_TYPES = {"str": "text", "int": "integer", "float": "real", "bool": "integer"}


@dataclass(frozen=True, slots=True)
class Played:
    """What became of one match."""

    key: str
    cell: dict[str, str]
    seed: int
    repetition: int
    state: State
    cause: str
    """Why it is not `done`: `budget`, `crash`, `timeout`, `interrupted`, or the host's own words."""
    attempts: int
    recording: str
    """Relative to the directory of the experiment; empty if there is none."""
    wall_s: float | None
    cost_usd: float | None
    tokens: int | None
    card: dict[str, Any]
    """What of its run card must be the same in runs that are compared."""


class Store:
    """The directory of one experiment."""

    def __init__(self, directory: Path) -> None:
        """Open the directory, which need not be there yet."""
        self.directory = directory

    @classmethod
    def opened(cls, directory: Path) -> Store:
        """Return the store of an experiment that has begun.

        Raises:
            ConfigError: there is none.
        """
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
        self.directory.mkdir(parents=True, exist_ok=True)
        if file.resolve() != (self.directory / FILE).resolve():
            shutil.copyfile(file, self.directory / FILE)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other runners out.

        Raises:
            ConfigError: another one is at work here.
        """
        with (self.directory / LOCK).open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise ConfigError(f"another process plays the experiment in {self.directory}: wait for it") from None
            yield

    def recording_for(self, key: str) -> Path:
        """Return an unused path for the recording of a match."""
        return free_recording(self.directory / MATCHES / key)

    # --- the index ----------------------------------------------------------------------------------

    @cached_property
    def _index(self) -> sqlite3.Connection:
        path = self.directory / INDEX
        new = not path.exists()
        index = sqlite3.connect(path, timeout=30, check_same_thread=False)  # whichever thread drops the store closes it
        weakref.finalize(self, index.close)
        index.row_factory = sqlite3.Row
        if new:
            self._create(index)
        elif index.execute("pragma user_version").fetchone()[0] != VERSION or not _has_columns(index):
            index.close()
            raise ConfigError(f"{path} is of another version of Khala: `khala experiment index {self.directory}`")
        return index

    def _create(self, index: sqlite3.Connection) -> None:
        columns = ", ".join(f'"{name}" {kind}' for name, kind in result_columns().items())
        index.executescript(f"{SCHEMA} create table results (match text not null, {columns}); create index of_match on "
                            f"results(match); pragma user_version = {VERSION};")  # fmt: skip
        index.commit()

    def add(self, played: Played, rows: Sequence[Row]) -> None:
        """Note what became of a match; it replaces what was known of it."""
        values = [getattr(played, name) for name in Played.__slots__]
        plain = [json.dumps(value) if isinstance(value, dict) else value for value in values]
        names = list(result_columns())
        with self._index as index:
            for table in ("results", "calls"):
                index.execute(f"delete from {table} where match = ?", (played.key,))  # noqa: S608
            index.execute(f"insert or replace into matches values {_places(plain)}", plain)  # noqa: S608  # question marks
            for row, calls in rows:
                place = played.key, row.episode, row.side
                counts = [(*place, *astuple(call)) for call in calls]
                index.executemany("insert into calls values (?, ?, ?, ?, ?, ?, ?)", counts)
                values = [played.key, *(getattr(row, name) for name in names)]
                index.execute(f"insert into results values {_places(values)}", values)  # noqa: S608

    def played(self) -> dict[str, Played]:
        """Return what is known of each match, by its key."""
        if not (self.directory / INDEX).exists():
            return {}
        found = self._index.execute("select * from matches order by rowid")
        return {row["key"]: _played(row) for row in found}

    def results(self) -> list[dict[str, Any]]:
        """Return a row for each episode and side: its measures, and what is known of its match."""
        matches = self.played()
        rows = [dict(row) for row in self._index.execute("select * from results order by rowid")]
        return [_joined(matches[row.pop("match")], row) for row in rows]

    def calls(self) -> list[dict[str, Any]]:
        """Return what became of calls, by match, episode, side, agent and action."""
        return [dict(row) for row in self._index.execute("select * from calls order by rowid")]

    def rebuild(self) -> int:
        """Make the index anew of the recordings, and return the number of matches."""
        if "_index" in self.__dict__:
            self._index.close()
            del self.__dict__["_index"]
        (self.directory / INDEX).unlink(missing_ok=True)
        for directory in sorted((self.directory / MATCHES).glob("*")):
            if tries := _tries(directory):
                self.take(tries[-1], attempts=len(tries))
        return len(self.played())

    def take(self, path: Path, *, attempts: int) -> None:
        """Read a recording into the index; one without a run card says nothing."""
        if (found := self.read(path, attempts=attempts)) is not None:
            self.add(*found)

    def read(self, path: Path, *, attempts: int, crash: str = "") -> tuple[Played, list[Row]] | None:
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
        rows = measure_with_calls(recording)
        played = _judged(card, [row for row, _ in rows], str(path.relative_to(self.directory)), attempts, crash)
        is_priced = any(row.paid_usd is not None for row, _ in rows)
        cost_usd = sum(_paid_usd(one) for one in path.parent.glob("recording*.mcap"))
        return replace(played, cost_usd=cost_usd if cost_usd or is_priced else None), rows

    def booked_usd(self) -> dict[str, float]:
        """Return by match the most that its tries have cost as far as they have ledgers, also if they were not read."""
        sums = defaultdict[str, float](float)
        for path in (self.directory / MATCHES).glob(f"*/recording*{SUFFIX}"):
            with Ledger(path) as ledger:
                sums[path.parent.name] += ledger.booked_usd()
        return sums

    def adopt(self) -> None:
        """Take in recordings of a runner that was killed: what its matches have cost counts."""
        known = self.played()
        for directory in (self.directory / MATCHES).glob("*"):
            tries = _tries(directory)
            if tries and (directory.name not in known or known[directory.name].attempts < len(tries)):
                self.take(tries[-1], attempts=len(tries))


def unread(match: PlannedMatch, attempts: int, cause: str, cost_usd: float | None) -> Played:
    """Return what became of a match of which there is no recording that can be read."""
    return Played(
        key=match.key, cell=match.cell, seed=match.seed, repetition=match.repetition, state="crashed", cause=cause,
        attempts=attempts, recording="", wall_s=None, cost_usd=cost_usd, tokens=None, card={},
    )  # fmt: skip


def result_columns() -> dict[str, str]:
    """Return the columns of `results` after the first one, with their types."""
    kinds = {name: str(kind).split(" | ")[0] for name, kind in _annotations().items()}
    return {name: _TYPES[kind] for name, kind in kinds.items()}


def _annotations() -> dict[str, Any]:
    return {name: field.type for name, field in Measures.__dataclass_fields__.items()}


def _places(values: list[Any]) -> str:
    return f"({', '.join('?' * len(values))})"


def _has_columns(index: sqlite3.Connection) -> bool:
    there = [row[1] for row in index.execute("pragma table_info(results)")]
    return there == ["match", *result_columns()]


def _tries(directory: Path) -> list[Path]:
    """Return the recordings of a match, the newest last."""
    return sorted(directory.glob("recording*.mcap"), key=lambda path: path.stat().st_mtime)


def _paid_usd(path: Path) -> float:
    """Return what a try has cost of which there may be half a recording."""
    try:
        return paid_usd(path)
    except RecordingError:
        return 0.0


def _judged(card: Run, rows: list[Measures], recording: str, attempts: int, crash: str) -> Played:
    state, cause = _state(rows, crash)
    labels = card.labels
    return Played(
        key=labels.get("match", card.run),
        cell={name.removeprefix(FACTOR): value for name, value in labels.items() if name.startswith(FACTOR)},
        seed=card.seed,
        repetition=int(labels.get("repetition", "0")),
        state=state,
        cause=cause,
        attempts=attempts,
        recording=recording,
        wall_s=max((row.wall_s or 0.0 for row in rows), default=None),
        cost_usd=None,
        tokens=sum(row.prompt_tokens + row.completion_tokens for row in rows) if rows else None,
        card=comparable(card),
    )


def _state(rows: list[Measures], crash: str) -> tuple[State, str]:
    if crash or not rows or any(row.outcome == "unfinished" for row in rows):
        return "crashed", crash or "interrupted"
    if any("budget: " in row.undecided_because for row in rows):
        return "invalid", "budget"
    return "invalid" if (why := next((row.invalid_because for row in rows if not row.valid), "")) else "done", why


_OTHERWISE = frozenset({"clock", "executor", "opponent", "map", "scenes"})
"""Fields of a task that are compared by themselves, or that no agent notices."""


def comparable(card: Run) -> dict[str, Any]:
    """Return what of a run card must be the same in runs that are compared, by the names that `--allow` takes."""
    task = dict(card.config)
    return {
        "map": f"{card.map_name} {card.map_sha256}",
        "game": card.game,
        "opponent": card.opponent,
        "executor": card.executor,
        "clock": card.clock.model_dump(mode="json"),
        "actions": card.catalogue_sha256,
        "code": card.code_sha256,
        "versions": card.versions,
        "hardware": card.hardware,
        "task": {name: value for name, value in task.items() if name not in _OTHERWISE},
    }


def _played(row: sqlite3.Row) -> Played:
    values = {name: row[name] for name in Played.__slots__}
    return Played(**values | {"cell": json.loads(values["cell"]), "card": json.loads(values["card"])})


def _joined(match: Played, row: dict[str, Any]) -> dict[str, Any]:
    cell = {f"{FACTOR}{name}": value for name, value in match.cell.items()}
    about = {"match": match.key, "state": match.state, "cause_of_state": match.cause, "repetition": match.repetition}
    return {**about, **cell, **row}
