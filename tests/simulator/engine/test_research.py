"""Research: price, time, once per player, and what the upgrade then does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities import casting
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    import pytest

    from tests.simulator.engine.conftest import Field

CATALOG = load_catalog()
LATER = ("HighCapacityBarrels", "LurkerRange")  # their upgrade's own row has the price of a later version
RESEARCHES = [a for a in CATALOG.abilities if a.effect == "research" and a.users and a.loops]
WARP_GATE = 1568


def test_every_upgrade_has_a_price_and_a_time(subtests: pytest.Subtests) -> None:
    for ability in RESEARCHES:
        with subtests.test(ability.upgrade):
            upgrade = CATALOG.upgrade(ability.upgrade)
            assert (ability.minerals, ability.vespene) == upgrade.cost or upgrade.name in LATER
            assert ability.loops > 0


def test_research_costs_lasts_and_is_done_once(field: Field) -> None:
    field.put("Pylon", 1, 12.0, 16.0)
    core, other = field.put("CyberneticsCore", 1, 16.5, 16.5), field.put("CyberneticsCore", 1, 16.5, 20.5)
    player, ability = field.world.players[1], CATALOG.ability(WARP_GATE)
    player.minerals = player.vespene = 500.0
    field.play(1)
    assert casting.use(field.world, [core, other], ability) == [core]
    assert (player.minerals, player.vespene) == (500.0 - ability.minerals, 500.0 - ability.vespene)
    assert casting.refusal(field.world, other, ability) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.play(int(ability.loops) - 1)
    assert player.upgrades == []
    field.play(1)
    assert player.upgrades == [CATALOG.upgrade(ability.upgrade).id]
    assert field.world.alerts[-1].name == "ResearchComplete"
    assert casting.refusal(field.world, other, ability) is ActionResult.TECH_REQUIREMENTS_NOT_MET


def test_research_that_is_called_off_can_be_begun_again(field: Field) -> None:
    field.put("Pylon", 1, 12.0, 16.0)
    core, ability = field.put("CyberneticsCore", 1, 16.5, 16.5), CATALOG.ability(WARP_GATE)
    player = field.world.players[1]
    player.minerals = player.vespene = 50.0
    field.play(1)
    casting.use(field.world, [core], ability)
    casting.use(field.world, [core], CATALOG.ability(306))
    assert (player.minerals, player.vespene, player.underway) == (50.0, 50.0, [])
    assert casting.refusal(field.world, core, ability) is ActionResult.SUCCESS


def test_a_finished_upgrade_counts_for_units_that_are_there(field: Field) -> None:
    forge, zealot = field.put("Forge", 1, 16.5, 16.5), field.put("Zealot", 1, 8.0, 8.0)
    field.put("Pylon", 1, 12.0, 16.0)
    field.world.players[1].minerals = field.world.players[1].vespene = 500.0
    ability = next(a for a in RESEARCHES if a.upgrade == "ProtossGroundArmorsLevel1")
    before = float(field.world.stats.armor[1, field.world.type[zealot]])
    field.play(1)
    casting.use(field.world, [forge], ability)
    field.play(int(ability.loops))
    assert field.world.stats.armor[1, field.world.type[zealot]] == before + 1
