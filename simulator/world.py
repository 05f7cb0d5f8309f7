"""The world: the whole state of one game as arrays over unit slots.

State and bookkeeping only. What happens in it is in ``systems``, what players ask of it comes through ``commands``,
``tick`` advances it, and the API reads it. A slot is the index of a unit in every array; slots of dead units are used
again with another tag, so whoever keeps a unit for longer than a loop keeps its tag.

Everything that decides the future lies in the state columns, the queues, the shots under way, the players, the random
generator and the loop counter; ``digest`` covers exactly these.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from simulator import geometry
from simulator.catalog import load_catalog
from simulator.columns import NOBODY, Bools, Floats, Ints, UnitColumns
from simulator.orders import ATTACK, Order, OrderKind
from simulator.pathing import Ground
from simulator.players import NEUTRAL, GameResult, Player, PlayerSetup
from simulator.shots import Missiles, PendingHits
from simulator.stats import Stats
from simulator.traits import body_traits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from simulator.catalog import Catalog, UnitType
    from simulator.maps import GameMap

__all__ = ["NOBODY", "NO_TAG", "Death", "World"]

NO_TAG: Final = 0
TAG_BASE: Final = 1 << 32
INDEX_SHIFT: Final = 18


@dataclass(frozen=True, slots=True)
class Death:
    """A unit that died: at which loop, which tag and type, whose it was, and whose unit did it (-1 nobody's)."""

    loop: int
    tag: int
    type_id: int
    owner: int
    killer: int


class World(UnitColumns):
    """One running game. The columns have ``capacity`` rows; ``live`` lists the slots in use, ascending.

    The world grows by itself; keep no reference to a column across ``spawn``.
    """

    def __init__(
        self, game_map: GameMap, players: Sequence[PlayerSetup], *, seed: int = 0, catalog: Catalog | None = None
    ) -> None:
        super().__init__()
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
        self.orders_changed = True  # somebody got an order, was born or died since orders were last looked over
        self.hurt: list[tuple[int, int]] = []  # (victim, attacker) of this loop's damage
        self.population = 0  # counts births and deaths, for what is worth remembering between them
        self._grow(64)

    # units --------------------------------------------------------------------------------------------------------

    def spawn(self, unit: UnitType, owner: int, point: tuple[float, float], facing: float = 4.7124) -> int:
        """Put a complete unit into the world, exactly at ``point``; returns its slot."""
        slot = self._free_slot()
        self.clear(slot)
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
        self.visible[:, slot] = not (self.fog or unit.cloaked or unit.burrowed)
        self.visible[owner, slot] = True
        self.refresh(slot)
        self.ground.block(slot, self.footprint_cells(slot))
        self._population_changed()
        return slot

    def remove(self, slot: int) -> None:
        """Take a unit out of the world; every reference to its slot becomes NOBODY."""
        self.clear(slot)
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
        targeted = kind in (OrderKind.ATTACK_UNIT, OrderKind.FOLLOW)
        current = Order(
            kind=kind,
            ability=int(self.order_ability[slot]),
            target=self.tag_of(int(self.order_target[slot])) if targeted else NO_TAG,
            point=None if targeted or kind is OrderKind.HOLD else _point(self.order_point, slot),
            origin=_point(self.order_origin, slot) if kind is OrderKind.PATROL else None,
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
        sha.update(repr((self.loop, self.ended, self.scan_now, self.hurt, self.rng.bit_generator.state)).encode())
        sha.update(self.state_bytes(self.top))
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
        self.scan_now = self.orders_changed = True
        shields, life, energy = self.shield_regen, self.life_regen, self.energy_regen
        self.regenerating = bool(shields.any()), bool(life.any()), bool(energy.any())

    def _free_slot(self) -> int:
        free = np.flatnonzero(~self.alive[1 : self.top])
        if free.size:
            return int(free[0]) + 1
        if self.top == self.capacity:
            self._grow(self.capacity * 2)
        self.top += 1
        return self.top - 1

    def _grow(self, capacity: int) -> None:
        visible = np.zeros((len(self.players), capacity), dtype=np.bool_)
        visible[:, : self.capacity] = self.visible
        self.visible = visible
        recycles = np.zeros(capacity, dtype=np.int64)
        recycles[: self.capacity] = self._recycles
        self._recycles = recycles
        self.queue += [[] for _ in range(capacity - self.capacity)]
        self.grow(capacity)


def _point(column: Floats, slot: int) -> tuple[float, float]:
    x, y = column[slot].tolist()
    return x, y
