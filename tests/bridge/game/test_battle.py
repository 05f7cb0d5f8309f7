"""The end of a battle that its map does not end."""

from __future__ import annotations

import pytest
from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.game.battle import Battle
from khala_bridge.knowledge import facts_of
from khala_bridge.state import Snapshot, read_info, read_snapshot

MARINE, MEDIVAC = 48, 54


def snapshot(own: dict[int, int], enemy: dict[int, int]) -> Snapshot:
    """Return a snapshot of units, by tag their types."""
    response = sc_pb.ResponseObservation()
    for units, alliance in ((own, raw_pb2.Self), (enemy, raw_pb2.Enemy)):
        for tag, kind in units.items():
            response.observation.raw_data.units.add(
                tag=tag, unit_type=kind, alliance=alliance, display_type=raw_pb2.Visible
            )
    return read_snapshot(response, read_info(sc_pb.ResponseGameInfo(), facts_of("multi")))


BATTLE = Battle(snapshot({1: MARINE, 2: MEDIVAC}, {11: MARINE, 12: MEDIVAC}))


@pytest.mark.parametrize(
    ("own", "enemy", "outcome"),
    [
        ({1: MARINE}, {11: MARINE}, None),
        ({1: MARINE}, {}, "win"),
        ({1: MARINE}, {12: MEDIVAC}, "win"),
        ({}, {11: MARINE}, "loss"),
        ({2: MEDIVAC}, {11: MARINE}, "loss"),
        ({2: MEDIVAC}, {12: MEDIVAC}, "draw"),
    ],
)
def test_a_side_loses_when_none_of_its_units_can_fight(
    own: dict[int, int], enemy: dict[int, int], outcome: str | None
) -> None:
    now = BATTLE.judge(snapshot(own, enemy))
    assert (now.outcome, now.ended) == (outcome, outcome is not None)


def test_units_that_come_back_belong_to_another_battle() -> None:
    now = BATTLE.judge(snapshot({21: MARINE}, {31: MARINE}))
    assert (now.outcome, now.own, now.units, now.known) == ("draw", (), {}, {})
