"""Production: the first jobs in the queues of structures and eggs progress, and finished products enter the world.

Work passes at the structure's rate (Chrono Boost), not at all in one that is unfinished, stunned or without power.
The next of a queue begins in the loop in which the one before is done, so that births follow each other a loop sooner
than the time of one, as they do in recorded games.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import casting, commands
from khala_simulator.abilities.protoss import carrier
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.economy import production, supply
from khala_simulator.movement import placement
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.jobs import Job
    from khala_simulator.world.world import Rally, World

DOORSTEP: Final = 0.25  # from a structure's edge to the body of the unit that comes out
CONTAMINATED: Final = "Contaminated"
SOUTH: Final = (0.0, -1.0)
STOWED: Final = frozenset({"Nuke"})


def run(world: World) -> None:
    """Advance every queue by one loop, in the order of slots."""
    if not world.jobs:
        return
    for slot in sorted(world.jobs):
        if slot in world.jobs and _works(world, slot):
            _advance(world, slot)


def _works(world: World, slot: int) -> bool:
    able = bool(world.can_act[slot] and world.powered[slot])
    return able and not buffs.has(world, slot, CONTAMINATED)


def _advance(world: World, slot: int) -> None:
    rate = float(world.work_rate[slot])
    at_once = "fast_build" in world.players[int(world.owner[slot])].cheats
    index = 0
    at_work = production.parallel(world, slot)
    while index < at_work and index < len(world.jobs.get(slot, ())):
        job = world.jobs[slot][index]
        if job.begun or _begin(world, slot, job):
            job.done = job.loops if at_once else job.done + rate
        if job.begun and _is_done(world, job):
            finish(world, slot, job)
        else:
            index += 1


def _is_done(world: World, job: Job) -> bool:
    if job.kind != "addon":
        return job.done >= job.loops
    site = world.slot_of(job.site)
    return site == NOBODY or bool(world.build_progress[site] >= 1.0)


def _begin(world: World, slot: int, job: Job) -> bool:
    """Begin a job if supply allows; a waiting one holds up the queue."""
    owner = int(world.owner[slot])
    job.begun = supply.has_room(world, owner, job.supply)
    return job.begun


def finish(world: World, slot: int, job: Job) -> None:
    """Put a job's product into the world."""
    production.drop(world, slot, job)
    FINISH.get(job.kind, _nothing)(world, slot, job)


def _nothing(_: World, __: int, ___: Job) -> None:
    """Do nothing: the structure itself is the product."""


# units ----------------------------------------------------------------------------------------------------------------


def _hatch(world: World, slot: int, job: Job) -> None:
    unit = world.catalog.unit(job.makes)
    parent = world.unit_type(slot)
    owner = int(world.owner[slot])
    rally = rally_of(world, slot, unit)
    born: list[int] = []
    if not parent.structure:
        lifecycle.become(world, slot, unit)
        world.life[slot], world.energy[slot] = world.life_max[slot], world.stats.energy_start[owner, unit.row]
        commands.begin(world, slot, None)
        born = [slot]
    while len(born) < job.count:
        born.append(_put_outside(world, slot, parent, unit, rally))
    for new in born:
        if rally is not None and unit.name not in STOWED:
            casting.smart(world, [new], point=rally.point, target=rally.target)
    name = "NukeComplete" if unit.name in STOWED else "TrainWorkerComplete" if unit.worker else "TrainUnitComplete"
    world.alert(owner, name)


def _put_outside(world: World, slot: int, parent: UnitType, unit: UnitType, rally: Rally | None) -> int:
    """Return a new unit, put before the side of its structure nearest to its rally point, by default the south."""
    x, y = world.pos[slot].tolist()
    across, along = SOUTH
    if rally is not None:
        across, along = rally.point[0] - x, rally.point[1] - y
    length = math.hypot(across, along) or 1.0
    away = (parent.radius_shown + unit.radius + DOORSTEP) / length if parent.structure else 0.0
    place = placement.free_places(world, unit, (x + across * away, y + along * away), 1)[0]
    new = lifecycle.spawn(world, unit, int(world.owner[slot]), place, math.atan2(along, across))
    if unit.name in STOWED:
        lifecycle.stow(world, new, slot)
    return new


def rally_of(world: World, slot: int, unit: UnitType) -> Rally | None:
    """Return where a structure sends a new unit; an egg without a rally point of its own asks the nearest town hall."""
    found = world.rallies.get(slot)
    if found is None and not world.unit_type(slot).structure:
        found = world.rallies.get(_nearest_parent(world, slot))
    if not found:
        return None
    kind = "workers" if unit.worker else "units"
    return found.get(kind) or (None if "units" in found and unit.worker else found.get("units"))


def _nearest_parent(world: World, slot: int) -> int:
    owner = world.owner[slot]
    mine = [s for s in world.rallies if world.owner[s] == owner and world.unit_type(s).makes_creep]
    offset = {s: float(((world.pos[s] - world.pos[slot]) ** 2).sum()) for s in mine}
    return min(mine, key=lambda s: (offset[s], s), default=NOBODY)


# everything else ------------------------------------------------------------------------------------------------------


def _add_interceptor(world: World, slot: int, _: Job) -> None:
    """Put a Carrier's new Interceptor into its hangar at once."""
    carrier.add_interceptor(world, slot)


def _grant_upgrade(world: World, slot: int, job: Job) -> None:
    owner = int(world.owner[slot])
    commands.grant_upgrade(world, owner, world.catalog.upgrade(job.makes).id)
    world.alert(owner, "ResearchComplete")


def _morph(world: World, slot: int, job: Job) -> None:
    unit = world.catalog.unit(job.makes)
    owner = int(world.owner[slot])
    had_energy = bool(world.energy_max[slot])
    lifecycle.become(world, slot, unit)
    if not had_energy:
        world.energy[slot] = world.stats.energy_start[owner, unit.row]
    world.alert(owner, "MorphComplete")


def _connect_addon(world: World, slot: int, job: Job) -> None:
    site = world.slot_of(job.site)
    if site != NOBODY:
        world.addon[slot] = site
        world.alert(int(world.owner[slot]), "AddOnComplete")


FINISH: Final = {
    "addon": _connect_addon,
    "arm": _add_interceptor,
    "train": _hatch,
    "research": _grant_upgrade,
    "structure_morph": _morph,
}
