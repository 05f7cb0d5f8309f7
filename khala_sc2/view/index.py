"""The index of a recording: where each sample lies, and what the time line is drawn from, in SQLite.

`khala_sc2.view.scan` writes it while it reads the recording; answers read it and then only the chunks that they need. It
holds nothing that the recording does not: an index that is broken, or of another file, is made again. Two viewers of
one recording share it: one of them writes, the other waits until that one stops.

It is in the user's cache directory, under the hash of the recording's path, and never beside the recording: whoever
made a recording could put an index there that says something else, and no check of the two could tell.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sqlite3
import threading
import time
import weakref
import zlib
from collections import OrderedDict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from khala_protocol.errors import RecordingError
from khala_protocol.files import MB, make_private
from khala_protocol.recording.chunks import chunk_at, payload_at
from khala_protocol.recording.unpack import BROKEN
from khala_sc2 import indexes
from khala_sc2.playing import games

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_protocol.keys import Topic

VERSION = zlib.crc32(b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in ("digest", "scan"))) >> 1
"""Of what is in the tables: of the code that makes it. An index of another version is made again."""
SCHEMA = """\
create table meta(name text primary key, value text not null) without rowid;
create table sample(
    topic text not null, episode integer not null, side text not null, agent text not null, step integer not null,
    chunk integer not null, place integer not null, log_time_ns integer not null
);
create index sample_of_agent on sample(topic, episode, side, agent, step);
create index sample_of_step on sample(topic, episode, step);
create table image(sha256 text primary key, chunk integer not null, place integer not null) without rowid;
create table step(
    episode integer not null, step integer not null, data text not null, primary key (episode, step)
) without rowid;
create table decision(
    episode integer not null, side text not null, agent text not null, step integer not null,
    effect_step integer not null, primary key (episode, side, agent, step)
) without rowid;
create table loss(
    episode integer not null, step integer not null, side text not null, type text not null, value real not null,
    x real, y real
);
create table mark(
    episode integer not null, step integer not null, kind text not null, side text not null, agent text not null,
    text text not null
);
create table model(side text not null, agent text not null, name text not null, primary key (side, agent)) without rowid
"""
MOST_CACHED_BYTES = 64 * MB
"""Unpacked chunks that are kept: a hundred steps of a large match."""
KEPT_S = 30 * 86_400.0
"""An index that nobody has looked at for this long is removed when another is made."""


class Spot(NamedTuple):
    """Where a sample lies."""

    chunk: int
    place: int


class FoundSample(NamedTuple):
    """A sample that the index knows."""

    step: int
    chunk: int
    place: int
    log_time_ns: int
    side: str
    agent: str

    @property
    def spot(self) -> Spot:
        """Where it lies."""
        return Spot(self.chunk, self.place)


class Index:
    """The index of one recording, for readers in several threads."""

    def __init__(self, recording: Path) -> None:
        """Open the index of a recording, which may not be there yet."""
        self.recording = recording
        self.path = index_path(recording)
        self._chunks: OrderedDict[int, bytes] = OrderedDict()
        self._size = 0
        self._lock = threading.Lock()
        self.is_broken = False
        """Whether it must be removed, so that it is made again."""
        prepare(self.path)
        self._db = connect(self.path)
        weakref.finalize(self, self._db.close)

    def close(self) -> None:
        """Close it, and remove it if it is broken; who still asks gets an error."""
        with self._lock:
            self._db.close()
        if self.is_broken:
            indexes.remove(self.path)

    def rows(self, query: str, *values: object) -> list[tuple[Any, ...]]:
        """Return the rows of a query.

        Raises:
            RecordingError: the index was closed, or is broken.
        """
        try:
            with self._lock:  # a connection that is closed while another thread uses it takes the process with it
                return self._db.execute(query, values).fetchall()
        except sqlite3.ProgrammingError:
            raise RecordingError("the recording was closed meanwhile: ask again") from None
        except sqlite3.Error as error:
            self.is_broken = True
            raise RecordingError(f"the index {self.path} is broken, and is made again: {error}") from error

    def meta(self, name: str, default: Any = None) -> Any:
        """Return a noted value."""
        found = self.rows("select value from meta where name = ?", name)
        return json.loads(found[0][0]) if found else default

    def newest(self, topic: Topic, episode: int, side: str, agent: str, step: int) -> FoundSample | None:
        """Return the sample of an agent's topic at a step, or else the last one before it."""
        found = self.rows(
            "select step, chunk, place, log_time_ns, side, agent from sample where topic = ? and episode = ? and "
            "side = ? and agent = ? and step <= ? order by step desc, rowid desc limit 1",
            topic, episode, side, agent, step,
        )  # fmt: skip
        return FoundSample(*found[0]) if found else None

    def at(self, topic: Topic, episode: int, first: int, last: int) -> Iterator[FoundSample]:
        """Yield the samples of a topic from step to step, both included, in the order of steps and of the file."""
        for row in self.rows(
            "select step, chunk, place, log_time_ns, side, agent from sample where topic = ? and episode = ? "
            "and step between ? and ? order by step, rowid", topic, episode, first, last,
        ):  # fmt: skip
            yield FoundSample(*row)

    def payload(self, spot: Spot) -> bytes:
        """Return the bytes of a sample.

        Raises:
            RecordingError: the recording has changed, or cannot be read.
        """
        try:
            return payload_at(self._chunk(spot.chunk), spot.place)
        except BROKEN as error:
            raise RecordingError(f"{self.recording} has changed while it was shown: open it again") from error
        except OSError as error:
            raise RecordingError(f"{self.recording} cannot be read: {error.strerror}") from error

    def _chunk(self, offset: int) -> bytes:
        with self._lock:
            if (data := self._chunks.get(offset)) is not None:
                self._chunks.move_to_end(offset)
                return data
        with self.recording.open("rb") as file:
            data = chunk_at(file, offset)
        with self._lock:
            self._size += len(data) - len(self._chunks.get(offset, b""))
            self._chunks[offset] = data
            while self._size > MOST_CACHED_BYTES and len(self._chunks) > 1:
                self._size -= len(self._chunks.popitem(last=False)[1])
        return data


def index_path(recording: Path) -> Path:
    """Return where the index of a recording is."""
    return cache_directory() / f"{hashlib.sha256(os.fsencode(recording.resolve())).hexdigest()[:32]}.index"


def cache_directory() -> Path:
    """Return the directory for what can be made again, and make it."""
    path = games.cache() / "view"
    make_private(path)
    return path


def prepare(path: Path, schema: str = SCHEMA, version: int = VERSION) -> None:
    """Make an empty index, unless there is a good one; those that nobody has looked at for long make room for it."""
    try:
        with contextlib.suppress(sqlite3.DatabaseError), indexes.faults(path):
            indexes.connect(path, schema, version).close()
            os.utime(path)
            return
        indexes.remove(path)
        _forget_old(path.parent)
        indexes.create(path, schema, version, journal="wal")
    except OSError as error:
        raise RecordingError(
            f"the index {path} cannot be written: {error.strerror}; KHALA_CACHE names another place"
        ) from None


def _forget_old(directory: Path) -> None:
    for path in directory.glob("*.index"):
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > KEPT_S:
                indexes.remove(path)


def connect(path: Path, schema: str = SCHEMA) -> sqlite3.Connection:
    """Return a connection to an index; one that is lost with the power is made again.

    Raises:
        sqlite3.DatabaseError: it is broken, or has other tables.
    """
    db = indexes.connect(path, schema)
    db.execute("pragma synchronous = off")
    return db
