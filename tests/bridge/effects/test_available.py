"""What own units can do now, by the same query to the simulator as in a game."""

from __future__ import annotations

import pytest

from khala_bridge.catalogue.functions import functions
from khala_bridge.knowledge import knowledge
from khala_simulator.abilities import commands
from khala_simulator.combat.traits import refresh

from .stage import Stage

BLINK, BLINK_OF_STALKERS = (
    functions()[name].ability_id for name in ("Effect_Blink_screen", "Effect_Blink_Stalker_screen")
)


@pytest.fixture(scope="module")
def gateway() -> Stage:
    return Stage("Gateway")


def test_an_ability_is_there_as_itself_and_in_its_general_form() -> None:
    stage = Stage("Stalker")
    abilities = stage.again().snapshot.abilities
    assert abilities is not None
    assert {BLINK, BLINK_OF_STALKERS} <= abilities[stage.caster]


def test_every_own_unit_is_asked_about_and_nobody_else(gateway: Stage) -> None:
    seen = gateway.again().snapshot
    assert seen.abilities is not None
    assert seen.abilities.keys() == {unit.tag for unit in seen.own}


def test_what_the_player_cannot_pay_is_not_available(gateway: Stage) -> None:
    train = functions()["Train_Zealot_quick"].ability_id
    before = gateway.again().snapshot.abilities
    gateway.world.players[1].minerals = 99
    after = gateway.look().snapshot.abilities
    assert before is not None
    assert after is not None
    assert train in before[gateway.caster]
    assert train not in after[gateway.caster]


def test_what_is_not_finished_can_only_be_called_off(gateway: Stage) -> None:
    gateway.again()
    world = gateway.world
    slot = world.slot_of(gateway.caster)
    world.build_progress[slot] = 0.5
    refresh(world, slot)
    abilities = gateway.look().snapshot.abilities
    assert abilities is not None
    cancel = {functions()[name].ability_id for name in ("Cancel_quick", "Cancel_BuildInProgress_quick")}
    assert cancel <= abilities[gateway.caster]
    assert functions()["Train_Zealot_quick"].ability_id not in abilities[gateway.caster]


def test_a_cooldown_takes_an_ability_away_until_it_is_over() -> None:
    stage = Stage("Stalker")
    stage.again()
    commands.debug_switch(stage.world, 1, "cooldown")  # off, so that cooldowns count
    slot = stage.world.slot_of(stage.caster)
    blink = stage.world.catalog.ability(BLINK_OF_STALKERS)
    stage.world.timers[slot] = {blink.timer: stage.world.loop + 5.0}
    assert BLINK not in (stage.look().snapshot.abilities or {})[stage.caster]
    stage.client.step(6)
    assert BLINK in (stage.look().snapshot.abilities or {})[stage.caster]


def test_units_are_known_by_the_ids_of_the_game() -> None:
    stage = Stage("LurkerBurrowed")
    assert stage.again().snapshot.units[stage.caster].unit_type == knowledge()["LurkerBurrowed"].id
