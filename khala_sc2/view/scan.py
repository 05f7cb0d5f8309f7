"""Read a recording once, from chunk to chunk, and write its index: in a thread of its own, and further as it grows.

Each step of the work is a transaction that also notes how far it came, so that another viewer, or this one tomorrow,
goes on there. Who writes has a lease in the index; the lease of a viewer that was killed runs out.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
import re
import secrets
import sqlite3
import threading
import time
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, BinaryIO

from pydantic_core import from_json

from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic, parse
from khala_protocol.messages import MOST
from khala_protocol.recording.chunks import Scan
from khala_protocol.recording.reader import MAX_MESSAGE_BYTES
from khala_protocol.recording.speaker import fits
from khala_sc2.view.digest import Digest, Memory
from khala_sc2.view.index import SCHEMA, connect

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.keys import Address
    from khala_protocol.recording.chunks import Placed, PlacedChunk
    from khala_sc2.view.index import Index

log = logging.getLogger(__name__)

POLL_S = 0.1
"""Between two looks at a file that grows."""
BATCH_S = 0.25
"""Work between two transactions; the first one is shorter, so that the first answers come at once."""
FIRST_BATCH_S = 0.05
LEASE_S = 5.0
BUSY_S = 0.5
"""Between two tries to get the lease that another viewer has."""
_HEAD = re.compile(
    rb'\{"v":1,"run":"([\w.-]+)","kind":"\w+",(?:"agent":"([\w.-]+)",)?(?:"side":"([\w.-]+)",)?'
    rb'"episode":(\d{1,15}),"step":(\d{1,15}),'
)
"""The beginning of a message of a step, as `khala_protocol.codec` writes it: most need not be read further."""
_PLAIN = frozenset({Topic.REPLY, Topic.SCENE, Topic.OBSERVATION, Topic.EXCHANGE, Topic.MESSAGE, Topic.REPORT})
"""Topics whose messages belong to a step."""
_KEPT = _PLAIN | {Topic.RUN, Topic.RESULT, Topic.BRIEFING, Topic.TERRAIN}
WRONG = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError)
"""Errors of reading data that is not as our messages are."""


@dataclass(slots=True)
class _Batch:
    """Rows of one transaction."""

    digest: Digest
    samples: list[tuple[Any, ...]] = field(default_factory=list)
    images: list[tuple[Any, ...]] = field(default_factory=list)
    models: dict[tuple[str, str], str] = field(default_factory=dict)


class Scanner:
    """The writer of an index.

    Args:
        index: to be written.
        stopped: is asked between chunks.
    """

    def __init__(self, index: Index, stopped: Callable[[], bool] = lambda: False) -> None:
        self._index, self._stopped = index, stopped
        self._name = secrets.token_hex(8)
        self._scan: Scan | None = None
        self._seen = -1
        """Size of the file that holds nothing new; -1 if it may."""
        self._renew_s = 0.0
        """When the lease must be renewed."""
        self._memory = Memory()
        self._sides: tuple[str, ...] = ()
        self._db = connect(index.path, SCHEMA)

    def close(self) -> None:
        """Give the lease up."""
        with contextlib.suppress(sqlite3.Error):
            self._db.execute("delete from meta where name = 'writer' and value like ?", (f'%"{self._name}"%',))
        self._db.close()

    def advance(self, within_s: float = BATCH_S) -> bool | None:
        """Index what follows; return whether there was anything, or None while another viewer does it."""
        with self._index.recording.open("rb") as file:
            size = file.seek(0, 2)
            if self._scan is not None and size == self._seen and time.time() < self._renew_s:
                return False
            self._db.execute("begin immediate")
            try:
                if not self._claim():
                    self._db.execute("rollback")
                    return None
                scan = self._scan or self._resume(file)
                before = scan.offset
                batch = self._read(scan, file, within_s)
                self._write(batch, scan, file)
                if scan.offset == before:
                    self._note("caught_up", size)
                self._db.execute("commit")
            except BaseException:
                self._scan = None  # what is in the index counts
                with contextlib.suppress(sqlite3.Error):
                    self._db.execute("rollback")
                raise
        self._scan = scan
        self._seen = size if scan.offset == before else -1
        return scan.offset > before

    @property
    def done(self) -> bool:
        """Whether nothing can follow."""
        return self._scan is not None and (self._scan.ended or self._scan.broken)

    def _claim(self) -> bool:
        """Take or renew the lease; return False if another viewer has it."""
        found = self._db.execute("select value from meta where name = 'writer'").fetchone()
        owner, until_s = json.loads(found[0]) if found else ("", 0.0)
        if owner != self._name:
            if until_s > time.time():
                return False
            self._scan = None
        self._take_lease()
        return True

    def _take_lease(self) -> None:
        now_s = time.time()
        self._renew_s = now_s + LEASE_S / 2
        self._note("writer", [self._name, now_s + LEASE_S])

    def _resume(self, file: BinaryIO) -> Scan:
        """Return the scan where the index ends, if this is the file as it was then; otherwise at its beginning."""
        with contextlib.suppress(*WRONG):  # of another version, or of somebody else
            state = {name: json.loads(value) for name, value in self._db.execute("select name, value from meta")}
            if state["fingerprint"] == fingerprint(file, state["offset"]) and not _has_changed(file, state["file"]):
                keys = {int(number): key for number, key in state["keys"].items()}
                scan = Scan(state["offset"], keys=keys, expected=state["expected"])
                scan.ended, scan.broken = state["ended"], state["broken"]
                self._memory = Memory.load(state["memory"])
                self._sides = tuple(state["sides"])
                self._note("caught_up", 0)
                return scan
        for table in ("sample", "image", "step", "decision", "loss", "mark", "model", "meta"):
            self._db.execute(f"delete from {table} where true")  # noqa: S608  # our own names
        self._memory = Memory()
        self._sides = ()
        self._take_lease()
        return Scan()

    # --- reading ------------------------------------------------------------------------------------

    def _read(self, scan: Scan, file: BinaryIO, within_s: float) -> _Batch:
        until_s = time.monotonic() + within_s
        batch = _Batch(Digest(self._memory, self._sides))
        for chunk in scan.chunks(file):
            for sample in scan.samples(chunk):
                if (address := _address(scan.keys.get(sample.channel, ""))) is not None:
                    self._take(batch, chunk, sample, address)
            if scan.broken or time.monotonic() > until_s or self._stopped():
                if not scan.broken:
                    scan.offset = chunk.end
                break
        return batch

    def _take(self, batch: _Batch, chunk: PlacedChunk, sample: Placed, address: Address) -> None:
        if address.topic is Topic.IMAGE:
            batch.images.append((hashlib.sha256(sample.payload).hexdigest(), chunk.offset, sample.place))
        elif address.topic in _KEPT and len(sample.payload) <= MAX_MESSAGE_BYTES:
            with contextlib.suppress(*WRONG):
                episode, step = self._digest(batch, sample.payload, address)
                side, agent = address.side or "", address.agent or ""
                where = (chunk.offset, sample.place, sample.log_time_ns)
                batch.samples.append((str(address.topic), episode, side, agent, step, *where))

    def _digest(self, batch: _Batch, payload: bytes, address: Address) -> tuple[int, int]:
        """Take in a message, and return its episode and step.

        Raises:
            WRONG: it is not as our messages are.
        """
        head = _HEAD.match(payload) if address.topic in _PLAIN else None
        if head and not self._is_read(batch, address):
            _check_speaker(address, *(name and name.decode() for name in head.group(1, 3, 2)))
            return int(head[4]), int(head[5])
        said = from_json(payload, allow_inf_nan=False, cache_strings="none")
        _check_speaker(address, *map(said.get, ("run", "side", "agent")))
        place = _count(said.get("episode", 0)), _count(said.get("step", 0))
        match address.topic:
            case Topic.RUN:
                self._sides = batch.digest.sides = tuple(dict.fromkeys(agent["side"] for agent in said["agents"]))
            case Topic.EXCHANGE:
                name = said.get("answered_by") or said["model"]
                batch.models[address.side or "", address.agent or ""] = str(name)[:100]
            case Topic.OBSERVATION | Topic.SCENE | Topic.REPORT | Topic.MESSAGE | Topic.RESULT:
                getattr(batch.digest, address.topic.value)(said)
        return place

    def _is_read(self, batch: _Batch, address: Address) -> bool:
        """Return whether more is wanted of a message than its step."""
        if address.topic is Topic.EXCHANGE:
            return (address.side or "", address.agent or "") not in batch.models
        return address.topic is not Topic.REPLY

    # --- writing ------------------------------------------------------------------------------------

    def _write(self, batch: _Batch, scan: Scan, file: BinaryIO) -> None:
        db, digest = self._db, batch.digest
        db.executemany("insert into sample values (?, ?, ?, ?, ?, ?, ?, ?)", batch.samples)
        db.executemany("insert or ignore into image values (?, ?, ?)", batch.images)
        db.executemany("insert or ignore into decision values (?, ?, ?, ?, ?)", digest.decisions)
        db.executemany("insert into loss values (?, ?, ?, ?, ?, ?, ?)", digest.losses)
        db.executemany("insert into mark values (?, ?, ?, ?, ?, ?)", digest.marks)
        db.executemany(
            "insert or replace into model values (?, ?, ?)", [(*who, name) for who, name in batch.models.items()]
        )
        for (episode, step), row in digest.steps.items():
            known = db.execute("select data from step where episode = ? and step = ?", (episode, step)).fetchone()
            whole = (json.loads(known[0]) if known else {}) | row
            db.execute("insert or replace into step values (?, ?, ?)", (episode, step, json.dumps(whole)))
        newest = max((sample[-1] for sample in batch.samples if sample[0] == Topic.REPORT), default=None)
        self._note("memory", self._memory.dump())
        self._note("sides", self._sides)
        self._note("keys", scan.keys)
        self._note("offset", scan.offset)
        self._note("expected", scan.expected)
        self._note("ended", scan.ended)
        self._note("broken", scan.broken)
        self._note("fingerprint", fingerprint(file, scan.offset))
        self._note("file", _state(file))
        if self._memory.scenes:
            self._note("scenes", "whole" if self._memory.whole else "seen")
        if newest is not None:
            self._note("lag_s", round(max(0.0, time.time() - newest / 1e9), 3))

    def _note(self, name: str, value: object) -> None:
        self._db.execute("insert or replace into meta values (?, ?)", (name, json.dumps(value)))


class Scanning:
    """A thread that keeps the index of a recording up to date.

    Args:
        index: to be written.
        changed: is called in the thread when there is more in the index.
    """

    def __init__(self, index: Index, changed: Callable[[], None] = lambda: None) -> None:
        self._index, self._changed = index, changed
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"index {index.recording.name}", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End after the chunk at hand."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        within_s = FIRST_BATCH_S
        try:
            with contextlib.closing(Scanner(self._index, self._stop.is_set)) as scanner:
                while not self._stop.is_set() and not scanner.done:
                    found = scanner.advance(within_s)
                    within_s = BATCH_S
                    if not found:
                        self._stop.wait(BUSY_S if found is None else POLL_S)
                    if found is not False:
                        self._changed()
                self._changed()
        except (OSError, sqlite3.Error) as error:
            self._index.is_broken = isinstance(error, sqlite3.DatabaseError)
            log.warning("the index %s cannot be written: %s", self._index.path, error)
            self._changed()


def _check_speaker(address: Address, run: object, side: object, agent: object) -> None:
    if not fits(address, run, side, agent):
        raise ValueError(f"{side}/{agent} of {run} is named under the key of somebody else")


def _count(value: object) -> int:
    if not isinstance(value, int) or not 0 <= value <= MOST:
        raise ValueError(f"{value} counts nothing")
    return value


def fingerprint(file: BinaryIO, offset: int) -> str:
    """Return a hash by which a file is known as the one that was read up to this offset."""
    file.seek(0)
    head = file.read(min(offset, 4096))
    file.seek(max(0, offset - 4096))
    return hashlib.sha256(head + file.read(min(offset, 4096)) + str(offset).encode()).hexdigest()


def _state(file: BinaryIO) -> list[int]:
    """Return what changes with every write to a file, and cannot be set as its time of change can."""
    state = os.fstat(file.fileno())
    return [state.st_size, state.st_ino, state.st_ctime_ns]


def _has_changed(file: BinaryIO, known: list[int]) -> bool:
    """Return whether a file was written to since it was known, but for what a recorder adds at its end."""
    now = _state(file)
    return now[0] < known[0] or (now[0] == known[0] and now != known)


@cache
def _address(key: str) -> Address | None:
    try:
        return parse(key)
    except PeerError:
        return None


def whole(index: Index) -> None:
    """Index a recording up to its end, in this thread; another viewer that does it already is waited for.

    Raises:
        OSError: it cannot be read.
    """
    with contextlib.closing(Scanner(index)) as scanner:
        while (found := scanner.advance()) is not False:
            if found is None:
                time.sleep(POLL_S)
