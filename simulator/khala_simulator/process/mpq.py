"""Archives in the MPQ format, which StarCraft II keeps its replays in: written here, read through mpyq.

Only what a reader needs: members are stored uncompressed, and the two tables are scrambled as the format requires.
Clients look into a replay for the version of the game before they ask the game itself.

Above: `process/replay.py`.
"""

from __future__ import annotations

import functools
import io
import struct
import zlib
from typing import TYPE_CHECKING, Final

import mpyq
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

MAGIC: Final = b"MPQ\x1a"
_HEADER: Final = struct.Struct("<4sIIHHIIII")
_HASH: Final = struct.Struct("<IIHHI")  # name hashes, locale, platform, block
_BLOCK: Final = struct.Struct("<IIII")  # offset, size stored, size, flags
_NO_BLOCK: Final = 0xFFFFFFFF
_STORED_WHOLE: Final = 0x81000000  # exists, in one piece
_LISTFILE: Final = "(listfile)"
_MASK: Final = 0xFFFFFFFF
_SEED: Final = 0xEEEEEEEE


class MpqError(ValueError):
    """The bytes are no archive, or a damaged one."""


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return an archive with these members, and the list of their names."""
    files = {**members, _LISTFILE: "\r\n".join(members).encode()}
    blocks = []
    at = _HEADER.size
    for data in files.values():
        blocks.append(_BLOCK.pack(at, len(data), len(data), _STORED_WHOLE))
        at += len(data)
    slots = 1 << (2 * len(files)).bit_length()
    hashes = [_HASH.pack(_MASK, _MASK, 0xFFFF, 0xFFFF, _NO_BLOCK)] * slots
    for number, name in enumerate(files):
        slot = _hash(name, 0) % slots
        while hashes[slot][-4:] != struct.pack("<I", _NO_BLOCK):
            slot = (slot + 1) % slots
        hashes[slot] = _HASH.pack(_hash(name, 1), _hash(name, 2), 0, 0, number)
    tables = _scramble(b"".join(hashes), "(hash table)") + _scramble(b"".join(blocks), "(block table)")
    block_table = at + slots * _HASH.size
    head = _HEADER.pack(MAGIC, _HEADER.size, at + len(tables), 0, 3, at, block_table, slots, len(blocks))
    return head + b"".join(files.values()) + tables


def member(archive: bytes, name: str) -> bytes | None:
    """Return a member of an archive, or None; raise MpqError if it can't be read."""
    try:
        data: bytes | None = mpyq.MPQArchive(io.BytesIO(archive), listfile=False).read_file(name)
    except (ValueError, TypeError, LookupError, struct.error, zlib.error, RuntimeError) as error:
        raise MpqError(f"the archive is damaged: {error}") from error
    return data


@functools.cache
def _table() -> list[int]:
    """Return the format's table of 5 x 256 numbers, from its own random generator."""
    table = [0] * 0x500
    seed = 0x00100001
    for column in range(0x100):
        for row in range(5):
            high = seed = (seed * 125 + 3) % 0x2AAAAB
            low = seed = (seed * 125 + 3) % 0x2AAAAB
            table[row * 0x100 + column] = (high & 0xFFFF) << 16 | low & 0xFFFF
    return table


def _hash(name: str, kind: int) -> int:
    """Return the hash of a name: kind 0 is its place in the table, 1 and 2 verify the name, 3 is a key."""
    first = 0x7FED7FED
    second = _SEED
    for letter in name.upper().encode():
        first = (_table()[kind * 0x100 + letter] ^ (first + second)) & _MASK
        second = (letter + first + second + (second << 5) + 3) & _MASK
    return first


def _scramble(data: bytes, key: str) -> bytes:
    first = _hash(key, 3)
    second = _SEED
    out = []
    for number in np.frombuffer(data, "<u4").tolist():
        second = (second + _table()[0x400 + (first & 0xFF)]) & _MASK
        out.append((number ^ (first + second)) & _MASK)
        first = ((~first << 0x15) + 0x11111111 | first >> 0x0B) & _MASK
        second = (number + second + (second << 5) + 3) & _MASK
    return np.array(out, "<u4").tobytes()
