from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from khala_simulator.abilities import commands


def test_without_fog_everybody_sees_everything(field: Any) -> None:
    world = field.world
    field.put("Zealot", 1, 2, 2)
    far = field.put("Zealot", 2, 30, 30)
    field.play(1)
    assert (world.visibility == 2).all()
    assert world.visible[1, far]
    assert world.is_visible(1).all()


def test_in_the_fog_a_unit_sees_the_cells_within_its_sight(make_field: Any) -> None:
    field = make_field(fog=True)
    world = field.world
    field.put("Zealot", 1, 16.5, 16.5)
    field.play(4)
    seen = world.visibility[1] == 2
    y, x = np.nonzero(seen)
    assert np.sqrt((x - 16) ** 2 + (y - 16) ** 2).max() == 9
    assert seen.sum() == pytest.approx(math.pi * 81, rel=0.05)
    assert set(np.unique(world.visibility[1]).tolist()) == {0, 2}
    assert (world.visibility[2] == 0).all()


def test_what_was_seen_stays_remembered(make_field: Any) -> None:
    field = make_field(fog=True)
    world = field.world
    zealot = field.put("Zealot", 1, 4.5, 16.5)
    field.play(4)
    assert world.visibility[1, 16, 4] == 2
    commands.move(world, [zealot], (28, 16.5))
    field.play(200)
    assert world.visibility[1, 16, 4] == 1
    assert world.visibility[1, 16, 28] == 2


def test_an_enemy_in_the_fog_is_not_seen_and_not_engaged(make_field: Any) -> None:
    field = make_field(fog=True)
    world = field.world
    marine, spotter = field.put("SiegeTankSieged", 1, 4, 16), field.put("Observer", 1, 4, 30)
    foe = field.put("Zergling", 2, 16.5, 16)  # in the tank's range of 13, beyond its sight of 11
    world.acquires[foe] = False
    field.play(12)
    assert not world.visible[1, foe]
    assert world.target[marine] == -1
    commands.move(world, [spotter], (14, 20))
    field.play(160)
    assert world.life[foe] < 35 or not world.alive[foe]


def test_a_ground_unit_does_not_see_up_a_cliff_and_a_flyer_does(make_field: Any) -> None:
    for name, sees in (("Zergling", False), ("Overlord", True)):
        field = make_field("braxis_ledge", fog=True)
        world = field.world
        field.put(name, 2, 16, 10)
        up = field.put("Stalker", 1, 16, 15)
        field.play(4)
        assert bool(world.visible[2, up]) is sees


def test_from_the_cliff_one_sees_down(make_field: Any) -> None:
    field = make_field("braxis_ledge", fog=True)
    world = field.world
    down = field.put("Zergling", 2, 16, 10)
    field.put("Stalker", 1, 16, 15)
    field.play(4)
    assert world.visible[1, down]


def test_a_cloaked_unit_is_seen_by_its_owner_only(field: Any) -> None:
    world = field.world
    templar = field.put("DarkTemplar", 1, 16, 16)
    field.put("Zealot", 2, 20, 28)
    field.play(1)
    assert world.visible[1, templar]
    assert not world.visible[2, templar]
