"""The world: the whole state of one game as arrays over unit slots.

State and bookkeeping only. What happens in it is in ``systems``, what players ask of it comes through ``commands``,
``tick`` advances it, and the API reads it. A slot is the index of a unit in every array; slots of dead units are used
again with another tag, so whoever keeps a unit for longer than a loop keeps its tag.

Everything that decides the future lies in ``COLUMNS``, the queues, the shots under way, the players, the random
generator and the loop counter; ``digest`` covers exactly these. ``TRAITS`` only spare the systems a look-up.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from simulator import geometry
from simulator.catalog import load_catalog
from simulator.orders import ATTACK, Order, OrderKind
from simulator.pathing import Ground
from simulator.players import NEUTRAL, GameResult, Player, PlayerSetup
from simulator.shots import Missiles, PendingHits
from simulator.stats import Stats
from simulator.traits import body_traits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from simulator.catalog import Catalog, UnitType
    from simulator.geometry import Floats
    from simulator.maps import GameMap

NOBODY: Final = -1  # no slot
NO_TAG: Final = 0
TAG_BASE: Final = 1 << 32
INDEX_SHIFT: Final = 18

Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

# name, dtype, width (0 is a plain column), value of an unused slot
COLUMNS: Final[tuple[tuple[str, type, int, float], ...]] = (
    ("alive", np.bool_, 0, 0),
    ("tag", np.int64, 0, 0),
    ("type", np.int64, 0, 0),
    ("owner", np.int64, 0, 0),
    ("pos", np.float64, 2, 0),
    ("heading", np.float64, 2, 0),
    ("speed", np.float64, 0, 0),
    ("life", np.float64, 0, 0),
    ("shields", np.float64, 0, 0),
    ("energy", np.float64, 0, 0),
    ("build_progress", np.float64, 0, 1),
    ("cloaked", np.bool_, 0, 0),
    ("burrowed", np.bool_, 0, 0),
    ("hallucination", np.bool_, 0, 0),
    ("born_loop", np.int64, 0, 0),
    ("damaged_loop", np.int64, 0, -(1 << 30)),
    ("order_kind", np.int64, 0, 0),
    ("order_ability", np.int64, 0, 0),
    ("order_target", np.int64, 0, NOBODY),
    ("order_point", np.float64, 2, 0),
    ("order_origin", np.float64, 2, 0),
    ("target", np.int64, 0, NOBODY),
    ("attacker", np.int64, 0, NOBODY),
    ("scan_loop", np.int64, 0, 0),
    ("guard", np.float64, 2, 0),
    ("returning", np.bool_, 0, 0),
    ("weapon", np.int64, 0, -1),
    ("reach", np.float64, 0, 0),
    ("reach_min", np.float64, 0, 0),
    ("slop", np.float64, 0, 0),
    ("aim_cos", np.float64, 0, -1),
    ("cooldown", np.float64, 0, 0),
    ("windup", np.float64, 0, -1),
    ("backswing", np.float64, 0, 0),
    ("help_loop", np.int64, 0, -(1 << 30)),
    ("nav_point", np.float64, 2, 0),
    ("nav_loop", np.int64, 0, 0),
    ("nav_straight", np.bool_, 0, 0),
    ("nav_end", np.bool_, 0, 0),
    ("blocked", np.int64, 0, 0),
    ("detour", np.int64, 0, 0),
    ("detour_end", np.int64, 0, 0),
    ("aside", np.float64, 2, 0),
)
# What follows from type, owner and upgrades, or is written anew in every loop before it is read.
TRAITS: Final[tuple[tuple[str, type, int, float], ...]] = (
    ("radius", np.float64, 0, 0),
    ("separation", np.float64, 0, 0),
    ("clearance", np.float64, 0, 0),
    ("layer", np.int64, 0, 0),
    ("layer_bits", np.int64, 0, 0),
    ("plane_bits", np.int64, 0, 0),
    ("step_max", np.float64, 0, 0),
    ("step_gain", np.float64, 0, 0),
    ("turn_cos", np.float64, 0, 0),
    ("turn_sin", np.float64, 0, 0),
    ("priority", np.float64, 0, 0),
    ("ground_weapon", np.int64, 0, -1),
    ("air_weapon", np.int64, 0, -1),
    ("ground_scan", np.float64, 0, 0),
    ("air_scan", np.float64, 0, 0),
    ("acquires", np.bool_, 0, 0),
    ("targetable", np.bool_, 0, 0),
    ("walks", np.bool_, 0, 0),
    ("looks_around", np.bool_, 0, 0),
    ("holds", np.bool_, 0, 0),
    ("needs_target", np.bool_, 0, 0),
    ("gap", np.float64, 0, 0),
    ("in_reach", np.bool_, 0, 0),
    ("wants", np.bool_, 0, 0),
    ("goal", np.float64, 2, 0),
    ("stop_at", np.float64, 0, 0),
    ("intended", np.float64, 2, 0),
    ("creep_factor", np.float64, 0, 1),
    ("life_max", np.float64, 0, 0),
    ("life_regen", np.float64, 0, 0),
    ("life_delay", np.float64, 0, 0),
    ("shields_max", np.float64, 0, 0),
    ("shield_regen", np.float64, 0, 0),
    ("shield_delay", np.float64, 0, 0),
    ("energy_max", np.float64, 0, 0),
    ("energy_regen", np.float64, 0, 0),
    ("walled", np.bool_, 0, 0),
)


@dataclass(frozen=True, slots=True)
class Death:
    """A unit that died: at which loop, which tag and type, whose it was, and whose unit did it (-1 nobody's)."""

    loop: int
    tag: int
    type_id: int
    owner: int
    killer: int


class World:
    """One running game. Arrays have ``capacity`` rows; ``live`` lists the slots in use, ascending.

    The world grows by itself; keep no reference to a column across ``spawn``.
    """

    alive: Bools  # (capacity,)
    tag: Ints  # (capacity,) the API's 64-bit tag, 0 where the slot is free
    type: Ints  # (capacity,) row in catalog.units
    owner: Ints  # (capacity,) player id, 0 neutral
    pos: Floats  # (capacity, 2) world units
    heading: Floats  # (capacity, 2) unit vector the body faces
    speed: Floats  # (capacity,) world units per loop, now
    life: Floats  # (capacity,)
    shields: Floats  # (capacity,)
    energy: Floats  # (capacity,)
    build_progress: Floats  # (capacity,) 0..1, 1 is complete
    cloaked: Bools  # (capacity,)
    burrowed: Bools  # (capacity,)
    hallucination: Bools  # (capacity,)
    born_loop: Ints  # (capacity,)
    damaged_loop: Ints  # (capacity,) last loop with damage to it
    order_kind: Ints  # (capacity,) OrderKind
    order_ability: Ints  # (capacity,) specific ability id, 0 when idle
    order_target: Ints  # (capacity,) slot or NOBODY
    order_point: Floats  # (capacity, 2)
    order_origin: Floats  # (capacity, 2) the other end of a patrol
    target: Ints  # (capacity,) slot the weapon is engaged with, or NOBODY
    attacker: Ints  # (capacity,) slot that damaged it last, or NOBODY
    scan_loop: Ints  # (capacity,) loop from which it looks for a target again
    guard: Floats  # (capacity, 2) where an idle unit stood when it engaged somebody by itself
    returning: Bools  # (capacity,) an idle unit that will go back there after the fight
    weapon: Ints  # (capacity,) row of the weapon for that target, or -1
    reach: Floats  # (capacity,) its range, edge to edge
    reach_min: Floats  # (capacity,) and the range below which it can't fire, -inf without one
    slop: Floats  # (capacity,) how far beyond its range a started attack still takes effect
    aim_cos: Floats  # (capacity,) cosine of the largest angle between body and target, -1 for turrets
    cooldown: Floats  # (capacity,) loops until the next attack may start
    windup: Floats  # (capacity,) loops until the started attack takes effect, -1 when none is started
    backswing: Floats  # (capacity,) loops the body stays in the finished attack unless ordered away
    help_loop: Ints  # (capacity,) last loop this unit called for help
    nav_point: Floats  # (capacity, 2) next corner of the path
    nav_loop: Ints  # (capacity,) loop at which the path is looked over again
    nav_straight: Bools  # (capacity,) the straight line to the goal is free
    nav_end: Bools  # (capacity,) no way leads nearer to the goal
    blocked: Ints  # (capacity,) loops without progress in a row
    detour: Ints  # (capacity,) side on which it goes around bodies, -1 right, 1 left, 0 none
    detour_end: Ints  # (capacity,) loop at which it forgets that side
    aside: Floats  # (capacity, 2) heading around bodies, zero when the way itself is free

    radius: Floats  # (capacity,) body for ranges
    separation: Floats  # (capacity,) body for pushing
    clearance: Floats  # (capacity,) body for cliffs
    layer: Ints  # (capacity,) Layer the unit moves on
    layer_bits: Ints  # (capacity,) stats.LAYERS it collides in
    plane_bits: Ints  # (capacity,) planes on which it can be hit
    step_max: Floats  # (capacity,) world units per loop
    step_gain: Floats  # (capacity,) world units per loop, per loop
    turn_cos: Floats  # (capacity,) cosine and
    turn_sin: Floats  # (capacity,) sine of the largest turn per loop
    priority: Floats  # (capacity,) as a target
    ground_weapon: Ints  # (capacity,) row of the weapon against ground units, or -1
    air_weapon: Ints  # (capacity,)
    ground_scan: Floats  # (capacity,) how far it looks for ground targets, edge to edge, -1 without a weapon
    air_scan: Floats  # (capacity,)
    acquires: Bools  # (capacity,) it picks fights by itself
    targetable: Bools  # (capacity,) it may be a target at all
    walks: Bools  # (capacity,) its order is to walk to a point
    looks_around: Bools  # (capacity,) its order lets it pick fights
    holds: Bools  # (capacity,) its order is to stay on the spot
    needs_target: Bools  # (capacity,) its order ends with its target
    gap: Floats  # (capacity,) distance to its target this loop, edge to edge
    in_reach: Bools  # (capacity,) its target is within the weapon's reach this loop
    wants: Bools  # (capacity,) it wants to move this loop
    goal: Floats  # (capacity, 2) and where to
    stop_at: Floats  # (capacity,) distance from the goal, centre to centre, at which it stops
    intended: Floats  # (capacity, 2) the step it takes this loop if nobody is in the way
    creep_factor: Floats  # (capacity,) speed on creep, times the ordinary one
    life_max: Floats  # (capacity,)
    life_regen: Floats  # (capacity,) per loop
    life_delay: Floats  # (capacity,) loops without damage before it begins
    shields_max: Floats  # (capacity,)
    shield_regen: Floats  # (capacity,) per loop
    shield_delay: Floats  # (capacity,)
    energy_max: Floats  # (capacity,)
    energy_regen: Floats  # (capacity,) per loop
    walled: Bools  # (capacity,) it stands on a footprint, which blocks the ground for others

    def __init__(
        self, game_map: GameMap, players: Sequence[PlayerSetup], *, seed: int = 0, catalog: Catalog | None = None
    ) -> None:
        self.map: GameMap = game_map
        self.catalog: Catalog = catalog or load_catalog()
        self.seed = seed
        self.rng = np.random.Generator(np.random.PCG64(seed))
        self.loop = 0
        self.players: list[Player] = [Player(NEUTRAL, "neutral", "none")]
        self.players += [Player(p.id, p.race, p.control, p.name, p.difficulty) for p in players]
        self.stats = Stats(self.catalog, len(self.players))
        self.ground = Ground(game_map.terrain)
        self.fog: bool = game_map.scenario.visibility.fog
        self.visibility: NDArray[np.uint8]  # (players, h, w): 0 never seen, 1 seen before, 2 visible
        width, height = game_map.terrain.size
        never = 0 if game_map.scenario.visibility.black_mask else 1
        self.visibility = np.full((len(self.players), height, width), never if self.fog else 2, dtype=np.uint8)
        self.visible: Bools  # (players, capacity) whether a player sees the unit, cloak and burrow looked at
        self.visible = np.zeros((len(self.players), 0), dtype=np.bool_)
        self.looked_at = -1  # the population that ``visible`` was written for
        self.missiles = Missiles()
        self.pending = PendingHits()
        self.deaths: list[Death] = []
        self.deaths_seen = 0  # how many of the deaths the triggers have been told about
        self.ended = False
        self.queue: list[list[Order]] = []
        self.capacity = 0
        self.live: Ints = np.zeros(0, dtype=np.int64)
        self._recycles: Ints = np.zeros(0, dtype=np.int64)
        self.top = 1  # slots from here on were never used; slot 0 stays empty, as in the game
        self.settled = -1  # the population among which no body touched another when all last stood still
        self.pairs: tuple[Floats, Floats, Floats] | None = None  # collision.pair_table of this population
        self.regenerating = (False, False, False)  # whether anybody regains shields, life, energy
        self.creep_counts = bool(game_map.terrain.creep.any())
        self.fighters: Ints = np.zeros(0, dtype=np.int64)  # slots with a target, as of this loop's measuring
        self.stirred = True  # somebody walked in the last loop
        self.scan_now = True  # somebody lost a target or got an order since the last scan
        self.hurt: list[tuple[int, int]] = []  # (victim, attacker) of this loop's damage
        self.population = 0  # counts births and deaths, for what is worth remembering between them
        self._grow(64)

    # units --------------------------------------------------------------------------------------------------------

    def spawn(self, unit: UnitType, owner: int, point: tuple[float, float], facing: float = 4.7124) -> int:
        """Put a complete unit into the world, exactly at ``point``; returns its slot."""
        slot = self._free_slot()
        for name, _, _, empty in COLUMNS + TRAITS:
            getattr(self, name)[slot] = empty
        self.alive[slot] = True
        self.tag[slot] = TAG_BASE | slot << INDEX_SHIFT | int(self._recycles[slot])
        self.type[slot] = unit.row
        self.owner[slot] = owner
        self.pos[slot] = self.nav_point[slot] = self.guard[slot] = point
        self.heading[slot] = geometry.heading(facing)
        self.life[slot] = self.stats.life_max[owner, unit.row] if unit.life_start is None else unit.life_start
        self.shields[slot] = self.stats.shields_max[owner, unit.row]
        self.energy[slot] = self.stats.energy_start[owner, unit.row]
        self.cloaked[slot], self.burrowed[slot] = unit.cloaked, unit.burrowed
        self.born_loop[slot] = self.loop
        self.queue[slot] = []
        self.looks_around[slot] = True
        self.refresh(slot)
        self.ground.block(slot, self.footprint_cells(slot))
        self._population_changed()
        return slot

    def remove(self, slot: int) -> None:
        """Take a unit out of the world; every reference to its slot becomes NOBODY."""
        for name, _, _, empty in COLUMNS + TRAITS:
            getattr(self, name)[slot] = empty
        self._recycles[slot] += 1
        self.queue[slot] = []
        for column in (self.target, self.order_target, self.attacker):
            column[column == slot] = NOBODY
        self.hurt = [pair for pair in self.hurt if slot not in pair]
        self.missiles.forget(slot)
        self.pending.forget(slot)
        self.ground.unblock(slot)
        self._population_changed()

    def refresh(self, slot: int) -> None:
        """Write the traits of a slot from its type, its owner and the owner's upgrades."""
        body_traits(self, slot)

    def slot_of(self, tag: int) -> int:
        """The slot of a living unit with this tag, or NOBODY."""
        slot = tag >> INDEX_SHIFT & 0x3FFF
        return slot if slot < self.capacity and tag != NO_TAG and self.tag[slot] == tag else NOBODY

    def tag_of(self, slot: int) -> int:
        """The tag of the unit in a slot, 0 for NOBODY."""
        return int(self.tag[slot]) if slot >= 0 else NO_TAG

    def unit_type(self, slot: int) -> UnitType:
        """The record of the unit's type."""
        return self.catalog.units[int(self.type[slot])]

    def units_of(self, player: int) -> Ints:
        """Slots of a player's living units, ascending."""
        result: Ints = self.live[self.owner[self.live] == player]
        return result

    def facing(self) -> Floats:
        """(capacity,) API facing of every slot, radians in [0, 2 pi)."""
        return geometry.facing(self.heading)

    def heights(self) -> Floats:
        """(len(live),) z of every living unit: the ground's, and its flying height above it."""
        above = np.array([self.catalog.units[row].height for row in self.type[self.live]], dtype=np.float64)
        result: Floats = self.map.terrain.ground_z(self.pos[self.live]) + above
        return result

    def footprint_cells(self, slot: int) -> Ints:
        """(k, 2) cells ``(x, y)`` that a structure blocks; (0, 2) for others."""
        footprint = self.catalog.footprints.get(self.unit_type(slot).footprint)
        if footprint is None or not footprint.cells:
            return np.zeros((0, 2), dtype=np.int64)
        corner = np.floor(self.pos[slot] + 1e-9).astype(np.int64)
        cells: Ints = corner + np.array(footprint.cells, dtype=np.int64)
        return cells

    # orders, as values --------------------------------------------------------------------------------------------

    def orders_of(self, slot: int) -> list[Order]:
        """The unit's orders, the current one first; empty when it is idle and engages nobody.

        An idle unit that fights by itself shows the attack it makes, as the game does.
        """
        kind = OrderKind(int(self.order_kind[slot]))
        if kind is OrderKind.IDLE:
            fights = self.target[slot] != NOBODY
            return [Order(OrderKind.ATTACK_UNIT, ATTACK, self.tag_of(int(self.target[slot])))] if fights else []
        x, y = self.order_point[slot]
        ox, oy = self.order_origin[slot]
        targeted = kind in (OrderKind.ATTACK_UNIT, OrderKind.FOLLOW)
        current = Order(
            kind=kind,
            ability=int(self.order_ability[slot]),
            target=self.tag_of(int(self.order_target[slot])) if targeted else NO_TAG,
            point=None if targeted or kind is OrderKind.HOLD else (float(x), float(y)),
            origin=(float(ox), float(oy)) if kind is OrderKind.PATROL else None,
        )
        return [current, *self.queue[slot]]

    # sight --------------------------------------------------------------------------------------------------------

    def is_visible(self, player: int) -> Bools:
        """(len(live),) whether ``player`` sees each living unit now; cloak and detection are not looked at here."""
        if not self.fog:
            return np.ones(len(self.live), dtype=np.bool_)
        cells = self.pos[self.live].astype(np.int64)
        width, height = self.map.terrain.size
        x, y = np.clip(cells[:, 0], 0, width - 1), np.clip(cells[:, 1], 0, height - 1)
        seen: Bools = (self.visibility[player, y, x] == 2) | (self.owner[self.live] == player)
        return seen

    # result -------------------------------------------------------------------------------------------------------

    def end(self, results: dict[int, GameResult]) -> None:
        """End the game with a result per player id; players without one are undecided."""
        for player in self.players:
            player.result = results.get(player.id, player.result)
        self.ended = True

    # bookkeeping --------------------------------------------------------------------------------------------------

    def digest(self) -> str:
        """SHA-256 over everything that decides the future, the same on every run with the same actions."""
        sha = hashlib.sha256(self.map.digest.encode())
        sha.update(repr((self.loop, self.ended, self.rng.bit_generator.state)).encode())
        for name, _, _, _ in COLUMNS:
            sha.update(np.ascontiguousarray(getattr(self, name)[: self.top]).tobytes())
        sha.update(self._recycles[: self.top].tobytes())
        sha.update(repr([self.queue[s] for s in self.live.tolist()]).encode())
        sha.update(repr([player.counters() for player in self.players]).encode())
        sha.update(self.missiles.content() + self.pending.content())
        sha.update(self.visibility.tobytes())
        return sha.hexdigest()

    def _population_changed(self) -> None:
        self.live = np.flatnonzero(self.alive)
        self.population += 1
        self.pairs = None
        self.scan_now = True
        self.regenerating = tuple(
            bool(rate[: self.top].any()) for rate in (self.shield_regen, self.life_regen, self.energy_regen)
        )

    def _free_slot(self) -> int:
        free = np.flatnonzero(~self.alive[1 : self.top])
        if free.size:
            return int(free[0]) + 1
        if self.top == self.capacity:
            self._grow(self.capacity * 2)
        self.top += 1
        return self.top - 1

    def _grow(self, capacity: int) -> None:
        for name, dtype, width, empty in COLUMNS + TRAITS:
            shape: Any = (capacity, width) if width else capacity
            column = np.full(shape, empty, dtype=dtype)
            if self.capacity:
                column[: self.capacity] = getattr(self, name)
            setattr(self, name, column)
        visible = np.zeros((len(self.players), capacity), dtype=np.bool_)
        visible[:, : self.capacity] = self.visible
        self.visible = visible
        recycles = np.zeros(capacity, dtype=np.int64)
        recycles[: self.capacity] = self._recycles
        self._recycles = recycles
        self.queue += [[] for _ in range(capacity - self.capacity)]
        self.capacity = capacity
