"""A recording chunk by chunk: a scan that goes on where an earlier one ended, and one sample at its place.

For readers that keep an index. They remember where a chunk begins and where a sample lies in it, and read no more than
that. `Scan` takes the limits of `khala_protocol.recording.unpack`, and waits for what is not whole yet: a file that
grows is read with the same object again and again. It makes no messages; the reader above does.
"""

from __future__ import annotations

import struct
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Header
from mcap.stream_reader import MAGIC_SIZE
from mcap.writer import MCAP0_MAGIC

from khala_protocol.recording.recorder import LIBRARY
from khala_protocol.recording.unpack import BROKEN, LARGEST_RECORD, Budget, chunk_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

_HEAD = struct.Struct("<BQ")
"""Of a record: its kind, and the number of bytes that follow."""
_SAMPLE = struct.Struct("<HIQQ")
"""Of a sample: channel, sequence, log time, publish time."""


class Placed(NamedTuple):
    """A sample with its place."""

    channel: int
    sequence: int
    log_time_ns: int
    place: int
    """Offset of its record in the unpacked chunk."""
    payload: bytes


class PlacedChunk(NamedTuple):
    """A chunk with its place."""

    offset: int
    """Of its record in the file."""
    end: int
    data: bytes
    """Unpacked."""


class Scan:
    """A scan of a file from chunk to chunk.

    Attributes:
        offset: where it goes on: the end of the last whole record.
        ended: whether the footer was seen, so that no sample follows.
        broken: whether the file is damaged here; nothing after it can be trusted.
        keys: the keys by channel, as far as they were seen.
        expected: the number of the next sample; -1 for a file of another writer, which may count otherwise.
    """

    def __init__(self, offset: int = MAGIC_SIZE, *, keys: dict[int, str] | None = None, expected: int = -1) -> None:
        self.offset = offset
        self.ended = self.broken = False
        self.keys = keys or {}
        self.expected = expected
        self._budget = Budget()

    def chunks(self, file: BinaryIO) -> Iterator[PlacedChunk]:
        """Yield the chunks from `offset` on, up to the end of the file or to a record that is not whole yet."""
        size = file.seek(0, 2)
        try:
            while not self.ended and (head := record_at(file, self.offset, size)) is not None:
                kind, content, end = head
                match kind:
                    case Opcode.HEADER:
                        ours = Header.read(stream_of(content)).library.startswith(LIBRARY)
                        self.expected = 0 if ours else -1
                    case Opcode.CHUNK:
                        chunk = Chunk.read(stream_of(content))
                        self._budget.take(chunk)
                        yield PlacedChunk(self.offset, end, chunk_bytes(chunk))
                    case Opcode.FOOTER:
                        self.ended = True
                self.offset = end
        except BROKEN:
            self.broken = True

    def samples(self, chunk: PlacedChunk) -> Iterator[Placed]:
        """Yield the samples of a chunk, and note its channels.

        A gap in the numbers of our own samples means that a damaged chunk was skipped: nothing after it counts.
        """
        try:
            for kind, place, content in _records(chunk.data):
                self._budget.take_record()
                if kind == Opcode.CHANNEL:
                    channel = Channel.read(stream_of(bytes(content)))
                    self.keys[channel.id] = channel.topic
                elif kind == Opcode.MESSAGE:
                    sample = _place(place, content)
                    if self.expected not in (-1, sample.sequence):
                        self.broken = True
                        return
                    self.expected += self.expected >= 0
                    yield sample
        except BROKEN:
            self.broken = True


def chunk_at(file: BinaryIO, offset: int) -> bytes:
    """Return the unpacked chunk whose record begins at this offset.

    Raises:
        BROKEN: there is none, or it is not whole.
    """
    head = record_at(file, offset, file.seek(0, 2))
    if head is None or head[0] != Opcode.CHUNK:
        raise McapError("there is no chunk at this place")
    chunk = Chunk.read(stream_of(head[1]))
    Budget().take(chunk)
    return chunk_bytes(chunk)


def samples_of(data: bytes) -> Iterator[Placed]:
    """Yield the samples of an unpacked chunk.

    Raises:
        BROKEN: it is damaged.
    """
    budget = Budget()
    for kind, place, content in _records(data):
        budget.take_record()
        if kind == Opcode.MESSAGE:
            yield _place(place, content)


def payload_at(data: bytes, place: int) -> bytes:
    """Return the payload of the sample at this place of an unpacked chunk.

    Raises:
        BROKEN: there is none.
    """
    kind, length = _HEAD.unpack_from(data, place)
    start = place + _HEAD.size
    if place < 0 or kind != Opcode.MESSAGE or length < _SAMPLE.size or start + length > len(data):
        raise McapError("there is no sample at this place")
    return data[start + _SAMPLE.size : start + length]


def footer(file: BinaryIO) -> Footer | None:
    """Return the footer of a file; None if it is torn, or still grows."""
    length = _HEAD.size + 20
    size = file.seek(0, 2)
    if size < 2 * MAGIC_SIZE + length:
        return None
    file.seek(size - MAGIC_SIZE - length)
    data = file.read()
    is_one = data.startswith(_HEAD.pack(Opcode.FOOTER, 20)) and data.endswith(MCAP0_MAGIC)
    return Footer.read(stream_of(data[_HEAD.size : length])) if is_one else None


def record_at(file: BinaryIO, offset: int, size: int) -> tuple[int, bytes, int] | None:
    """Return kind, content and end of the record at this offset; None if it is not whole.

    Raises:
        BROKEN: it is larger than ours are.
    """
    if not 0 <= offset <= size - _HEAD.size:
        return None
    file.seek(offset)
    kind, length = _HEAD.unpack(file.read(_HEAD.size))
    if length > LARGEST_RECORD:
        raise McapError("a record of this file is larger than ours are")
    end = offset + _HEAD.size + length
    return None if end > size else (kind, file.read(length), end)


def _records(data: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """Yield kind, place and content of the records of an unpacked chunk."""
    view = memoryview(data)
    place = 0
    while place < len(data):
        kind, length = _HEAD.unpack_from(data, place)
        start = place + _HEAD.size
        if start + length > len(data):
            raise McapError("a record of this chunk is longer than the chunk")
        yield kind, place, view[start : start + length]
        place = start + length


def _place(place: int, content: memoryview) -> Placed:
    number, sequence, log_time_ns, _ = _SAMPLE.unpack_from(content)
    return Placed(number, sequence, log_time_ns, place, bytes(content[_SAMPLE.size :]))


def stream_of(content: bytes) -> ReadDataStream:
    """Return the content of a record as mcap reads it."""
    return ReadDataStream(BytesIO(content))
