"""The compiled writers of units and of the panel write what the message classes do, to the byte."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import numpy as np
import pytest
from s2clientprotocol import raw_pb2

from khala_simulator import compiled
from khala_simulator.api.effects import seen_buffs
from khala_simulator.api.raw import Units
from khala_simulator.api.sight import look
from khala_simulator.api.types import types_of
from khala_simulator.api.ui import multi_panel
from khala_simulator.combat import lifecycle
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
from tests.simulator.engine.random_orders import give_orders

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_simulator.world.world import World

built = pytest.mark.skipif(compiled.engine() == "python", reason="the kernels were not built, or not wanted")


def observations(world: World) -> Iterator[Units]:
    """Return what every player sees of a world, an observer too, with and without fog; half of it is selected."""
    types = types_of(world.catalog.version)
    for player in range(len(world.players)):
        for through_fog in (False, True):
            sight = look(
                world, types, player, show_cloaked=True, show_placeholders=not through_fog, through_fog=through_fog
            )
            half = np.arange(len(sight)) % 2 == 0
            yield Units(world, types, sight, half, ~half, (1.5, 2.25), seen_buffs(world, sight), player)


def add_rarities(world: World) -> None:
    """Give player 1 what such games have not: a detector, and a structure with an add-on."""
    x, y = world.pos[world.units_of(1)[0]].tolist()
    for name in ("Observer", "Barracks", "BarracksTechLab"):
        lifecycle.spawn(world, world.catalog.unit(name), 1, (x, y))
    world.addon[world.units_of(1)[-2]] = world.units_of(1)[-1]


def fields_of_a_game(name: str, loops: int) -> set[str]:
    """Compare every observation of a game with random orders, and return the fields of units that occurred."""
    kernel = compiled.part("units")
    assert kernel is not None
    world, chance, seen = new_game(load_map(name), seed=3), random.Random(3), set()
    for player in world.players[1:]:
        player.cheats += ["tech_tree", "cooldown", "food"]
        player.minerals = player.vespene = 5000.0
    add_rarities(world)
    while world.loop < loops and not world.ended:
        give_orders(world, chance)
        advance(world, 8)
        for units in observations(world):
            raw = raw_pb2.ObservationRaw()
            units.write(raw)
            assert units.encode() == raw.SerializeToString()
            live = world.live.tolist()
            panel = kernel.encode_panel(world, units.types, live, units.player)
            assert panel == multi_panel(world, units.types, live, units.player).SerializeToString()
            seen |= {field.name for unit in raw.units for field, _ in unit.ListFields()}
    return seen


@built
def test_units_of_a_game_are_the_same() -> None:
    seen = fields_of_a_game("llm_pysc2/pvz_task8_level1", 80)
    assert {"orders", "cargo_space_max", "engaged_target_tag", "detect_range", "add_on_tag"} <= seen


@built
@pytest.mark.slow
def test_every_field_of_a_unit_is_the_same() -> None:
    games = ("melee/Simple64", "llm_smac/MMM2", "mini_games/BuildMarines", "llm_pysc2/pvz_task6_level1")
    seen = set().union(*(fields_of_a_game(name, 800) for name in games))
    unknown = {"radar_range"}  # which the simulator does not send
    assert {field.name for field in raw_pb2.Unit.DESCRIPTOR.fields} - seen == unknown
