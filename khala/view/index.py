"""The index of a recording: where each sample lies, and what the time line is drawn from, in SQLite beside the file.

`khala.view.scan` writes it while it reads the recording; answers read it and then only the chunks that they need. It
holds nothing that the recording does not: an index that is broken, or of another file, is made again. Two viewers of
one recording share it: one of them writes, the other waits until that one stops.

A recording in a directory that cannot be written has its index in the user's cache directory.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import sqlite3
import threading
import weakref
import zlib
from collections import OrderedDict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from khala import games
from khala_protocol.errors import RecordingError
from khala_protocol.files import MB
from khala_protocol.recording.chunks import chunk_at, payload_at
from khala_protocol.recording.unpack import BROKEN

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
BUSY_S = 30.0


class Spot(NamedTuple):
    """Where a sample lies."""

    chunk: int
    place: int


class Found(NamedTuple):
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
            remove(self.path)

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

    def newest(self, topic: Topic, episode: int, side: str, agent: str, step: int) -> Found | None:
        """Return the sample of an agent's topic at a step, or else the last one before it."""
        found = self.rows(
            "select step, chunk, place, log_time_ns, side, agent from sample where topic = ? and episode = ? and "
            "side = ? and agent = ? and step <= ? order by step desc, rowid desc limit 1",
            topic, episode, side, agent, step,
        )  # fmt: skip
        return Found(*found[0]) if found else None

    def first(self, topic: Topic, episode: int, side: str, agent: str, step: int) -> Found | None:
        """Return the first sample of an agent's topic at exactly this step."""
        found = self.rows(
            "select step, chunk, place, log_time_ns, side, agent from sample where topic = ? and episode = ? and "
            "side = ? and agent = ? and step = ? order by rowid limit 1", topic, episode, side, agent, step,
        )  # fmt: skip
        return Found(*found[0]) if found else None

    def at(self, topic: Topic, episode: int, first: int, last: int) -> Iterator[Found]:
        """Yield the samples of a topic from step to step, both included, in the order of steps and of the file."""
        for row in self.rows(
            "select step, chunk, place, log_time_ns, side, agent from sample where topic = ? and episode = ? "
            "and step between ? and ? order by step, rowid", topic, episode, first, last,
        ):  # fmt: skip
            yield Found(*row)

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
    """Return where the index of a recording is: beside it, or in the user's cache directory."""
    if os.access(recording.parent, os.W_OK):
        return recording.with_name(f".{recording.name}.index")
    return cache_directory() / f"{hashlib.sha256(os.fsencode(recording.resolve())).hexdigest()[:32]}.index"


def cache_directory() -> Path:
    """Return the directory for what can be made again, and make it."""
    path = games.cache() / "view"
    path.mkdir(parents=True, exist_ok=True)
    return path


def connect(path: Path, schema: str = SCHEMA) -> sqlite3.Connection:
    """Return a connection to an index; what a file of somebody else may hold does not run.

    Raises:
        sqlite3.DatabaseError: it is broken, or has other tables.
    """
    db = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None, check_same_thread=False)
    try:
        db.executescript("pragma trusted_schema = off; pragma cell_size_check = on; pragma synchronous = off;")
        tables = _tables(db)
    except BaseException:
        db.close()
        raise
    if tables != [line.strip() for line in schema.split(";") if line.strip()]:
        db.close()
        raise sqlite3.DatabaseError("it has other tables")
    return db


def prepare(path: Path, schema: str = SCHEMA, version: int = VERSION) -> None:
    """Make an empty index, unless there is a good one."""
    with contextlib.suppress(sqlite3.DatabaseError):
        if path.is_file() and not path.is_symlink():  # who made the recording may have put anything there
            with contextlib.closing(connect(path, schema)) as db:
                if db.execute("pragma user_version").fetchone()[0] == version:
                    return
    remove(path)
    descriptor = os.open(path, os.O_CREAT | os.O_RDWR, 0o600)  # prompts and replies are for its user alone
    os.close(descriptor)
    with contextlib.closing(sqlite3.connect(path, timeout=BUSY_S)) as db:
        script = f"begin immediate; {schema}; pragma user_version = {version}; commit; pragma journal_mode = wal;"
        with contextlib.suppress(sqlite3.OperationalError):  # another viewer was quicker
            db.executescript(script)


def remove(path: Path) -> None:
    """Remove an index, and what SQLite keeps beside it."""
    for name in (path, path.with_name(f"{path.name}-wal"), path.with_name(f"{path.name}-shm")):
        name.unlink(missing_ok=True)


def _tables(db: sqlite3.Connection) -> list[str]:
    found = db.execute("select sql from sqlite_master where sql is not null order by rowid")
    return [re.sub("^CREATE (TABLE|INDEX)", lambda match: match[0].lower(), sql).strip() for (sql,) in found]
