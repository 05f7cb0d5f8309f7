"""Protobuf messages put together from parts that are already serialised.

Two facts of the encoding are enough: a message is the concatenation of its fields in any order, and an embedded
message is its bytes behind a tag and a length. So an observation is a join of bytes in which the large images are
copied once, and an image that is all zeros is the same object every time. With message objects each image would be
copied three times (into the object, into the parent, out again), which costs more than the game itself.

Everything that is small is built with the message classes; this module is for the rest.
"""

from __future__ import annotations

from typing import TypeAlias

Part: TypeAlias = bytes | memoryview
"""A piece of a message; a view of an array is copied only when the pieces are joined."""

_LENGTH_DELIMITED = 2


def varint(number: int) -> bytes:
    """Return a number as a varint (7 bits a byte, lowest first)."""
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


def scalar(field: int, number: int) -> bytes:
    """Return a field that holds a non-negative integer, a bool or an enum."""
    return varint(field << 3) + varint(number)


def head(field: int, size: int) -> bytes:
    """Return the head before the `size` bytes of a field that holds a message, a string or bytes."""
    return varint(field << 3 | _LENGTH_DELIMITED) + varint(size)


def embed(field: int, parts: list[Part]) -> list[Part]:
    """Return parts of a message, as parts of the message that holds it in this field."""
    return [head(field, sum(map(len, parts))), *parts]
