"""What a computer player knows of its own side in one thought, and the money that it has left in it.

Made afresh for every thought. Above: every other module of this package. Below: the world, and ``levels``,
``build_file``.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import building_sites, harvesting, supply
from khala_simulator.economy.requirements import counts_as
from khala_simulator.opponent.build_file import load_race, plan_of, stage_at
from khala_simulator.opponent.levels import FASTER_LOOPS, along, level_of

if TYPE_CHECKING:
    from khala_simulator.opponent.build_file import BuildStage, GamePlan, Race
    from khala_simulator.opponent.levels import OpponentLevel
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.opponent_memory import OpponentMemory
    from khala_simulator.world.world import World

EXACT_S: Final = 120.0
"""Until then all players of a plan do everything at the same time, give or take a few seconds."""


@dataclass(slots=True)
class SidePurse:
    """The money left to spend in this thought; it is negative once more is put aside than there is."""

    minerals: float
    vespene: float
    room: float

    def affords(self, ability: Ability) -> bool:
        """Return whether a player can pay an ability now; money put aside never hinders a free one."""
        enough = self.minerals >= ability.minerals or not ability.minerals
        return enough and (self.vespene >= ability.vespene or not ability.vespene)

    def spend(self, ability: Ability) -> None:
        """Take the price of an ability out."""
        self.minerals -= ability.minerals
        self.vespene -= ability.vespene
        self.room -= ability.supply

    def put_aside(self, ability: Ability) -> None:
        """Keep the price of an ability for later; of minerals only if minerals are missing."""
        if self.minerals < ability.minerals:
            self.minerals -= ability.minerals
        self.vespene -= ability.vespene


class OwnSide:
    """One player's units by what they are, its plan and its money."""

    def __init__(self, world: World, player: int) -> None:
        self.world = world
        self.player = player
        self.owner = world.players[player]
        assert self.owner.mind is not None
        self.mind: OpponentMemory = self.owner.mind
        self.level: OpponentLevel = level_of(self.owner.difficulty)
        self.race: Race = load_race(self.owner.race)
        self.plan: GamePlan = plan_of(self.owner.race, self.level.number, self.mind.build)
        self.slots: Ints = world.units_of(player)
        self.whole: dict[str, list[int]] = {}
        self.begun: dict[str, list[int]] = {}
        for slot, row, done in zip(
            self.slots.tolist(), world.type[self.slots].tolist(), world.build_progress[self.slots].tolist(), strict=True
        ):
            (self.whole if done >= 1.0 else self.begun).setdefault(world.catalog.units[row].name, []).append(slot)
        inside = [at for slot in self.slots.tolist() for at in world.passengers(slot)]
        self.aboard = Counter(world.unit_type(slot).name for slot in inside)  # such as workers in gas structures
        self.used = supply.in_use(world, player)
        self.cap = supply.cap(world, player)
        self.purse = SidePurse(self.owner.minerals, self.owner.vespene, self.cap - self.used)
        self.ordered = self._count_orders()
        self.underway = Counter(self.owner.underway)
        self.kept: set[int] = set()  # structures that train nothing, for an add-on

    # time ---------------------------------------------------------------------------------------------------------

    @property
    def clock_s(self) -> float:
        """Seconds of game time on the clock of its build; a weak player's clock is slow."""
        return self.now_s / (self.level.tempo * self.mind.patience)

    @property
    def now_s(self) -> float:
        """Seconds of game time."""
        return self.world.loop / FASTER_LOOPS

    def due_s(self, at_s: float) -> float:
        """Return when this player does what its plan says for a time: at that time early on, later sooner or later."""
        return at_s + (self.mind.patience - 1.0) * max(0.0, at_s - EXACT_S)

    @cached_property
    def stage(self) -> BuildStage:
        """What its build wants now."""
        return stage_at(self.owner.race, self.mind.build, self.clock_s)

    # units --------------------------------------------------------------------------------------------------------

    def of_type(self, *names: str) -> list[int]:
        """Return own finished units of some types, by slot."""
        return sorted(slot for name in names for slot in self.whole.get(name, ()))

    def kind(self, name: str) -> list[int]:
        """Return own finished units that count as a type: a Warp Gate is a Gateway."""
        return self.of_type(*names_of(self.world.catalog, name))

    def count(self, name: str) -> int:
        """Return how many of a type, or of types that count as it, exist, are being made, or are ordered."""
        names = names_of(self.world.catalog, name)
        exist = sum(len(self.whole.get(n, ())) + len(self.begun.get(n, ())) + self.aboard[n] for n in names)
        return exist + sum(self.underway[n] for n in names if n not in self.begun) + self.ordered[name]

    @cached_property
    def workers(self) -> list[int]:
        """Own workers that are not away as a scout."""
        scout = self.world.slot_of(self.mind.scout)
        return [slot for slot in self.of_type(self.race.worker) if slot != scout]

    @cached_property
    def halls(self) -> list[int]:
        """Own finished town halls on the ground, in the order in which the bases were found."""
        halls = [slot for slot in self.slots.tolist() if harvesting.is_drop_off(self.world, slot)]
        start = np.array(self.owner.start or self.mind.bases[0])
        return sorted(halls, key=lambda s: (float(((self.world.pos[s] - start) ** 2).sum()), s))

    @cached_property
    def army(self) -> list[int]:
        """Own finished units that fight or go with those that fight, except workers, scouts and a drop on its way."""
        world = self.world
        away = {self.mind.scout, self.mind.drop.transport, *self.mind.drop.squad}
        return [
            slot for name, slots in self.whole.items()
            if (unit := world.catalog.unit(name)).army and not unit.uncommandable
            for slot in slots if world.tag_of(slot) not in away and not world.expires[slot]
        ]  # fmt: skip

    @cached_property
    def army_supply(self) -> float:
        """Supply of the army."""
        return sum(self.world.unit_type(slot).supply for slot in self.army)

    @property
    def army_wanted(self) -> float:
        """Army supply that its level and its plan have at this time."""
        return max(along(self.level.army, self.now_s), along(self.plan.army, self.now_s))

    def place(self, slot: int) -> Point:
        """Return where a unit is."""
        x, y = self.world.pos[slot].tolist()
        return x, y

    def is_ours(self, point: Point) -> bool:
        """Return whether a place is nearer to the own start than to the enemy's."""
        return math.dist(point, self.mind.bases[0]) < math.dist(point, self.mind.enemy_start)

    # orders under way ---------------------------------------------------------------------------------------------

    def _count_orders(self) -> Counter[str]:
        """Count what units are on their way to build or to become, and put its price aside if it is not paid yet."""
        world = self.world
        found = Counter[str]()
        for slot in self.slots[world.casts[self.slots]].tolist():
            ability = world.catalog.ability_of_id.get(int(world.order_ability[slot]))
            if ability is None or not ability.unit:
                continue
            found[ability.unit] += 1
            if ability.effect == "build":
                self.purse.spend(ability)
        return found

    def product(self, ability: Ability) -> UnitType | None:
        """Return the structure that an ability builds."""
        return building_sites.product(self.world, ability)


@lru_cache(maxsize=512)
def names_of(catalog: Catalog, name: str) -> tuple[str, ...]:
    """Return the names of the types that count as a type."""
    return tuple(sorted(catalog.units[row].name for row in counts_as(catalog, name, alias=True)))
