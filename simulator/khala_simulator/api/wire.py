"""Protobuf messages put together from parts that are already serialised.

Two facts of the encoding are enough: a message is the concatenation of its fields in any order, and an embedded
message is its bytes behind a tag and a length. So an observation is a join of bytes in which the large images are
copied once, and an image that is all zeros is the same object every time. With message objects each image would be
copied three times (into the object, into the parent, out again), which costs more than the game itself.

Everything that is small is built with the message classes; this module is for the rest. What has a part for each of
many units is written by ``MessageWriter``, field by field.
"""

from __future__ import annotations

from typing import Final, TypeAlias

from khala_simulator.native import memory

Part: TypeAlias = bytes | memoryview
"""A piece of a message; a view of an array is copied only when the pieces are joined."""

_LENGTH_DELIMITED = 2
_FLOAT = 5
_MOST: Final = 20
"""Bytes of a key and a number at most."""
_X: Final = 1 << 3 | _FLOAT
_Y: Final = 2 << 3 | _FLOAT
_Z: Final = 3 << 3 | _FLOAT
_POINT_SIZE: Final = 15


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


class MessageWriter:
    """A message that is being written, its fields in the order of their numbers; ``fields`` has the key of each.

    Attributes:
        size: Bytes written so far.
    """

    def __init__(self, room: int) -> None:
        """Take room for so many bytes; it grows."""
        self._array = memory.new_uint8s(room)
        self._bytes = memory.uint8s(self._array)
        self._room = room
        self.size = 0

    def clear(self) -> None:
        """Begin a new message."""
        self.size = 0

    def content(self) -> bytes:
        """Return what was written."""
        return self._array[: self.size].tobytes()

    def put_number(self, key: int, number: int) -> None:
        """Write a field that holds a non-negative integer, a bool or an enum."""
        self._reserve(_MOST)
        self._put_varint(key)
        self._put_varint(number)

    def put_float(self, key: int, number: float) -> None:
        """Write a field that holds a float."""
        self._reserve(_MOST)
        self._put_varint(key)
        memory.put_float32(self._bytes, self.size, number)
        self.size += 4

    def put_point(self, key: int, x: float, y: float, z: float) -> None:
        """Write a field that holds a `Point`."""
        self._reserve(_MOST)
        self._put_varint(key)
        self._put_varint(_POINT_SIZE)
        self.put_float(_X, x)
        self.put_float(_Y, y)
        self.put_float(_Z, z)

    def put_message(self, key: int, message: MessageWriter) -> None:
        """Write a field that holds a message."""
        self._reserve(_MOST + message.size)
        self._put_varint(key)
        self._put_varint(message.size)
        memory.put_bytes(self._bytes, self.size, message._bytes, message.size)
        self.size += message.size

    def _put_varint(self, number: int) -> None:
        """Write a number, 7 bits a byte, lowest first."""
        while number > 0x7F:
            self._bytes[self.size] = number & 0x7F | 0x80
            self.size += 1
            number >>= 7
        self._bytes[self.size] = number
        self.size += 1

    def _reserve(self, more: int) -> None:
        """Make room for so many bytes more."""
        if self.size + more > self._room:
            self._grow(2 * (self.size + more))

    def _grow(self, room: int) -> None:
        """Move to a larger array."""
        array = memory.new_uint8s(room)
        memory.put_bytes(memory.uint8s(array), 0, self._bytes, self.size)
        self._array = array
        self._bytes = memory.uint8s(array)
        self._room = room
