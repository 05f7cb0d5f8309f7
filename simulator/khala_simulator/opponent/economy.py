"""The economy: which workers mine where, supply ahead of production, and new workers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import construction, harvesting, supply
from khala_simulator.opponent import hands, products
from khala_simulator.opponent.levels import along
from khala_simulator.opponent.products import MakeOutcome
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.opponent.side import OwnSide

GAS_WORKERS: Final = 3
MOVED_AT_ONCE: Final = 4
"""How many workers change to another base in one thought."""
GAS_ENOUGH: Final = 200.0
"""With so much vespene unspent, and fewer minerals, gas structures get one worker only."""
AHEAD_S: Final = 22.0
"""Supply is made for so many seconds of production ahead; a Pylon takes 18, a Supply Depot 21."""
A_WORKER_S: Final = 12.0
A_SUPPLY_S: Final = 13.5
"""A worker takes so long, and a producer for each supply of its units."""
LARVAE: Final = (0.12, 0.15)
"""Supply a second of what the larvae of a Hatchery become, and of those that a Queen adds."""
MANY: Final = 800.0
"""With so many minerals unspent, larvae have piled up that will be used at once."""
NEARLY: Final = 0.7
"""A town hall takes 71 seconds, so AHEAD_S before it is there this part of it is done."""
MOST_WORKERS: Final = 72
SPARSE: Final = 4
"""A base that wants so few workers on its minerals is mined out."""


class Staff:
    """How many workers each town hall and gas structure has, and wants."""

    def __init__(self, side: OwnSide) -> None:
        found = harvesting.staffing(side.world, side.player)
        self.halls = {hall: list(found[hall]) for hall in side.halls if hall in found}
        self.gas = {slot: list(count) for slot, count in found.items() if slot not in self.halls and count[1]}

    @property
    def places(self) -> int:
        """How many workers all of them want."""
        return sum(ideal for _, ideal in self.halls.values()) + GAS_WORKERS * len(self.gas)


def mine(side: OwnSide, staff: Staff) -> None:
    """Send idle workers to work, fill the gas structures, and even the bases out."""
    world = side.world
    pulled = set(map(world.slot_of, side.mind.pulled))
    idle = [w for w in side.workers if int(world.order_kind[w]) == OrderKind.IDLE and w not in pulled]
    for site in _abandoned_sites(side):
        if idle:
            hands.smart(side, [idle.pop()], world.tag_of(site))
    for worker in idle:
        if not _to_minerals(side, staff, worker):
            return
    _fill_gas(side, staff)
    _even_out(side, staff)


def _abandoned_sites(side: OwnSide) -> list[int]:
    """Return unfinished structures that only go on with a builder, and that have none."""
    world = side.world
    halted = [s for slots in side.begun.values() for s in slots if not world.self_made[s]]
    building = {int(world.order_target[w]) for w in side.workers if int(world.order_kind[w]) == OrderKind.FOLLOW}
    return [s for s in halted if s not in building and construction.builder_of(world, s) == NOBODY]


def _to_minerals(side: OwnSide, staff: Staff, worker: int) -> bool:
    """Send a worker to the nearest base with room, or to the nearest one."""
    world = side.world
    if not staff.halls:
        return False
    x, y = side.place(worker)
    hall = min(
        staff.halls,
        key=lambda h: (staff.halls[h][0] >= staff.halls[h][1], float(np.hypot(*(world.pos[h] - (x, y)))), h),
    )
    field = harvesting.another_field(world, worker, world.pos[hall])
    if field == NOBODY:
        return False
    staff.halls[hall][0] += 1
    return hands.gather(side, [worker], world.tag_of(field))


def _fill_gas(side: OwnSide, staff: Staff) -> None:
    world = side.world
    plenty = side.owner.vespene > GAS_ENOUGH and side.owner.minerals < side.owner.vespene
    wanted = 1 if plenty else GAS_WORKERS
    for gas, (assigned, _) in sorted(staff.gas.items()):
        if assigned > wanted and plenty:
            worker = next((w for w in side.workers if world.patch[w] == gas and not world.load[w]), NOBODY)
            if worker != NOBODY and world.carrier[worker] == NOBODY:
                _to_minerals(side, staff, worker)
        for _ in range(wanted - assigned):
            worker = products.free_worker(side, side.place(gas))
            if worker == NOBODY or not hands.gather(side, [worker], world.tag_of(gas)):
                return


def _even_out(side: OwnSide, staff: Staff) -> None:
    """Send workers from bases with too many to one with too few."""
    world = side.world
    room = [h for h, (assigned, ideal) in staff.halls.items() if assigned < ideal]
    full = [h for h, (assigned, ideal) in staff.halls.items() if assigned > ideal + 1]
    if not room or not full:
        return
    there = room[0]
    for _ in range(min(MOVED_AT_ONCE, staff.halls[full[0]][0] - staff.halls[full[0]][1])):
        worker = products.free_worker(side, side.place(full[0]))
        field = harvesting.another_field(world, worker, world.pos[there]) if worker != NOBODY else NOBODY
        if field == NOBODY or not hands.gather(side, [worker], world.tag_of(field)):
            return


# supply and workers ---------------------------------------------------------------------------------------------------


def keep_supply_ahead(side: OwnSide) -> None:
    """Make more supply before it runs out, once the first one of the plan is due."""
    name = side.race.supply
    first = side.plan.opening[0]
    if first.what == name and side.now_s < first.at_s:
        return
    provides = side.world.catalog.unit(name).provides
    coming = provides * (side.count(name) - len(side.kind(name)))
    hall = side.world.catalog.unit(side.race.hall).provides
    coming += hall * sum(side.world.build_progress[s] >= NEARLY for s in side.begun.get(side.race.hall, ()))
    soon = side.cap + coming
    if soon >= supply.LIMIT or soon - side.used > _ahead(side):
        return
    products.make(side, name)


def _ahead(side: OwnSide) -> float:
    """Return the supply that the side can use up before more is there."""
    makers = len(side.kind(side.race.producer)) + sum(len(side.kind(n)) for n in ("Factory", "Starport"))
    makers += sum(len(side.kind(n)) for n in ("RoboticsFacility", "Stargate"))
    a_second = len(side.halls) / A_WORKER_S + makers / A_SUPPLY_S
    if side.owner.race == "zerg":
        halls = len(side.halls)
        queens = min(len(side.halls), len(side.of_type("Queen")))
        a_second = halls * LARVAE[0] + queens * LARVAE[1] + halls * min(side.owner.minerals, MANY) / MANY / A_WORKER_S
    return 1.0 + AHEAD_S * a_second


def train_workers(side: OwnSide, staff: Staff) -> None:
    """Make workers until there are as many as wanted."""
    name = side.race.worker
    most = workers_wanted(side, staff)
    while side.count(name) < most:
        if products.make(side, name) is not MakeOutcome.DONE:
            return


def workers_wanted(side: OwnSide, staff: Staff) -> float:
    """Return how many workers a side wants: what its level wants for each base, held or limited early by its plan."""
    if side.now_s < side.plan.hold_s:
        return side.level.hold
    begun = len(side.begun.get(side.race.hall, ()))
    most = min(MOST_WORKERS, side.level.workers * (len(staff.halls) - mined_out(staff)) + side.level.site * begun)
    return min(most, along(side.plan.workers, side.now_s)) if side.plan.workers else most


def mined_out(staff: Staff) -> int:
    """Return how many bases have nearly no minerals left."""
    return sum(ideal <= SPARSE for _, ideal in staff.halls.values())
