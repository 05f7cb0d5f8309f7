"""Observations whose view is read when somebody looks at it: most policies read the words alone.

A view is three quarters of an observation's bytes, and hundreds of objects. Left in its bytes it costs neither the time
to make them nor that of the garbage collector, which visits them while the model thinks.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, GetPydanticSchema, PrivateAttr, ValidationError
from pydantic_core import core_schema

from khala_protocol.codec import decode_as, explain
from khala_protocol.messages import Observation, View

_ANY_OBJECT = core_schema.typed_dict_schema({}, extra_behavior="ignore")
"""An object of JSON, of which nothing is kept."""
_slot_of_fields, _slot_of_private = (vars(BaseModel)[slot] for slot in ("__dict__", "__pydantic_private__"))


def decode_observation(payload: bytes) -> Observation:
    """Return the observation of these bytes, as `decode_as` does, and read its view on the first access.

    Raises:
        WrongVersion: it has another major version of the schema.
        MalformedMessage: it is no observation. A malformed view is found when it is read.
    """
    try:
        words = _Words.model_validate_json(payload)
    except ValidationError as error:
        raise explain(payload, error) from None
    fields = dict(vars(words))
    del fields["view"]
    unread = words.having(fields)
    _slot_of_private.__set__(unread, {"_payload": payload})
    object.__setattr__(unread, "__class__", _Unread)
    return unread


class _Words(Observation):
    """An observation without its view."""

    view: Annotated[View, GetPydanticSchema(lambda _source, _handler: _ANY_OBJECT)]
    _payload: bytes = PrivateAttr()


class _Unread(Observation):
    """An observation that becomes a plain `Observation` when its view, or all of it, is looked at."""

    _payload: bytes = PrivateAttr()

    def _read(self) -> Observation:
        object.__setattr__(self, "__dict__", vars(decode_as(Observation, self._payload)))
        _slot_of_private.__set__(self, None)
        return self

    def __getattr__(self, name: str) -> Any:
        return self._read().view if name == "view" else super().__getattr__(name)  # type: ignore[misc]  # pydantic's

    @property
    def __dict__(self) -> dict[str, Any]:
        """All fields: what pydantic compares, copies and writes."""
        return vars(self._read())

    @__dict__.setter
    def __dict__(self, fields: dict[str, Any]) -> None:
        object.__setattr__(self, "__class__", Observation)
        _slot_of_fields.__set__(self, fields)

    def __eq__(self, other: object) -> bool:
        return self._read() == other

    __hash__ = Observation.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        return decode_observation, (self._payload,)

    def __repr__(self) -> str:
        return repr(self._read())
