"""Whatever Terrans do, the world stays sound: random orders of every kind, for a while, in both versions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.tables.abilities import AbilityAim

VERSIONS = ("4.10", "5.0.13")
ARMY = (
    "Marine", "Marauder", "Reaper", "Ghost", "Hellion", "HellionTank", "WidowMine", "SiegeTank", "Cyclone", "Thor",
    "VikingFighter", "Medivac", "Liberator", "Banshee", "Raven", "Battlecruiser", "SCV", "MULE",
)  # fmt: skip
TOWN = (("OrbitalCommand", 5.5, 26.5), ("Barracks", 11.5, 27.5), ("SupplyDepot", 16, 28), ("Bunker", 20.5, 27.5))
FOES = ("Zealot", "Stalker", "HighTemplar", "Ultralisk", "Mutalisk", "Roach", "Immortal", "Ghost")
LOOPS, ORDERS_EVERY = 800, 4
EDGE = 1e-6


def order_somebody(field: Any, rng: np.random.Generator) -> None:
    """Give one random order to a random Terran unit: any ability of its card at anything, or a walk."""
    world = field.world
    mine = world.units_of(1)
    if not len(mine):
        return
    slot = int(rng.choice(mine))
    card = [a for a in world.catalog.abilities_of(int(world.type[slot])) if casting.is_modelled(a)]
    x, y = rng.uniform(0.5, 31.5, 2).tolist()
    queue = bool(rng.random() < 0.2)
    if not card or rng.random() < 0.2:
        commands.move(world, [slot], (x, y), queue=queue)
        return
    ability = card[int(rng.integers(len(card)))]
    if ability.effect in casting.ORDINARY:
        commands.attack_move(world, [slot], (x, y), queue=queue)
        return
    target = int(rng.choice(world.live)) if AbilityAim.UNIT in ability.aim and rng.random() < 0.7 else -1
    point = (x, y) if target < 0 and AbilityAim.POINT in ability.aim else None
    casting.use(world, [slot], ability, target=world.tag_of(target), point=point, queue=queue)


def assert_sound(world: Any) -> None:
    live = world.live
    x0, y0, x1, y1 = world.map.terrain.playable
    assert np.isfinite(world.pos[live]).all()
    assert (world.pos[live] >= (x0 - EDGE, y0 - EDGE)).all()
    assert (world.pos[live] <= (x1 + EDGE, y1 + EDGE)).all()
    assert (world.life[live] <= world.life_max[live] + EDGE).all()
    assert (world.energy[live] >= 0.0).all()
    assert (world.energy[live] <= world.energy_max[live] + EDGE).all()
    assert len(world.area_effects) < 200


def played(make_field: Any, version: str, seed: int, loops: int = LOOPS) -> Any:
    field = make_field(version=version, seed=seed, fog=bool(seed % 2))
    world, rng = field.world, np.random.default_rng(seed)
    for index, name in enumerate(ARMY):
        field.put(name, 1, 3 + 3 * (index % 9), 4 + 4 * (index // 9))
    for index, name in enumerate(FOES):
        field.put(name, 2, 4 + 3 * index, 20)
    for name, x, y in TOWN:
        field.put(name, 1, x, y)
    world.players[1].cheats += ["tech_tree", "cooldown"]
    for player in world.players[1:]:
        player.minerals = player.vespene = 1000.0
    world.energy[world.live] = world.energy_max[world.live]
    for loop in field.loops(loops):
        if loop % ORDERS_EVERY == 0:
            order_somebody(field, rng)
        if loop % 20 == 0:
            assert_sound(world)
    return world


@pytest.mark.parametrize("version", [pytest.param(VERSIONS[0], marks=pytest.mark.slow), *VERSIONS[1:]])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_random_orders_leave_the_world_sound(make_field: Any, version: str, seed: int) -> None:
    assert played(make_field, version, seed).loop == LOOPS


def test_the_same_orders_play_the_same_game(make_field: Any) -> None:
    assert played(make_field, "4.10", 7, 300).digest() == played(make_field, "4.10", 7, 300).digest()
