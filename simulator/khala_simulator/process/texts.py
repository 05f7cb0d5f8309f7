"""Texts in requests: protobuf gives one that is not UTF-8 as bytes, which no handler expects.

Only messages that can hold a text are looked into, so that a hundred commands to units cost next to nothing. Above:
`session.py`.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from google.protobuf.descriptor import FieldDescriptor

if TYPE_CHECKING:
    from google.protobuf.descriptor import Descriptor
    from google.protobuf.message import Message


def broken_text(message: Message) -> str:
    """Return the path of a text in a message that is not UTF-8; "" if all are."""
    for field in _fields(message.DESCRIPTOR):
        if not field.is_repeated and not message.HasField(field.name):
            continue
        value = getattr(message, field.name)
        for part in value if field.is_repeated else (value,):
            if field.message_type is None:
                if isinstance(part, bytes):
                    return field.name
            elif inner := broken_text(part):
                return f"{field.name}.{inner}"
    return ""


@cache
def _fields(descriptor: Descriptor) -> tuple[FieldDescriptor, ...]:
    """Return the fields of a message that are texts, or messages that can hold one."""
    return tuple(
        field
        for field in descriptor.fields
        if field.type == FieldDescriptor.TYPE_STRING or (field.message_type is not None and _fields(field.message_type))
    )
