"""Life cycle: units come into the world, become another type and change hands.

The world manages its slots; this module sets what a new or changed unit starts with. Above: everything that makes
units. Below: ``traits``, ``targets``, the world.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from khala_simulator.combat.targets import take_other_weapon
from khala_simulator.combat.traits import refresh
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.world import World

FACING: Final = 4.7124  # down, as most units of a map face


def spawn(world: World, unit: UnitType, owner: int, point: tuple[float, float], facing: float = FACING) -> int:
    """Put a complete unit into the world, exactly at ``point``; return its slot."""
    slot = world.add(unit, owner, point, facing)
    world.life[slot] = world.stats.life_max[owner, unit.row] if unit.life_start is None else unit.life_start
    world.shields[slot] = world.stats.shields_max[owner, unit.row]
    world.energy[slot] = world.stats.energy_start[owner, unit.row]
    world.burrowed[slot] = unit.burrowed
    world.contents[slot] = unit.resource_amount
    autocast = _used_by_itself(world.catalog, unit.row)
    if autocast and not unit.passive:
        world.autocast[slot] = autocast
    world.looks_around[slot] = True
    world.visible[:, slot] = not (world.fog or unit.cloaked or unit.burrowed)  # vision refines this
    world.visible[owner, slot] = True
    refresh(world, slot)
    world.stand(slot)
    world.population_changed()
    return slot


def become(world: World, slot: int, unit: UnitType) -> None:
    """Change a unit's type: it keeps its tag and place, its share of life, its orders and fights.

    Its autocast settings stay where the new type has the ability.
    """
    old = int(world.type[slot])
    had_energy = bool(world.energy_max[slot] > 0.0)
    share = float(world.life[slot]), float(world.life_max[slot]) or 1.0
    world.type[slot] = unit.row
    world.burrowed[slot] = unit.burrowed
    world.ground.unblock(slot)
    refresh(world, slot)
    world.stand(slot)
    _keep_vitals(world, slot, unit, *share, had_energy=had_energy)
    _keep_autocast(world, slot, old)
    if world.target[slot] != NOBODY:
        take_other_weapon(world, slot)
    world.nav_loop[slot] = 0
    world.population_changed()


def _keep_vitals(world: World, slot: int, unit: UnitType, life: float, life_max: float, *, had_energy: bool) -> None:
    at = int(world.owner[slot]), unit.row
    world.life[slot] = min(life * float(world.life_max[slot]) / life_max, float(world.life_max[slot]))
    world.shields[slot] = min(float(world.shields[slot]), float(world.stats.shields_max[at]))
    energy = float(world.energy[slot] if had_energy else world.stats.energy_start[at])
    world.energy[slot] = min(energy, float(world.stats.energy_max[at]))


def _keep_autocast(world: World, slot: int, old: int) -> None:
    """Keep the unit's autocast settings; abilities that only its new type has are as the tables say."""
    known = {ability.id for ability in world.catalog.cards[old]}
    chosen = world.autocast.pop(slot, ())
    wanted = tuple(
        ability.id
        for ability in world.catalog.cards[int(world.type[slot])]
        if ability.id in chosen or (ability.autocast == "on" and ability.id not in known)
    )
    if wanted:
        world.autocast[slot] = wanted


@lru_cache(maxsize=4096)
def _used_by_itself(catalog: Catalog, row: int) -> tuple[int, ...]:
    """Return the abilities that units of a type use by themselves from the start."""
    return tuple(ability.id for ability in catalog.cards[row] if ability.autocast == "on")


def give(world: World, slot: int, owner: int) -> None:
    """Hand a unit over to another player."""
    world.owner[slot] = owner
    refresh(world, slot)
    world.visible[owner, slot] = True
    world.population_changed()
