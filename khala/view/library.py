"""The recordings and experiments of a directory, without a look into more of each than its begin and its end.

What was found of a recording stays in an index in the user's cache directory, by its path, size and time of change, so
that thousands of them are listed at once.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sqlite3
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from khala.view.index import cache_directory, connect, prepare
from khala.view.wire import RunLine
from khala_protocol.codec import decode_as
from khala_protocol.errors import ConfigError, KhalaError
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Result, Run
from khala_protocol.recording.summary import Summary

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

SUFFIX = ".mcap"
LIVE_S = 60.0
"""A recording without an end is live if it changed within this time, or twice the longest wait for its agents."""
MOST_FILES = 20_000
DEEPEST = 8
"""Directories below the one that was opened."""
VERSION = 1
SCHEMA = "create table line(path text primary key, size integer not null, changed_ns integer not null, line text not null) without rowid"  # noqa: E501  # as SQLite keeps it
CARD_LABELS = ("factor.model", "factor.player", "factor.policy", "model")


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
    card = next(_decoded(Run, summary, run_key(run, Topic.RUN)), None) if run else None
    results = tuple(_decoded(Result, summary, run_key(run, Topic.RESULT))) if run and summary.complete else ()
    reports = summary.counts.get(run_key(run, Topic.REPORT), 0) if run else 0
    sides = len({agent.side for agent in card.agents}) if card else 1
    began_s = summary.begun_ns / 1e9 or changed_ns / 1e9
    return Head(card, results, summary.complete, False, summary.size, began_s, reports // max(1, sides))


def _decoded(kind, summary, key):  # type: ignore[no-untyped-def]
    with contextlib.suppress(KhalaError):
        for payload in summary.payloads(key):
            yield decode_as(kind, payload)


def line_of(head: Head, id: str, shown: str) -> RunLine:  # noqa: A002  # as in the paths
    """Return a recording as a list shows it."""
    card, results = head.card, head.results
    labels = card.labels if card else {}
    models = tuple(dict.fromkeys(labels[name] for name in CARD_LABELS if name in labels))
    costs = [usage.cost_usd for result in results for usage in result.usage.values() if usage.cost_usd is not None]
    outcomes: dict[str, list[str]] = {}
    for result in sorted(results, key=lambda one: one.episode):
        outcomes.setdefault(result.side, []).append(result.outcome)
    seconds = {result.episode: result.game_s for result in results}
    return RunLine(
        id=id,
        path=shown,
        run=card.run if card else "",
        task=card.task if card else "",
        map=card.map_name if card else "",
        seed=card.seed if card else 0,
        opponent=card.opponent if card else "",
        clock=card.clock.rule if card else "",
        models=models,
        recorded_at_s=head.recorded_at_s,
        outcomes=outcomes,  # type: ignore[arg-type]  # pydantic makes tuples of lists
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


def recordings(directory: Path) -> list[Path]:
    """Return the recordings of a directory and those below it, the newest first.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        found = list(_walk(directory, 0))[:MOST_FILES]
    except OSError as error:
        raise ConfigError(f"{directory} cannot be read: {error.strerror}") from None
    return [path for _, path in sorted(found, reverse=True)]


def _walk(directory: Path, depth: int) -> Iterator[tuple[int, Path]]:
    with os.scandir(directory) as entries:
        for entry in entries:
            with contextlib.suppress(OSError):
                if entry.is_dir(follow_symlinks=False):
                    if depth < DEEPEST and not entry.name.startswith("."):
                        yield from _walk(Path(entry.path), depth + 1)
                elif entry.name.endswith(SUFFIX) and entry.is_file():
                    yield entry.stat().st_mtime_ns, Path(entry.path)


def lines(paths: Sequence[Path], below: Path) -> list[RunLine]:
    """Return the lines of recordings, with what the cache knows of them; those that cannot be read have none."""
    with contextlib.closing(_cache()) as db:
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
        key, shown = str(path.absolute()), _shown(path, below)
        size, changed, line = known.get(key, (-1, -1, ""))
        if (size, changed) == (state.st_size, state.st_mtime_ns):
            return RunLine.model_validate_json(line).but(path=shown)
        made = line_of(read_head(path), run_id(path), shown)
    except (KhalaError, OSError, ValueError):
        return None
    if made.complete:
        new.append((key, state.st_size, state.st_mtime_ns, made.model_dump_json()))
    return made


def _shown(path: Path, below: Path) -> str:
    with contextlib.suppress(ValueError):
        return str(path.relative_to(below))
    return path.name


def _cache() -> sqlite3.Connection:
    path = cache_directory() / "library.index"
    prepare(path, SCHEMA, VERSION)
    return connect(path, SCHEMA)


def by_id(paths: Iterable[Path]) -> dict[str, Path]:
    """Return recordings by their names in paths."""
    return {run_id(path): path for path in paths}


def dumped(line: RunLine) -> dict[str, object]:
    """Return a line as JSON data."""
    data: dict[str, object] = json.loads(line.model_dump_json())
    return data
