"""The recordings and experiments of a directory, without a look into more of each than its begin and its end.

What was found of a recording stays in an index in the user's cache directory, by its path, its size and the time at
which the system last changed it, so that thousands of them are listed at once.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sqlite3
import time
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from khala_protocol.codec import decode_as
from khala_protocol.errors import ConfigError, KhalaError
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Result, Run, Wire
from khala_protocol.recording.summary import Summary
from khala_sc2.view.index import cache_directory, connect, prepare
from khala_sc2.view.wire import RunLine

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

W = TypeVar("W", bound=Wire)

SUFFIX = ".mcap"
EXPERIMENT = "experiment.yaml"
"""The file of an experiment, `khala_sc2.experiment.store.FILE`."""
LIVE_S = 60.0
"""A recording without an end is live if it changed within this time, or twice the longest wait for its agents."""
MOST_FILES = 20_000
DEEPEST = 8
"""Directories below the one that was opened."""
VERSION = 2
SCHEMA = "create table line(path text primary key, size integer not null, changed_ns integer not null, line text not null) without rowid"  # noqa: E501  # as SQLite keeps it
PLAYERS = ("factor.model", "factor.player", "factor.policy")
"""Labels of an experiment that say who decided, if no model was asked."""


@dataclass(frozen=True)
class Head:
    """What the begin and the end of a recording say."""

    card: Run | None
    results: tuple[Result, ...]
    complete: bool
    live: bool
    size: int
    recorded_at_s: float
    steps: int


def run_id(path: Path) -> str:
    """Return the name of a recording in paths: the same as long as it stays where it is."""
    return hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:16]


def read_head(path: Path) -> Head:
    """Return what the begin and the end of a recording say; it is read again only if it has changed.

    Raises:
        RecordingError: it cannot be read.
    """
    with contextlib.suppress(OSError):
        state = path.stat()
        head = _read_head(path, state.st_size, state.st_mtime_ns)
        return head if head.complete else _with_life(head, state.st_mtime)
    return _read_head(path, 0, 0)


def _with_life(head: Head, changed_s: float) -> Head:
    wait_s = head.card.clock.max_wait_s or 0.0 if head.card else 0.0
    live = time.time() - changed_s < max(LIVE_S, 2 * wait_s)
    return Head(head.card, head.results, head.complete, live, head.size, head.recorded_at_s, head.steps)


@lru_cache(maxsize=256)
def _read_head(path: Path, size: int, changed_ns: int) -> Head:  # noqa: ARG001  # a changed file is another one
    summary = Summary.of(path)
    run = next((key.split("/")[1] for key in summary.keys.values() if key.endswith(f"/{Topic.RUN}")), None)
    card = next(_decode(Run, summary, run_key(run, Topic.RUN)), None) if run else None
    results = tuple(_decode(Result, summary, run_key(run, Topic.RESULT))) if run and summary.complete else ()
    reports = summary.counts.get(run_key(run, Topic.REPORT), 0) if run else 0
    sides = len({agent.side for agent in card.agents}) if card else 1
    began_s = summary.begun_ns / 1e9 or changed_ns / 1e9
    return Head(card, results, summary.complete, False, summary.size, began_s, reports // max(1, sides))


def _decode(kind: type[W], summary: Summary, key: str) -> Iterator[W]:
    with contextlib.suppress(KhalaError):
        for payload in summary.payloads(key):
            yield decode_as(kind, payload)


def line_of(head: Head, id: str, name: str) -> RunLine:  # noqa: A002  # as in the paths
    """Return a recording as a list shows it."""
    card, results = head.card, head.results
    labels = card.labels if card else {}
    models = tuple(dict.fromkeys(labels[name] for name in PLAYERS if name in labels))
    costs = [usage.cost_usd for result in results for usage in result.usage.values() if usage.cost_usd is not None]
    outcomes: dict[str, list[str]] = {}
    for result in sorted(results, key=lambda result: result.episode):
        outcomes.setdefault(result.side, []).append(result.outcome)
    seconds = {result.episode: result.game_s for result in results}
    return RunLine(
        id=id,
        path=name,
        run=card.run if card else "",
        task=card.task if card else "",
        map=card.map_name if card else "",
        seed=card.seed if card else 0,
        opponent=card.opponent if card else "",
        clock=card.clock.rule if card else "",
        models=models,
        recorded_at_s=head.recorded_at_s,
        outcomes=outcomes,
        valid=all(result.valid for result in results),
        complete=head.complete,
        live=head.live,
        episodes=max(len(seconds), 1),
        steps=head.steps,
        game_s=sum(seconds.values()),
        cost_usd=sum(costs) if costs else None,
        size_bytes=head.size,
        labels=labels,
    )


class FoundRecordings(NamedTuple):
    """What a directory holds."""

    recordings: list[Path]
    """The newest first."""
    experiments: list[Path]
    """Directories of experiments."""


def found_in(directory: Path) -> FoundRecordings:
    """Return the recordings and experiments of a directory and of those below it.

    Raises:
        ConfigError: it cannot be read.
    """
    found = FoundRecordings([], [])
    try:
        times = sorted(islice(_walk(directory, 0, found.experiments), MOST_FILES), reverse=True)
    except OSError as error:
        raise ConfigError(f"{directory} cannot be read: {error.strerror}") from None
    found.recordings.extend(path for _, path in times)
    return found


def _walk(directory: Path, depth: int, experiments: list[Path]) -> Iterator[tuple[int, Path]]:
    with os.scandir(directory) as entries:
        for entry in entries:
            with contextlib.suppress(OSError):
                if entry.is_dir(follow_symlinks=False):
                    if depth < DEEPEST and not entry.name.startswith("."):
                        yield from _walk(Path(entry.path), depth + 1, experiments)
                elif entry.name == EXPERIMENT:
                    experiments.append(directory)
                elif entry.name.endswith(SUFFIX) and entry.is_file():
                    yield entry.stat().st_mtime_ns, Path(entry.path)


def lines(paths: Sequence[Path], below: Path) -> list[RunLine]:
    """Return the lines of recordings, with what the cache knows of them; those that cannot be read have none."""
    with contextlib.closing(cache()) as db:
        known = {path: (size, changed, line) for path, size, changed, line in db.execute("select * from line")}
        new: list[tuple[str, int, int, str]] = []
        found = [line for path in paths if (line := _line(path, below, known, new)) is not None]
        with contextlib.suppress(sqlite3.Error):
            db.execute("begin immediate")
            db.executemany("insert or replace into line values (?, ?, ?, ?)", new)
            db.execute("commit")
        return found


def _line(
    path: Path, below: Path, known: dict[str, tuple[int, int, str]], new: list[tuple[str, int, int, str]]
) -> RunLine | None:
    try:
        state = path.stat()
        key = str(path.absolute())
        name = shown(path, below)
        size, changed, line = known.get(key, (-1, -1, ""))
        if (size, changed) == (state.st_size, state.st_ctime_ns):  # no program can set this one
            return RunLine.model_validate_json(line).but(path=name)
        made = line_of(read_head(path), run_id(path), name)
    except (KhalaError, OSError, ValueError):
        return None
    if made.complete:
        new.append((key, state.st_size, state.st_ctime_ns, made.model_dump_json()))
    return made


def shown(path: Path, below: Path | None) -> str:
    """Return the path of a recording as it is shown: below the directory that was opened."""
    with contextlib.suppress(ValueError):
        return str(path.relative_to(below or path.parent))
    return path.name


def cache() -> sqlite3.Connection:
    """Return a connection to what is known of recordings and experiments."""
    path = cache_directory() / "library.index"
    prepare(path, SCHEMA, VERSION)
    return connect(path, SCHEMA)
