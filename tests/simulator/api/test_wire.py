"""Bytes put together by hand are what the message classes make of the same fields."""

from hypothesis import given
from hypothesis import strategies as st
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import wire


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
