"""Bytes put together by hand are what the message classes make of the same fields."""

from hypothesis import given
from hypothesis import strategies as st
from s2clientprotocol import common_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import fields, wire


@given(st.integers(0, 2**32 - 1))
def test_a_scalar_is_read_back(number: int) -> None:
    assert sc.Response.FromString(wire.scalar(97, number)).id == number


@given(st.integers(0, 2**32 - 1), st.binary(max_size=300))
def test_an_embedded_message_is_read_back(loop: int, replay: bytes) -> None:
    step = wire.embed(12, [sc.ResponseStep(simulation_loop=loop).SerializeToString()])
    save = wire.embed(15, [wire.head(1, len(replay)), replay])
    assert sc.Response.FromString(b"".join(step)).step.simulation_loop == loop
    assert sc.Response.FromString(b"".join(save)).save_replay.data == replay


def test_an_empty_message_is_present() -> None:
    assert sc.Response.FromString(b"".join(wire.embed(20, []))).HasField("debug")


TAG, OWNER, POS, FACING = (fields.key(raw_pb2.Unit, name) for name in ("tag", "owner", "pos", "facing"))
UNITS = fields.key(raw_pb2.ObservationRaw, "units")
rows = st.tuples(st.integers(0, 2**64 - 1), st.integers(0, 20), st.floats(width=32, allow_nan=False))


@given(st.lists(rows, max_size=5), st.integers(1, 60))
def test_a_message_is_written_as_by_the_message_classes(units: list[tuple[int, int, float]], room: int) -> None:
    raw, message, unit = raw_pb2.ObservationRaw(), wire.MessageWriter(room), wire.MessageWriter(room)
    for tag, owner, number in units:
        point = common_pb2.Point(x=number, y=1.5, z=-number)
        raw.units.add(tag=tag, owner=owner, pos=point, facing=number)
        unit.clear()
        unit.put_number(TAG, tag)
        unit.put_number(OWNER, owner)
        unit.put_point(POS, number, 1.5, -number)
        unit.put_float(FACING, number)
        message.put_message(UNITS, unit)
    assert message.content() == raw.SerializeToString()
