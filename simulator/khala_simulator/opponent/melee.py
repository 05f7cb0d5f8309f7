"""A computer player of melee games: it mines, keeps supply ahead, builds a few production structures, and attacks.

It acts only through the orders that every player has, reads its own units directly, and remembers only whether it is
attacking. It knows where enemy structures stand. All of this is an estimate: how the game's own computer players play
is not known. Above: ``systems.opponents``. Below: ``casting``, ``commands``, ``building_sites``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import casting, commands
from khala_simulator.economy import building_sites, harvesting, supply
from khala_simulator.economy.harvesting import Phase
from khala_simulator.movement.placement import snapped
from khala_simulator.opponent.levels import level_of
from khala_simulator.opponent.plans import PLANS
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.opponent.levels import Level
    from khala_simulator.opponent.plans import ArmyPlan
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

SUPPLY_AHEAD: Final = 4.0
GAS_WORKERS: Final = 3
NEAREST_SITE, FARTHEST_SITE = 5.0, 16.0  # from the town hall
RETREAT_SHARE: Final = 0.25  # of a wave: with so few left it waits for the next one


class OpponentSide:
    """A view of a player's units."""

    def __init__(self, world: World, player: int) -> None:
        self.world, self.player = world, player
        self.owner = world.players[player]
        self.level: Level = level_of(self.owner.difficulty)
        self.plan: ArmyPlan = PLANS[self.owner.race]
        self.slots: list[int] = world.units_of(player).tolist()
        self.names: dict[int, str] = {slot: world.unit_type(slot).name for slot in self.slots}
        self.halls = [s for s in self.slots if harvesting.is_drop_off(world, s)]
        self.workers = [s for s in self.slots if self.names[s] == self.plan.worker]

    def named(self, *names: str) -> list[int]:
        """Return own units of some types."""
        return [slot for slot in self.slots if self.names[slot] in names]

    def army(self) -> list[int]:
        """Return own units that fight, except workers."""
        world = self.world
        return [
            s for s in self.slots
            if commands.can_attack(world, s) and not world.unit_type(s).structure and s not in self.workers
        ]  # fmt: skip

    def planned(self, name: str) -> int:
        """Return how many of a type exist, are in production, or are ordered."""
        ordered = [order.ability for w in self.workers for order in self.world.orders_of(w)]
        build = self.ability_for(name)
        on_the_way = 0 if build is None else ordered.count(build.id)
        return len(self.named(name)) + self.owner.underway.count(name) + on_the_way

    def ability_for(self, name: str) -> Ability | None:
        """Return the ability that makes units of a type, if the tables have one."""
        ways = self.world.catalog.unit(name).made_by
        found = [self.world.catalog.ability_of_id.get(way.ability) for way in ways if way.kind in ("train", "build")]
        return next((ability for ability in found if ability is not None), None)


def think(world: World, player: int) -> None:
    """Play one turn of a computer player."""
    side = OpponentSide(world, player)
    if not side.slots:
        return
    if side.halls:
        _mine(side)
        if not _keep_supply_ahead(side):
            _train_workers(side)
            _build(side)
    _train_army(side)
    _fight(side)


# economy --------------------------------------------------------------------------------------------------------------


def _mine(side: OpponentSide) -> None:
    world = side.world
    gas = [s for s in side.named(side.plan.gas) if world.build_progress[s] >= 1.0 and world.contents[s] > 0]
    staff = harvesting.assigned(world)
    idle = [w for w in side.workers if world.order_kind[w] == OrderKind.IDLE]
    for structure in gas:
        missing = GAS_WORKERS - int(staff[structure])
        for _ in range(missing):
            worker = idle.pop() if idle else _free_worker(side, world.pos[structure].tolist())
            if worker != NOBODY:
                commands.gather(world, [worker], world.tag_of(structure))
    for worker in idle:
        field = harvesting.another_field(world, worker, world.pos[side.halls[0]])
        if field != NOBODY:
            commands.gather(world, [worker], world.tag_of(field))


def _free_worker(side: OpponentSide, point: list[float]) -> int:
    """Return the nearest worker on its way to minerals, or NOBODY."""
    world = side.world
    fields = harvesting.kinds(world.catalog)[1]
    free = [
        w for w in side.workers
        if world.harvest[w] == Phase.TO_RESOURCE and world.patch[w] != NOBODY and fields[world.type[world.patch[w]]]
    ]  # fmt: skip
    away = {w: float(((world.pos[w] - np.array(point)) ** 2).sum()) for w in free}
    return min(free, key=lambda w: (away[w], w), default=NOBODY)


def _keep_supply_ahead(side: OpponentSide) -> bool:
    """Make more supply when it runs out; return True while that has to come first."""
    world, plan = side.world, side.plan
    cap = supply.cap(world, side.player)
    room = cap - supply.used(world, side.player)
    begun = [s for s in side.named(plan.supply) if world.build_progress[s] < 1.0]
    waiting = side.planned(plan.supply) - len(side.named(plan.supply)) + len(begun)
    if room > SUPPLY_AHEAD or cap >= supply.LIMIT or waiting:
        return False
    if side.owner.race == "zerg":
        return not _train(side, side.named("Larva"), plan.supply)
    return not _raise(side, plan.supply)


def _train_workers(side: OpponentSide) -> None:
    wanted = side.level.workers + GAS_WORKERS * len(side.named(side.plan.gas))
    if side.planned(side.plan.worker) >= wanted:
        return
    makers = side.named("Larva") if side.owner.race == "zerg" else side.halls
    _train(side, [s for s in makers if s not in side.world.jobs], side.plan.worker)


def _train(side: OpponentSide, makers: list[int], name: str) -> bool:
    """Make the first of some units that can train a unit do so."""
    ability = side.ability_for(name)
    if ability is None:
        return False
    able = [s for s in makers if casting.refusal(side.world, s, ability) is ActionResult.SUCCESS]
    return bool(able) and bool(casting.use(side.world, able[:1], ability))


# structures -----------------------------------------------------------------------------------------------------------


def _build(side: OpponentSide) -> None:
    """Raise the next structure of the plan that is missing."""
    plan, level = side.plan, side.level
    producers = 1 if side.owner.race == "zerg" else level.producers
    wanted = [(plan.producer, 1), (plan.gas, min(level.gas, 1))]
    wanted += [(name, 1 if level.gas else 0) for name in plan.tech]
    wanted += [(plan.producer, producers), (plan.gas, level.gas)]
    for name, count in wanted:
        if side.planned(name) < count:
            _raise(side, name)
            return


def _raise(side: OpponentSide, name: str) -> bool:
    """Send a worker to build a structure near the town hall."""
    world, ability = side.world, side.ability_for(name)
    if ability is None or not side.halls:
        return False
    worker = _free_worker(side, world.pos[side.halls[0]].tolist())
    if worker == NOBODY or casting.refusal(world, worker, ability) is not ActionResult.SUCCESS:
        return False
    patch = world.tag_of(int(world.patch[worker]))
    if name == side.plan.gas:
        geyser = _geyser(side)
        taken = geyser != NOBODY and casting.use(world, [worker], ability, target=world.tag_of(geyser))
    else:
        point = site_near(world, side.player, world.catalog.unit(name), side.halls[0])
        taken = point is not None and casting.use(world, [worker], ability, point=point)
    if taken:
        commands.gather(world, [worker], patch, queue=True)
    return bool(taken)


def _geyser(side: OpponentSide) -> int:
    """Return a free geyser of the base, or NOBODY."""
    world, hall = side.world, side.halls[0]
    free = [s for s in world.live.tolist() if building_sites.is_free_geyser(world, s)]
    away = {s: float(np.hypot(*(world.pos[s] - world.pos[hall]))) for s in free}
    near = [s for s in free if away[s] <= MECHANICS.harvest_search]
    return min(near, key=lambda s: (away[s], s), default=NOBODY)


def site_near(world: World, player: int, unit: UnitType, hall: int) -> Point | None:
    """Return the nearest place for a structure around a town hall that keeps the minerals and a way around it free."""
    centre = world.pos[hall]
    footprint = building_sites.footprint_of(world, unit)
    if footprint is None:
        return None
    resources = harvesting.kinds(world.catalog)[1]
    live = world.live
    fields = world.pos[live[resources[world.type[live]]]]
    for dx, dy in _spiral():
        x, y = snapped((float(centre[0] + dx), float(centre[1] + dy)), footprint.size)
        between = fields.size and float(np.hypot(fields[:, 0] - x, fields[:, 1] - y).min()) < NEAREST_SITE
        roomy = not between and _has_margin(world, (x, y), footprint.size)
        if roomy and building_sites.refusal(world, player, unit, (x, y)) is ActionResult.SUCCESS:
            return x, y
    return None


def _has_margin(world: World, point: Point, size: tuple[int, int]) -> bool:
    """Return whether the cells around a place are free, so that units get past."""
    taken = building_sites.taken(world)
    (x, y), (width, height) = point, size
    low_x, low_y = int(x - width / 2) - 1, int(y - height / 2) - 1
    if low_x < 0 or low_y < 0:
        return False
    return not bool(taken[low_y : low_y + height + 2, low_x : low_x + width + 2].any())


def _spiral() -> list[tuple[int, int]]:
    side = range(-int(FARTHEST_SITE), int(FARTHEST_SITE) + 1, 2)
    cells = [(x, y) for x in side for y in side if NEAREST_SITE <= float(np.hypot(x, y)) <= FARTHEST_SITE]
    return sorted(cells, key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell))


# army -----------------------------------------------------------------------------------------------------------------


def _train_army(side: OpponentSide) -> None:
    world = side.world
    for maker in side.named(*side.plan.makers):
        if maker in world.jobs or len(side.workers) < side.level.workers // 2:
            continue
        for name in side.plan.army:
            if _train(side, [maker], name):
                break


def _fight(side: OpponentSide) -> None:
    """Attack with a wave when it is large enough; retreat when hardly any unit is left."""
    world, owner = side.world, side.owner
    army = side.army()
    if len(army) >= side.level.wave and world.loop >= side.level.peace_loops:
        owner.attacking = True
    elif len(army) <= side.level.wave * RETREAT_SHARE:
        owner.attacking = False
    if not owner.attacking:
        return
    idle = [s for s in army if world.order_kind[s] == OrderKind.IDLE and world.target[s] == NOBODY]
    goal = _goal(side)
    if idle and goal is not None:
        commands.attack_move(world, idle, goal)


def _goal(side: OpponentSide) -> Point | None:
    """Return the enemy structure nearest to home, or where an enemy started."""
    world = side.world
    live = world.live
    foes = live[(world.owner[live] != side.player) & (world.owner[live] > 0)]
    stone = np.array([world.unit_type(s).structure for s in foes.tolist()], dtype=np.bool_)
    targets = foes[stone] if stone.any() else foes
    if not targets.size:
        return None
    home = world.pos[side.slots[0]]
    offset = world.pos[targets] - home
    x, y = world.pos[targets[int(np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2))]].tolist()
    return x, y
