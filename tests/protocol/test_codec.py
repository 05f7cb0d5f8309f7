"""Message ↔ bytes: every message comes back, and other bytes are refused with a reason."""

from __future__ import annotations

import json
import types
from typing import TYPE_CHECKING, Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest
from annotated_types import Ge, Gt, Le, MinLen
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from khala_protocol.codec import MAX_REPLY_BYTES, decode, decode_as, encode
from khala_protocol.errors import MalformedMessage, WrongVersion
from khala_protocol.messages import MESSAGE_TYPES, MOST, Frozen, Message, Reply, Usage, Wire
from khala_protocol.speech import MAX_REPLY_CHARACTERS

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic.fields import FieldInfo

JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
SIMPLE: dict[object, st.SearchStrategy[Any]] = {
    str: st.text(max_size=20),
    bool: st.booleans(),
    int: st.integers(-(2**53), 2**53),
    float: st.floats(allow_nan=False, allow_infinity=False),
    object: JSON,
    type(None): st.none(),
}


def numbers(field: FieldInfo) -> dict[object, st.SearchStrategy[Any]]:
    """Return the strategies for the numbers of a field with limits; none for one without."""
    limits: dict[type, Any] = {type(one): getattr(one, type(one).__name__.lower(), None) for one in field.metadata}
    least, most = limits.get(Ge, limits.get(Gt)), limits.get(Le, MOST)
    if least is None:
        return {}
    return {int: st.integers(int(least), int(most)), float: st.floats(least, most, exclude_min=Gt in limits)}


def values(  # noqa: PLR0911  # one a type
    annotation: Any, limited: dict[object, st.SearchStrategy[Any]] | None = None
) -> st.SearchStrategy[Any]:
    """Return a strategy for all values of a field of this annotation."""
    arguments = get_args(annotation)
    origin = get_origin(annotation)
    if limited and annotation in limited:
        return limited[annotation]
    if annotation in SIMPLE:
        return SIMPLE[annotation]
    if origin is Literal:
        return st.sampled_from(arguments)
    if origin in (Union, types.UnionType):
        return st.one_of([values(argument, limited) for argument in arguments])
    if origin is tuple and arguments[-1] is ...:
        return st.lists(values(arguments[0]), max_size=2).map(tuple)
    if origin is tuple:
        return st.tuples(*map(values, arguments))
    if origin is dict:
        return st.dictionaries(*map(values, arguments), max_size=2)
    if hasattr(annotation, "_fields"):
        return st.builds(annotation, **{name: values(hint) for name, hint in get_type_hints(annotation).items()})
    assert isinstance(annotation, type) and issubclass(annotation, Frozen), annotation
    return built(annotation)


def built(model: type[Frozen]) -> st.SearchStrategy[Any]:
    hints = get_type_hints(model)
    fields = {}
    for name, field in model.model_fields.items():
        shortest = next((limit.min_length for limit in field.metadata if isinstance(limit, MinLen)), 0)
        texts = {str: st.text(min_size=shortest, max_size=20)} if shortest else {}
        fields[name] = values(hints[name], numbers(field) | texts)
    return st.builds(model, **fields)


A_MESSAGE = Message(run="r", agent="A", side="p1", episode=0, step=0, recipient="B", text="hi")
MESSAGE_BYTES = (
    b'{"v":1,"run":"r","kind":"message","agent":"A","side":"p1","episode":0,"step":0,"recipient":"B",'
    b'"text":"hi","human":false}'
)


@pytest.mark.parametrize("model", MESSAGE_TYPES, ids=lambda model: model.__name__)
def test_every_message_comes_back_as_it_was(model: type[Wire]) -> None:
    @settings(suppress_health_check=list(HealthCheck))
    @given(built(model))
    def comes_back(message: Wire) -> None:
        payload = encode(message)
        assert type(decode(payload)) is model
        assert decode(payload) == message
        assert decode_as(model, payload) == message
        assert encode(decode(payload)) == payload
        json.loads(payload, parse_constant=pytest.fail)  # no NaN, which JSON lacks

    comes_back()


def test_the_same_message_gives_the_same_bytes() -> None:
    assert encode(A_MESSAGE) == MESSAGE_BYTES
    assert encode(A_MESSAGE.model_copy()) == MESSAGE_BYTES
    assert decode(MESSAGE_BYTES) == A_MESSAGE


def test_the_order_of_fields_on_the_wire_is_free() -> None:
    turned = json.dumps(dict(reversed(json.loads(MESSAGE_BYTES).items()))).encode()
    assert decode(turned) == A_MESSAGE


def test_half_of_a_surrogate_pair_is_replaced_and_offsets_stay() -> None:
    """`json.loads` of a completion accepts them, UTF-8 has none."""
    text = "ab\ud800<Stop()>\udfff"
    reply = Reply(run="r", agent="A", side="p1", episode=0, step=0, text=text)
    arrived = decode_as(Reply, encode(reply))
    assert arrived.text == "ab\ufffd<Stop()>\ufffd"
    assert arrived.text.index("<Stop()>") == text.index("<Stop()>")


@pytest.mark.parametrize("read", [decode, lambda payload: decode_as(Reply, payload)], ids=["any kind", "one kind"])
def test_a_recorded_reply_of_an_early_version_is_read_without_its_calls(read: Callable[[bytes], Wire]) -> None:
    reply = Reply(run="r", agent="A", side="p1", episode=0, step=0, text="<Stop()>", usage=Usage(requests=1))
    calls: list[dict[str, Any]] = [{"name": "Stop", "args": [], "team": None, "start": 0, "end": 8}]
    assert read(json.dumps(json.loads(encode(reply)) | {"calls": calls}).encode()) == reply


def changed(**changes: object) -> bytes:
    return json.dumps(json.loads(MESSAGE_BYTES) | changes).encode()


def without(field: str) -> bytes:
    content = json.loads(MESSAGE_BYTES)
    del content[field]
    return json.dumps(content).encode()


MALFORMED = [
    (b"", "b'' is no JSON object"),
    (b"\xff\xfe", r"b'\xff\xfe' is no JSON object"),
    (b"hello", "b'hello' is no JSON object"),
    (b"null", "b'null' is no JSON object"),
    (b"[1]", "b'[1]' is no JSON object"),
    (b"[" * 100_000, "b'" + "[" * 58 + "… is no JSON object"),
    (MESSAGE_BYTES[:-1], "b'" + MESSAGE_BYTES[:58].decode() + "… is no JSON object"),
    (b"{}", "message: Unable to extract tag using discriminator 'kind' (1 fault(s) in all)"),
    (
        changed(kind="order"),
        "message: Input tag 'order' found using 'kind' does not match any of the expected tags: "
        + ", ".join(repr(model.model_fields["kind"].default) for model in MESSAGE_TYPES)
        + " (1 fault(s) in all)",
    ),
    (changed(colour="red"), "message.colour: Extra inputs are not permitted (1 fault(s) in all)"),
    (without("text"), "message.text: Field required (1 fault(s) in all)"),
    (changed(step=-1, agent=3), "message.agent: Input should be a valid string (2 fault(s) in all)"),
    (changed(**{"k" * 500: 1}), "message." + "k" * 52 + "…: Extra inputs are not permitted (1 fault(s) in all)"),
]  # fmt: skip


@pytest.mark.parametrize(("payload", "text"), MALFORMED, ids=range(len(MALFORMED)))
def test_what_is_no_message_is_refused_with_a_reason(payload: bytes, text: str) -> None:
    with pytest.raises(MalformedMessage) as raised:
        decode(payload)
    assert str(raised.value) == text


@pytest.mark.parametrize(
    ("version", "said"), [(2, "2"), ("1", "'1'"), (None, "None"), (1.5, "1.5"), ("x" * 99, "'" + "x" * 59 + "…")]
)
def test_another_version_is_refused_and_not_guessed_at(version: object, said: str) -> None:
    with pytest.raises(WrongVersion) as raised:
        decode(changed(v=version, fields_of_the_future=[1]))
    assert str(raised.value) == (
        f"the peer speaks version {said} of the protocol and this side version 1: "
        "install the same release of Khala on both"
    )


def test_a_message_of_another_kind_than_expected_is_refused() -> None:
    with pytest.raises(MalformedMessage, match="kind: Input should be 'reply'"):
        decode_as(Reply, MESSAGE_BYTES)


@given(st.binary(max_size=200) | JSON.map(json.dumps).map(str.encode))
def test_no_bytes_raise_anything_else(payload: bytes) -> None:
    with pytest.raises((MalformedMessage, WrongVersion)):
        decode(payload)


def test_a_reply_that_is_far_too_long_is_refused_unread() -> None:
    with pytest.raises(MalformedMessage, match=r"^a reply of 1048577 bytes is too long: it may have 1048576$"):
        decode_as(Reply, b"[" * (MAX_REPLY_BYTES + 1))


def test_the_longest_reply_that_is_read_fits() -> None:
    text = "\x00" * MAX_REPLY_CHARACTERS
    reply = Reply(run="r", agent="A", side="p1", episode=0, step=0, text=text)
    assert decode_as(Reply, encode(reply)) == reply


def test_no_sum_of_what_agents_report_fails() -> None:
    usage = Usage(requests=MOST, prompt_tokens=MOST, cost_usd=MOST)
    assert usage + usage == usage


@pytest.mark.parametrize("usage", [{"requests": -1}, {"prompt_tokens": 10**4000}, {"cost_usd": 1e300}])
def test_usage_that_cannot_be_is_no_message(usage: dict[str, Any]) -> None:
    reply = {
        "kind": "reply",
        "run": "r",
        "agent": "A",
        "side": "p1",
        "episode": 0,
        "step": 0,
        "text": "",
        "usage": usage,
    }
    with pytest.raises(MalformedMessage):
        decode_as(Reply, json.dumps(reply).encode())
