"""The world: the whole state of one game as arrays over unit slots.

State and bookkeeping only. ``systems`` has the rules, players' orders come through ``commands``, ``tick`` advances it,
and the API reads it. A slot is the index of a unit in every array; slots of dead units are used again with another tag,
so code that keeps a unit for longer than a loop keeps its tag.

Everything that decides the future is in the state columns, the queues, the shots under way, the players, the random
generator and the loop counter; ``digest`` covers exactly these.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.stats import new_stats
from khala_simulator.world import shots
from khala_simulator.world.active_buffs import ActiveBuffs
from khala_simulator.world.columns import INDEX_SHIFT, NOBODY, SLOT_BITS, Bools, Floats, Ints, UnitColumns
from khala_simulator.world.creep import Creep
from khala_simulator.world.fields import WorldFields
from khala_simulator.world.ground import BuiltGround
from khala_simulator.world.orders import ATTACK, Order, OrderKind, usual_abilities
from khala_simulator.world.players import NEUTRAL, GameResult, PlayerSetup, WorldPlayer
from khala_simulator.world.script_memory import ScriptMemory
from khala_simulator.world.snapshots import FogMemory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.tables.action_result import ActionResult
    from khala_simulator.tables.catalog import Catalog, UnitType
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.jobs import Job
    from khala_simulator.world.shots import Missile, PendingHit, Sweep

__all__ = ["NOBODY", "NO_TAG", "Death", "World"]

NO_TAG: Final = 0
MOST_UNITS: Final = 4_000
"""Units up to which scripts and debug commands fill a world; tags have room for 16 383, and loops are slow by then."""


class Death(NamedTuple):
    """A unit that died: its loop, tag, type and owner, and the killer's owner (-1 for none)."""

    loop: int
    tag: int
    type_id: int
    owner: int
    killer: int


@dataclass(frozen=True, slots=True)
class Mishap:
    """A command that could not be carried out after all: its loop, player, ability, and the reason."""

    loop: int
    player: int
    tag: int
    ability: int
    refusal: ActionResult


@dataclass(frozen=True, slots=True)
class PlayerAlert:
    """An alert to a player: its loop, the player, and its name in the API."""

    loop: int
    player: int
    name: str


@dataclass(frozen=True, slots=True)
class Rally:
    """Where new units are sent: to a unit (tag), or to a point."""

    point: tuple[float, float]
    target: int = NO_TAG


class World(UnitColumns, WorldFields):
    """One running game. The columns have ``capacity`` rows; ``live`` lists the slots in use, ascending.

    The world grows by itself; keep no reference to a column across ``spawn``.
    """

    def __init__(
        self,
        game_map: GameMap,
        players: Sequence[PlayerSetup],
        *,
        seed: int = 0,
        catalog: Catalog | None = None,
        fog: bool = True,
    ) -> None:
        UnitColumns.__init__(self)
        WorldFields.__init__(self)
        self.map: GameMap = game_map
        self.west, self.south, self.east, self.north = map(float, game_map.terrain.playable)
        self.catalog: Catalog = catalog or load_catalog(data=game_map.scenario.data)
        self.seed = seed
        self.rng = np.random.Generator(np.random.PCG64(seed))
        self.loop = 0
        self.players: list[WorldPlayer] = [WorldPlayer(NEUTRAL, "neutral", "none")]
        self.players += [WorldPlayer(p.id, p.race, p.control, p.name, p.difficulty, p.build) for p in players]
        self.usual = usual_abilities(self.catalog)
        self.stats = new_stats(self.catalog, len(self.players))
        self.ground = BuiltGround(game_map.terrain)
        self.fog: bool = fog and game_map.scenario.visibility.fog
        self.visibility: NDArray[np.uint8]  # (players, h, w): 0 never seen, 1 seen before, 2 visible
        width, height = game_map.terrain.size
        never = 0 if game_map.scenario.visibility.black_mask else 1
        self.visibility = np.full((len(self.players), height, width), never if self.fog else 2, dtype=np.uint8)
        self.visible: Bools  # (players, capacity) whether a player sees the unit, cloak and burrow looked at
        self.visible = np.zeros((len(self.players), 0), dtype=np.bool_)
        self.memories = [FogMemory() for _ in self.players]  # each player's memory of what the fog covers
        self.missiles: list[Missile] = []
        self.pending: list[PendingHit] = []
        self.sweeps: list[Sweep] = []
        self.buffs = ActiveBuffs()
        self.area_effects: list[AreaEffect] = []
        self.timers: dict[int, dict[str, float]] = {}  # slot -> cooldown's name -> loop at which it is over
        self.autocast: dict[int, tuple[int, ...]] = {}  # slot -> abilities that it uses by itself
        self.channelling: dict[int, Cast] = {}  # slot -> what goes on since it took effect
        self.mishaps: list[Mishap] = []
        self.alerts: list[PlayerAlert] = []
        self.jobs: dict[int, list[Job]] = {}  # slot -> its products, in order
        self.invested: dict[int, tuple[float, float]] = {}  # slot -> the price paid for its construction
        self.rallies: dict[int, dict[str, Rally]] = {}  # slot -> where its "units" and its "workers" are sent
        self.deaths: list[Death] = []
        self.deaths_seen = 0  # how many of the deaths the triggers have handled
        self.script = ScriptMemory()
        self.watches = game_map.scenario.watches
        self.moments, self.periods = game_map.scenario.moments, game_map.scenario.periods
        self.ended = False
        self.queue: list[list[Order]] = []
        self.live: Ints = np.zeros(0, dtype=np.int64)
        self.recycles: Ints = np.zeros(0, dtype=np.int64)  # how often each slot was used before
        self.top = 1  # slots from here on were never used; slot 0 stays empty, as in the game
        self.growth = Creep(game_map.terrain, self.catalog.version)
        self.scan_now = True  # a unit lost a target or got an order since the last scan
        self.hurt: list[tuple[int, int]] = []  # (victim, attacker) of this loop's damage
        self.make_room(64)

    # units --------------------------------------------------------------------------------------------------------

    @property
    def room(self) -> int:
        """How many more units scripts and debug commands may make."""
        return max(0, MOST_UNITS - int(np.count_nonzero(self.alive)))

    def alert(self, player: int, name: str) -> None:
        """Send a player an alert, by its name in the API."""
        self.alerts.append(PlayerAlert(self.loop, player, name))

    def passengers(self, carrier: int) -> list[int]:
        """Return the slots of the units inside a carrier, ascending."""
        inside: list[int] = which(self.alive & (self.carrier == carrier)).tolist()
        return inside

    def slot_of(self, tag: int) -> int:
        """Return the slot of a living unit with this tag, or NOBODY."""
        slot = tag >> INDEX_SHIFT & SLOT_BITS
        return slot if slot < self.capacity and tag != NO_TAG and self.tag[slot] == tag else NOBODY

    def tag_of(self, slot: int) -> int:
        """Return the tag of the unit in a slot, 0 for NOBODY."""
        return int(self.tag[slot]) if slot >= 0 else NO_TAG

    def unit_type(self, slot: int) -> UnitType:
        """Return the record of the unit's type."""
        return self.catalog.units[int(self.type[slot])]

    def units_of(self, player: int) -> Ints:
        """Return the slots of a player's living units, ascending."""
        result: Ints = self.live[self.owner[self.live] == player]
        return result

    def facing(self) -> Floats:
        """Return (capacity,) API facing of every slot, radians in [0, 2 pi)."""
        return geometry.facing(self.heading)

    def heights(self) -> Floats:
        """Return (len(live),) z of every living unit: the ground's, and its flying height above it."""
        above = np.array([self.catalog.units[row].height for row in self.type[self.live]], dtype=np.float64)
        return self.map.terrain.ground_z(self.pos[self.live]) + above

    def stand(self, slot: int) -> None:
        """Put a structure's footprint on the ground, unless units walk over it."""
        if not self.unit_type(slot).underfoot:
            self.ground.block(slot, self.footprint_cells(slot))

    def footprint_cells(self, slot: int) -> Ints:
        """Return (k, 2) cells ``(x, y)`` that a structure blocks; (0, 2) for others."""
        footprint = self.catalog.footprints.get(self.unit_type(slot).footprint)
        if footprint is None or not footprint.cells:
            return np.zeros((0, 2), dtype=np.int64)
        corner = np.floor(self.pos[slot] + 1e-9).astype(np.int64)
        cells: Ints = corner + _offsets(footprint.cells)
        return cells

    # orders, as values --------------------------------------------------------------------------------------------

    def orders_of(self, slot: int) -> list[Order]:
        """Return the unit's orders, the current one first; empty when it is idle and engages nobody.

        An idle unit that fights by itself shows the attack it makes, as the game does.
        """
        kind = OrderKind(int(self.order_kind[slot]))
        if slot in self.jobs and kind is OrderKind.IDLE:
            return [Order(OrderKind.CAST, job.ability, progress=job.progress) for job in self.jobs[slot]]
        if kind is OrderKind.IDLE:
            fights = self.target[slot] != NOBODY
            return [Order(OrderKind.ATTACK_UNIT, ATTACK, self.tag_of(int(self.target[slot])))] if fights else []
        targeted = kind in (OrderKind.ATTACK_UNIT, OrderKind.FOLLOW) or self.order_target[slot] != NOBODY
        pointless = targeted or kind is OrderKind.HOLD or not self.order_aimed[slot]
        current = Order(
            kind=kind,
            ability=int(self.order_ability[slot]),
            target=self.tag_of(int(self.order_target[slot])) if targeted else NO_TAG,
            point=None if pointless else _point(self.order_point, slot),
            origin=_point(self.order_origin, slot) if kind is OrderKind.PATROL else None,
            progress=self._progress(slot) if kind is OrderKind.CAST else 0.0,
        )
        return [current, *self.queue[slot]]

    def _progress(self, slot: int) -> float:
        """Return the elapsed part of an ability's preparation, 0..1."""
        end, begun = float(self.cast_at[slot]), float(self.cast_begun[slot])
        return min(max((self.loop - begun) / (end - begun), 0.0), 1.0) if end > begun >= 0.0 else 0.0

    # ground -------------------------------------------------------------------------------------------------------

    @property
    def creep(self) -> Bools:
        """(h, w) where there is creep now; a new array whenever that changes."""
        return self.growth.covered

    def on_creep(self, slot: int) -> bool:
        """Return whether the middle of a unit is on creep."""
        x, y = self.pos[slot].tolist()
        return self.growth.covers(x, y)

    # sight --------------------------------------------------------------------------------------------------------

    def is_visible(self, player: int) -> Bools:
        """Return (len(live),) whether ``player`` sees each living unit now; cloak and detection are ignored here."""
        if not self.fog:
            return np.ones(len(self.live), dtype=np.bool_)
        width, height = self.map.terrain.size
        column, row = self.pos[self.live].astype(np.int64).T
        cells = self.visibility[player, np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        seen: Bools = (cells == 2) | (self.owner[self.live] == player)
        return seen

    # result -------------------------------------------------------------------------------------------------------

    def end(self, results: dict[int, GameResult]) -> None:
        """End the game with a result per player id; players without one are undecided."""
        for player in self.players:
            player.result = results.get(player.id, player.result)
        self.ended = True

    # bookkeeping --------------------------------------------------------------------------------------------------

    def digest(self) -> str:
        """Return the SHA-256 of everything that decides the future, the same on every run with the same actions.

        It hashes values as ``repr`` prints them, so the names of their classes, such as ``Job``, are part of it.
        """
        sha = hashlib.sha256(self.map.digest.encode())
        sha.update(repr((self.loop, self.ended, self.scan_now, self.hurt, self.rng.bit_generator.state)).encode())
        sha.update(self.state_bytes(self.top))
        sha.update(self.recycles[: self.top].tobytes())
        sha.update(repr([self.queue[s] for s in self.live.tolist()]).encode())
        sha.update(repr([player.counters() for player in self.players]).encode())
        sha.update(repr(self.script.content()).encode())
        sha.update(shots.content(self.missiles) + shots.content(self.pending) + self.buffs.content())
        sha.update(repr((self.jobs, self.rallies, self.invested)).encode())
        sha.update(repr((self.area_effects, self.timers, self.autocast, self.sweeps)).encode())
        channels = [(c.slot, c.ability.id, c.target, c.begun, c.was) for c in self.channelling.values()]
        sha.update(repr(channels).encode())
        sha.update(self.growth.content())
        sha.update(self.visibility.tobytes())
        sha.update(repr([list(memory.of_unit.values()) for memory in self.memories]).encode())
        return sha.hexdigest()

    def make_room(self, capacity: int) -> None:
        """Make room for so many slots."""
        visible = np.zeros((len(self.players), capacity), dtype=np.bool_)
        visible[:, : self.capacity] = self.visible
        self.visible = visible
        recycles = np.zeros(capacity, dtype=np.int64)
        recycles[: self.capacity] = self.recycles
        self.recycles = recycles
        self.queue += [[] for _ in range(capacity - self.capacity)]
        self.grow(capacity)


@lru_cache(maxsize=256)
def _offsets(cells: tuple[tuple[int, int], ...]) -> Ints:
    """Return the cells of a footprint as an array (k, 2)."""
    return np.array(cells, dtype=np.int64)


def _point(column: Floats, slot: int) -> tuple[float, float]:
    x, y = column[slot].tolist()
    return x, y
