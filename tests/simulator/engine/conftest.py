"""Worlds to test single rules in: flat ground without a script, and units put where a test wants them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.maps.game_map import GameMap, map_from
from khala_simulator.maps.scenario_file import parse_scenario
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import DEFAULT_DATA, DEFAULT_VERSION, DataSet
from khala_simulator.tick import advance
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.players import PlayerSetup
from khala_simulator.world.world import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BARE = """
name: bare
family: test
title: No script
terrain: {terrain}
visibility: {{fog: {fog}, black_mask: {fog}}}
players:
  1: {{race: protoss, control: agent}}
  2: {{race: zerg, control: computer}}
"""

PLAYERS = (PlayerSetup(1, "protoss", "agent"), PlayerSetup(2, "zerg", "computer"))


def bare_map(terrain: str = "agria_open", *, fog: bool = False) -> GameMap:
    text = BARE.format(terrain=terrain, fog=str(fog).lower())
    return map_from(parse_scenario(text, "bare.yaml"), text)


class Field:
    """A world with short names for what tests do to it."""

    fights = True
    """Whether units pick fights by themselves."""

    def __init__(
        self,
        terrain: str = "agria_open",
        *,
        seed: int = 0,
        fog: bool = False,
        version: str = DEFAULT_VERSION,
        data: DataSet = DEFAULT_DATA,
    ) -> None:
        self.world = World(bare_map(terrain, fog=fog), PLAYERS, seed=seed, catalog=load_catalog(version, data))

    def put(self, name: str, owner: int, x: float, y: float, facing: float = 0.0) -> int:
        unit = self.world.catalog.unit(name)
        if unit.structure and unit.needs_creep:
            self._paint_creep(x, y)
        return lifecycle.spawn(self.world, unit, owner, (x, y), facing)

    def still(self, name: str, owner: int, x: float, y: float, energy: float | None = None) -> int:
        """Put a unit that stays where it is and does not fight."""
        slot = self.put(name, owner, x, y)
        buffs.apply(self.world, slot, "LurkerHoldFireB")
        self.world.looks_around[slot] = self.world.flees[slot] = False
        if energy is not None:
            self.world.energy[slot] = energy
        return slot

    def _paint_creep(self, x: float, y: float) -> None:
        """Put creep under the middle of a structure, so that it does not wither."""
        covered = self.world.growth.covered.copy()
        covered[int(y), int(x)] = True
        self.world.growth.covered = covered

    def order(
        self, slot: int, ability: int, target: int | None = None, point: tuple[float, float] | None = None
    ) -> bool:
        """Order a unit (slot) to use an ability (id); return whether it will."""
        tag = 0 if target is None else self.world.tag_of(target)
        number = self.world.catalog.ability(ability)
        return casting.use(self.world, [slot], number, target=tag, point=point) == [slot]

    def why_not(
        self, slot: int, ability: int, target: int = NOBODY, point: tuple[float, float] | None = None
    ) -> ActionResult:
        """Return why a unit can't use an ability like this now."""
        number = self.world.catalog.ability(ability)
        why = casting.refusal(self.world, slot, number)
        return (
            casting.aim_refusal(self.world, Cast(slot, number, target, point)) if why is ActionResult.SUCCESS else why
        )

    def research(self, player: int, *names: str) -> None:
        for name in names:
            commands.grant_upgrade(self.world, player, self.world.catalog.upgrade(name).id)

    def play(self, loops: int) -> World:
        advance(self.world, loops, fights=self.fights)
        return self.world

    def loops(self, count: int) -> Iterator[int]:
        """Play loop by loop; yield the number of each loop after it."""
        for _ in range(count):
            advance(self.world, fights=self.fights)
            yield self.world.loop

    def until(self, holds: Callable[[], object], most: int = 500) -> int:
        """Play until something holds; return the loop at which it does."""
        for loop in self.loops(most):
            if holds():
                return loop
        pytest.fail(f"not within {most} loops")

    def vitals(self, slot: int) -> float:
        return float(self.world.life[slot] + self.world.shields[slot])


@pytest.fixture
def field() -> Field:
    return Field()


@pytest.fixture(scope="session")
def make_field() -> Callable[..., Field]:
    return Field
