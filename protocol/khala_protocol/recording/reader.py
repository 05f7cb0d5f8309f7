"""An MCAP file → messages; see `khala_protocol.recording`."""

from __future__ import annotations

import hashlib
import itertools
import os
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Self, TypeVar

from mcap.records import Channel, Footer, Header, McapRecord, Message, Metadata, Statistics
from mcap.stream_reader import MAGIC_SIZE
from mcap.writer import MCAP0_MAGIC

from khala_protocol.codec import decode
from khala_protocol.errors import PeerError, RecordingError
from khala_protocol.files import MB, check_regular
from khala_protocol.keys import Topic, parse
from khala_protocol.messages import Observation, Reply, Report, Result, Run, Wire
from khala_protocol.recording.recorder import KINDS, LEFT_OUT, LIBRARY, METADATA, Recorder
from khala_protocol.recording.speaker import is_said_by
from khala_protocol.recording.unpack import BROKEN, unpack

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from khala_protocol.keys import Address

W = TypeVar("W", bound=Wire)

_RUN_LEVEL = tuple(f"/{topic}" for topic in (Topic.RUN, Topic.RESULT))
_OPENERS = tuple(f"/{topic}" for topic in (Topic.OBSERVATION, Topic.REPORT))
MAX_MESSAGE_BYTES = 8 * MB
"""Longer payloads are not read as messages; a prompt of a million tokens has half of it."""


@dataclass(frozen=True)
class Recorded:
    """One sample of a recording.

    Attributes:
        key: the key it was sent under.
        payload: the bytes, as they went over the bus.
        log_time_ns: wall time of the recorder, nanoseconds since 1970.
        sequence: its place in the recording, from 0.
    """

    key: str
    payload: bytes
    log_time_ns: int
    sequence: int

    @cached_property
    def address(self) -> Address | None:
        """The parsed key; None if it is not of this protocol."""
        try:
            return parse(self.key)
        except PeerError:
            return None

    def is_of(self, *kinds: type[Wire]) -> bool:
        """Return whether its key is one of such messages, without decoding it: a scene of 100 units takes 1 ms."""
        return self.address is not None and KINDS.get(self.address.topic) in kinds

    @cached_property
    def message(self) -> Wire | None:
        """The message; None if there is none: a picture, too many bytes, or words in the mouth of somebody else."""
        if len(self.payload) > MAX_MESSAGE_BYTES or self.address is None or self.address.topic is Topic.IMAGE:
            return None
        try:
            message = decode(self.payload)
        except PeerError:
            return None
        return message if is_said_by(self.address, message) else None


@dataclass(frozen=True)
class RecordedStep:
    """One step of an episode: the samples from its first observation to the first one of the next step.

    A late reply belongs to the step in which it arrived, not to the one that it answers.
    """

    episode: int
    step: int
    samples: tuple[Recorded, ...]

    def of(self, kind: type[W]) -> tuple[W, ...]:
        """Return the messages of one kind that were recorded during this step, in order."""
        samples = (sample for sample in self.samples if sample.is_of(kind))
        return tuple(sample.message for sample in samples if isinstance(sample.message, kind))


@dataclass(frozen=True)
class Recording:
    """A recording that was scanned once; iterating reads the file again, sample by sample.

    Attributes:
        path: the file.
        complete: False if it is torn or damaged, so that it may end in the middle of a run.
        run: the run card; None if none was recorded.
        results: the results of the episodes.
        counts: samples by key.
        metadata: versions, and what the recorder was given.
    """

    path: Path
    complete: bool
    run: Run | None
    results: tuple[Result, ...]
    counts: Mapping[str, int]
    metadata: Mapping[str, str]

    @property
    def samples(self) -> int:
        """The number of readable samples."""
        return sum(self.counts.values())

    @property
    def left_out(self) -> dict[str, str]:
        """How much was not recorded because it was too much, by key."""
        notes = self.metadata.items()
        return {name.removeprefix(LEFT_OUT): words for name, words in notes if name.startswith(LEFT_OUT)}

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Scan a recording.

        Raises:
            RecordingError: there is no such file, or it is not a recording.
        """
        path = Path(path)
        require_recording(path)
        counts: Counter[str] = Counter()
        cards: list[Run] = []
        results: list[Result] = []
        metadata: dict[str, str] = {}
        complete = ended = False
        for record in _records(path):
            match record:
                case Recorded(key=key):
                    counts[key] += 1
                    if key.endswith(_RUN_LEVEL) and isinstance(record.message, Run):
                        cards.append(record.message)
                    elif key.endswith(_RUN_LEVEL) and isinstance(record.message, Result):
                        results.append(record.message)
                case Metadata() if record.name == METADATA:
                    metadata |= record.metadata
                case Statistics(message_count=expected):
                    complete = counts.total() == expected
                case Footer():
                    ended = _ends_with_magic(path)
        return cls(path, complete and ended, cards[0] if cards else None, tuple(results), dict(counts), metadata)

    def __iter__(self) -> Iterator[Recorded]:
        return read(self.path)

    def of(self, kind: type[W], *, agent: str | None = None, side: str | None = None) -> Iterator[W]:
        """Yield all messages of one kind, of one agent or side or of all, in the order of the file."""
        for sample in self:
            address = sample.address
            if address is None or not sample.is_of(kind) or agent not in (None, address.agent):
                continue
            if side not in (None, address.side):
                continue
            if isinstance(sample.message, kind):
                yield sample.message

    def images(self) -> Iterator[tuple[str, bytes]]:
        """Yield every picture once, by the hash under which observations name it."""
        seen: set[str] = set()
        for sample in self:
            if sample.address is None or sample.address.topic is not Topic.IMAGE:
                continue
            digest = hashlib.sha256(sample.payload).hexdigest()
            if digest not in seen:
                seen.add(digest)
                yield digest, sample.payload

    def observations(self, agent: str, *, side: str | None = None) -> Iterator[Observation]:
        """Yield the observations of one agent; `side` says which one, if both sides have one of this name."""
        return self.of(Observation, agent=agent, side=side)

    def replies(self, step: int, episode: int = 0) -> tuple[Reply, ...]:
        """Return all answers to one step, in order of arrival, including late and repeated ones."""
        return tuple(reply for reply in self.of(Reply) if (reply.episode, reply.step) == (episode, step))

    def by_step(self) -> Iterator[RecordedStep]:
        """Yield the samples step by step; samples before the first observation belong to no step.

        A step begins with its first observation, or with its report if nobody was asked in it.
        """
        place: tuple[int, int] | None = None
        samples: list[Recorded] = []
        for sample in self:
            if sample.key.endswith(_OPENERS) and isinstance(sample.message, Observation | Report):
                begun = (sample.message.episode, sample.message.step)
                if place is None or begun > place:
                    if place is not None:
                        yield RecordedStep(*place, tuple(samples))
                    place = begun
                    samples = []
            if place is not None:
                samples.append(sample)
        if place is not None:
            yield RecordedStep(*place, tuple(samples))


def read(path: Path | str) -> Iterator[Recorded]:
    """Yield all samples in the order of the file, up to its end or to the first tear or damage.

    Raises:
        RecordingError: there is no such file, or it is not a recording.
    """
    path = Path(path)
    require_recording(path)
    return (record for record in _records(path) if isinstance(record, Recorded))


def recover(path: Path | str, new_path: Path | str) -> Recording:
    """Write the readable part of a torn or damaged recording as a whole one, and return it.

    Raises:
        RecordingError: `path` is not a recording, or `new_path` exists or cannot be written.
    """
    old = Recording.open(path)
    recorder = Recorder(new_path, metadata=old.metadata)
    try:
        with recorder:
            for sample in old:
                recorder.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns)
    except BaseException:
        recorder.path.unlink(missing_ok=True)  # half of a copy says less than the old file
        raise
    return Recording.open(new_path)


def require_recording(path: Path) -> None:
    """Raise `RecordingError` unless there is a file at `path` that begins as a recording does."""
    try:
        check_regular(path)
        with path.open("rb") as file:
            magic = file.read(MAGIC_SIZE)
    except FileNotFoundError:
        raise RecordingError(f"{path}: there is no such file") from None
    except IsADirectoryError:
        raise RecordingError(f"{path} is a directory: name the recording in it") from None
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from None
    if not magic:
        raise RecordingError(f"{path} is empty: the program that recorded it was stopped before it wrote anything")
    if magic != MCAP0_MAGIC:
        raise RecordingError(f"{path} is not a recording: it does not begin as an MCAP file")


def _records(path: Path) -> Iterator[Recorded | McapRecord]:
    """Yield the records of the file, samples with their keys; end quietly where the file is torn or damaged."""
    keys: dict[int, str] = {}
    expected: Iterator[int] = itertools.repeat(-1)
    with path.open("rb") as file:
        try:
            for record in unpack(file):
                match record:
                    case Header() if record.library.startswith(LIBRARY):
                        expected = itertools.count()
                    case Channel():
                        keys[record.id] = record.topic
                    case Message():
                        if next(expected) not in (-1, record.sequence):
                            return  # mcap skips a chunk with a damaged head, as a record of unknown kind
                        yield Recorded(keys[record.channel_id], record.data, record.log_time, record.sequence)
                    case _:
                        yield record
        except BROKEN:
            return
        except OSError as error:
            raise RecordingError(f"{path} cannot be read: {error.strerror}") from error


def _ends_with_magic(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-MAGIC_SIZE, os.SEEK_END)
        return file.read() == MCAP0_MAGIC
