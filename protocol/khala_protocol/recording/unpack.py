"""An MCAP file → its records, one by one and within limits: a file may be made to be larger than it is.

mcap's own reader unpacks a chunk of any size and makes all of its records at once: 33 kB took 2 GB and 26 s.
Above it is `khala_protocol.recording.reader`, which knows what the records mean.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO

import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from khala_protocol.files import MB

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mcap.data_stream import ReadDataStream

LARGEST_RECORD = 64 * MB
"""Of a record, and of a chunk when it is unpacked; ours are a megabyte or one sample."""
FREE = 8 * MB
RATIO = 100
"""All chunks together may unpack to `FREE` and this many times their size; ours to 6 or 8 times."""
RECORD_COST = 256
"""Bytes that a record counts in addition to its own: the smallest take as long to read as ones of this size."""
_TOO_MUCH = "the chunks of this file unpack to far more than ours do"
BROKEN = (McapError, zstandard.ZstdError, struct.error, ValueError, LookupError, OverflowError, MemoryError)
"""Errors of bytes that are not an MCAP file, or that unpack beyond the limits; found by mutating one."""


def unpack(file: BinaryIO) -> Iterator[McapRecord]:
    """Yield the records of a file, those in chunks too, in its order.

    Raises:
        BROKEN: the file is torn or damaged here.
    """
    budget = Budget()
    for record in StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST_RECORD).records:
        if not isinstance(record, Chunk):
            yield record
            continue
        budget.take(record)
        stream, size = get_chunk_data_stream(record, validate_crc=True)
        while stream.count < size:
            budget.take_record()
            if (inner := _inner(stream)) is not None:
                yield inner


class Budget:
    """How much the chunks of one file may still unpack to."""

    def __init__(self) -> None:
        self._left = FREE

    def take(self, chunk: Chunk) -> None:
        """Count a chunk; raise `McapError` if it is too much."""
        self._left += RATIO * len(chunk.data) - _unpacked_size(chunk)
        self._check()

    def take_record(self) -> None:
        """Count a record of a chunk; raise `McapError` if it is too much."""
        self._left -= RECORD_COST
        self._check()

    def _check(self) -> None:
        if self._left < 0:
            raise McapError(_TOO_MUCH)


def chunk_bytes(chunk: Chunk) -> bytes:
    """Return the records of a chunk that a budget has taken.

    Raises:
        BROKEN: it is damaged.
    """
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    return stream.read(size)


def _unpacked_size(chunk: Chunk) -> int:
    """Return the size of a chunk's records; what the head of the chunk and that of the frame say may differ."""
    sizes = [chunk.uncompressed_size, len(chunk.data)]
    if chunk.compression == "zstd":
        sizes.append(zstandard.frame_content_size(chunk.data))
    if max(sizes) > LARGEST_RECORD:
        raise McapError("a chunk of this file unpacks to more than ours do")
    return max(sizes)


def _inner(stream: ReadDataStream) -> McapRecord | None:
    """Return the next record of a chunk; None for a kind that does not belong into one."""
    record: McapRecord | None = None
    opcode = stream.read1()
    length = stream.read8()
    match opcode:
        case Opcode.MESSAGE:
            record = Message.read(stream, length)
        case Opcode.CHANNEL:
            record = Channel.read(stream)
        case Opcode.SCHEMA:
            record = Schema.read(stream)
        case _:
            stream.read(length)
    return record
