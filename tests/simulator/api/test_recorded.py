"""What players are shown in games with random orders is as recorded, and has every field that a unit may have."""

from __future__ import annotations

import pytest
from s2clientprotocol import raw_pb2

from tests.simulator.api import recorded

NEVER_SENT = {"radar_range"}


def test_players_are_shown_what_is_recorded() -> None:
    name = recorded.GAMES[0]
    assert recorded.digests(name, 80) == recorded.recorded(name, 80)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", recorded.GAMES)
def test_players_are_shown_what_is_recorded_in_long_games(name: str) -> None:
    assert recorded.digests(name) == recorded.recorded(name)


def fields_of_units(name: str, loops: int) -> set[str]:
    """Return the fields of units that occur in a game, all of them as the message classes would write them."""
    seen = set()
    for world in recorded.game(name, loops):
        for seat in recorded.seats_of(world):
            data = recorded.units_of(seat, seat.look()).encode()
            raw = raw_pb2.ObservationRaw.FromString(data)
            assert raw.SerializeToString() == data
            seen |= {field.name for unit in raw.units for field, _ in unit.ListFields()}
    return seen


def test_units_are_written_as_by_the_message_classes() -> None:
    seen = fields_of_units(recorded.GAMES[0], 80)
    assert {"orders", "cargo_space_max", "engaged_target_tag", "detect_range", "add_on_tag"} <= seen


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_every_field_of_a_unit_is_sent() -> None:
    seen = set().union(*(fields_of_units(name, recorded.LOOPS) for name in recorded.GAMES))
    assert {field.name for field in raw_pb2.Unit.DESCRIPTOR.fields} - seen == NEVER_SENT
