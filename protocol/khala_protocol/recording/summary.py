"""What the end of a recording says of it, without a look at the rest: a directory of thousands is listed so.

A file that is torn, or still grows, has no such end; then its first chunk alone is known.
"""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Statistics, SummaryOffset

from khala_protocol.errors import RecordingError
from khala_protocol.recording.chunks import Scan, chunk_at, footer, record_at, samples_of, stream_of
from khala_protocol.recording.reader import require_recording
from khala_protocol.recording.unpack import BROKEN

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

_CHUNK = struct.Struct("<QQQQI")
"""Of a chunk's record in the index: first and last log time, offset, length, and bytes of the pairs that follow."""
_PAIR = struct.Struct("<HQ")
"""A channel, and the offset of its index."""
_READ = (Opcode.CHANNEL, Opcode.CHUNK_INDEX, Opcode.STATISTICS)
"""Kinds of records of the summary that are read; the schemas are most of it."""


@dataclass(frozen=True)
class Summary:
    """The summary of a recording.

    Attributes:
        path: of the recording.
        size: in bytes.
        complete: whether it has an end.
        keys: the key of each channel.
        counts: samples by key; of a file without an end, empty.
        begun_ns: log time of the first sample, nanoseconds since 1970.
        ended_ns: of the last one.
    """

    path: Path
    size: int
    complete: bool
    keys: Mapping[int, str]
    counts: Mapping[str, int] = field(default_factory=dict)
    begun_ns: int = 0
    ended_ns: int = 0
    _chunks: tuple[tuple[int, frozenset[int]], ...] = ()
    """Offset and channels of each chunk."""

    @classmethod
    def of(cls, path: Path) -> Summary:
        """Return the summary of a recording.

        Raises:
            RecordingError: there is no such file, or it is not a recording.
        """
        require_recording(path)
        try:
            with path.open("rb") as file:
                size = file.seek(0, 2)
                try:
                    return cls._from_end(path, file, size) or cls._from_begin(path, file, size)
                except BROKEN:
                    return cls._from_begin(path, file, size)
        except OSError as error:
            raise RecordingError(f"{path} cannot be read: {error.strerror}") from error

    @classmethod
    def _from_end(cls, path: Path, file: BinaryIO, size: int) -> Summary | None:
        end = footer(file)
        if end is None or not end.summary_offset_start:
            return None
        groups = [
            SummaryOffset.read(stream_of(content))
            for kind, content in _records(file, end.summary_offset_start, size) if kind == Opcode.SUMMARY_OFFSET
        ]  # fmt: skip
        keys: dict[int, str] = {}
        chunks: list[tuple[int, frozenset[int]]] = []
        counts: Counter[str] = Counter()
        times = (0, 0)
        read = [group for group in groups if group.group_opcode in _READ]
        for group in sorted(read, key=lambda group: group.group_opcode):
            for kind, content in _records(file, group.group_start, group.group_start + group.group_length):
                match kind:
                    case Opcode.CHANNEL:
                        channel = Channel.read(stream_of(content))
                        keys[channel.id] = channel.topic
                    case Opcode.CHUNK_INDEX:
                        chunks.append(_chunk(content))
                    case Opcode.STATISTICS:
                        found = Statistics.read(stream_of(content))
                        times = found.message_start_time, found.message_end_time
                        by_id = found.channel_message_counts.items()
                        counts.update({keys[number]: count for number, count in by_id if number in keys})
        return cls(path, size, True, keys, counts, *times, tuple(chunks))

    @classmethod
    def _from_begin(cls, path: Path, file: BinaryIO, size: int) -> Summary:
        scan = Scan()
        for chunk in scan.chunks(file):
            samples = list(scan.samples(chunk))
            channels = frozenset(sample.channel for sample in samples)
            if samples:
                times = samples[0].log_time_ns, samples[-1].log_time_ns
                return cls(path, size, False, scan.keys, {}, *times, ((chunk.offset, channels),))
        return cls(path, size, False, scan.keys)

    def payloads(self, key: str) -> Iterator[bytes]:
        """Yield the samples of a key, from the chunks that have any.

        Raises:
            RecordingError: the file is damaged.
        """
        wanted = {channel for channel, name in self.keys.items() if name == key}
        try:
            with self.path.open("rb") as file:
                for offset, channels in self._chunks:
                    if wanted & channels:
                        found = samples_of(chunk_at(file, offset))
                        yield from (sample.payload for sample in found if sample.channel in wanted)
        except BROKEN as error:
            raise RecordingError(f"{self.path} is damaged: `khala replay` shows what can be read") from error
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be read: {error.strerror}") from error


def _records(file: BinaryIO, offset: int, end: int) -> Iterator[tuple[int, bytes]]:
    while offset < end and (found := record_at(file, offset, end)) is not None:
        kind, content, offset = found
        yield kind, content


def _chunk(content: bytes) -> tuple[int, frozenset[int]]:
    """Return offset and channels of a chunk; mcap's own reader takes ten times as long, for thousands of files."""
    _, _, offset, _, size = _CHUNK.unpack_from(content)
    pairs = content[_CHUNK.size : _CHUNK.size + size]
    return offset, frozenset(channel for channel, _ in _PAIR.iter_unpack(pairs))
