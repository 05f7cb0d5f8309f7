"""Life cycle: units come into the world, become another type and change hands.

They also go into carriers and come out again, and leave the world. Above: everything that makes units. Below:
``traits``, ``targets``, the world.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from khala_simulator.combat.targets import take_other_weapon
from khala_simulator.combat.traits import check_slot, refresh
from khala_simulator.native import columns, memory
from khala_simulator.numeric import geometry
from khala_simulator.world.columns import INDEX_SHIFT, NOBODY

if TYPE_CHECKING:
    from khala_simulator.native.memory import Cells
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.world import World

TAG_BASE: Final = 1 << 32
FACING: Final = 4.7124  # down, as most units of a map face


def spawn(world: World, unit: UnitType, owner: int, point: tuple[float, float], facing: float = FACING) -> int:
    """Put a complete unit into the world, exactly at ``point``; return its slot."""
    if not 0 <= owner < len(world.players):
        raise IndexError(f"there is no player {owner}")
    slot = _free_slot(world)
    world.clear(slot)
    c = columns.columns_of(world)
    row = unit.row
    stats = world.stats
    at = owner * stats.types + row
    c.alive[slot] = True
    c.tag[slot] = TAG_BASE | slot << INDEX_SHIFT | memory.ints(world.recycles)[slot]
    c.type[slot] = row
    c.owner[slot] = owner
    x, y = point
    c.pos[slot] = c.nav_point[slot] = c.guard[slot] = memory.point(x, y)
    x, y = geometry.heading(facing)
    c.heading[slot] = c.turret[slot] = memory.point(x, y)
    c.born_loop[slot] = world.loop
    c.life[slot] = memory.floats(stats.life_max)[at] if unit.life_start is None else unit.life_start
    c.shields[slot] = memory.floats(stats.shields_max)[at]
    c.energy[slot] = memory.floats(stats.energy_start)[at]
    c.burrowed[slot] = unit.burrowed
    c.contents[slot] = unit.resource_amount
    world.queue[slot] = []
    autocast = _used_by_itself(world.catalog, row)
    if autocast and not unit.passive:
        world.autocast[slot] = autocast
    c.looks_around[slot] = True
    in_sight = not (world.fog or unit.cloaked or unit.burrowed)  # vision refines this
    for player in range(len(world.players)):
        c.visible[player * c.capacity + slot] = in_sight or player == owner
    refresh(world, slot)
    world.stand(slot)
    note_population(world)
    return slot


def _free_slot(world: World) -> int:
    """Return the first free slot, which the world makes room for if there is none."""
    c = columns.columns_of(world)
    for slot in range(1, world.top):
        if not c.alive[slot]:
            return slot
    if world.top == world.capacity:
        world.make_room(2 * world.capacity)
    world.top += 1
    return world.top - 1


def remove(world: World, slot: int) -> None:
    """Take a unit out of the world; every reference to its slot becomes NOBODY."""
    check_slot(world, slot)
    world.clear(slot)
    world.recycles[slot] += 1
    world.queue[slot] = []
    _end_fights_with(world, slot)
    c = columns.columns_of(world)
    _forget(c.attacker, world.top, slot)
    _forget(c.carrier, world.top, slot)
    _forget(c.addon, world.top, slot)
    _forget(c.home, world.top, slot)
    _forget(c.site, world.top, slot)
    _forget(c.patch, world.top, slot)
    _forget(c.occupant, world.top, slot)
    world.buffs.forget(slot)
    for job in world.jobs.pop(slot, ()):
        world.players[job.owner].underway.remove(job.makes)
    world.rallies.pop(slot, None)
    world.invested.pop(slot, None)
    world.timers.pop(slot, None)
    world.autocast.pop(slot, None)
    if world.hurt:
        world.hurt = [pair for pair in world.hurt if slot not in pair]
    for missile in world.missiles:
        missile.shot.forget(slot)
    for hit in world.pending:
        hit.shot.forget(slot)
    for sweep in world.sweeps:
        sweep.forget(slot)
    world.ground.unblock(slot)
    note_population(world)


def _end_fights_with(world: World, slot: int) -> None:
    """End all fights and orders against a unit that goes; workers look again before they end an attack-move."""
    c = columns.columns_of(world)
    for other in range(world.top):
        if c.target[other] == slot:
            c.in_reach[other] = False
            if c.defensive[other]:
                c.scan_loop[other] = 0
    _forget(c.target, world.top, slot)
    _forget(c.order_target, world.top, slot)


def _forget(column: Cells, n: int, slot: int) -> None:
    """Write NOBODY in place of a slot."""
    for other in range(n):
        if column[other] == slot:
            column[other] = NOBODY


def stow(world: World, slot: int, carrier: int) -> None:
    """Take a unit out of the world into a carrier: it lives on, unseen and untouchable."""
    check_slot(world, slot)
    c = columns.columns_of(world)
    c.carrier[slot] = carrier
    c.walks[slot] = c.looks_around[slot] = c.holds[slot] = False
    c.needs_target[slot] = c.casts[slot] = c.channels[slot] = False
    c.wants[slot] = c.in_reach[slot] = False
    world.visible[:, slot] = False
    _end_fights_with(world, slot)
    c.target[slot] = NOBODY
    world.ground.unblock(slot)
    note_population(world)


def unstow(world: World, slot: int, point: tuple[float, float]) -> None:
    """Put a unit from its carrier back into the world."""
    check_slot(world, slot)
    c = columns.columns_of(world)
    x, y = point
    c.carrier[slot] = NOBODY
    c.pos[slot] = c.nav_point[slot] = c.guard[slot] = memory.point(x, y)
    c.looks_around[slot] = True
    c.visible[c.owner[slot] * c.capacity + slot] = True
    world.stand(slot)
    note_population(world)


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
    note_population(world)


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
    note_population(world)


def note_population(world: World) -> None:
    """Note that a unit came, went or changed its type."""
    c = columns.columns_of(world)
    shields = life = energy = mortal = hiding = False
    count = 0
    for slot in range(world.top):
        count += c.alive[slot] and c.carrier[slot] == NOBODY
        shields = shields or c.shield_regen[slot] != 0.0
        life = life or c.life_regen[slot] != 0.0
        energy = energy or c.energy_regen[slot] != 0.0
        mortal = mortal or c.expires[slot] != 0
        hiding = hiding or c.cloaked[slot] or c.burrowed[slot]
    live = memory.new_ints(count)
    count = 0
    for slot in range(world.top):
        if c.alive[slot] and c.carrier[slot] == NOBODY:
            memory.ints(live)[count] = slot
            count += 1
    world.live = live
    world.population += 1
    world.census = world.tally = world.casters = None
    world.scan_now = world.orders_changed = True
    world.regenerating = (shields, life, energy)
    world.mortal = mortal
    world.hiding = hiding
