"""The named places of a map: bases, ramps and passages, numbered by the way from home."""

from __future__ import annotations

import numpy as np
import pytest

from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import Base, MapGround
from khala_bridge.state.ground.atlas import Atlas, atlas_of

HOME, GOAL = WorldPoint(8.5, 16.5), WorldPoint(56.5, 16.5)


def ground(*, gap: int = 7) -> MapGround:
    """Return two halls of 24 x 32 cells with a wall of 16 between them, and a way of some cells through it."""
    walkable = np.zeros((64, 32), np.bool_)
    walkable[:24], walkable[40:] = True, True
    walkable[24:40, 16 - gap // 2 : 16 - gap // 2 + gap] = True
    height = np.full((64, 32), 10.0, np.float32)
    return MapGround(walkable.copy(), walkable, height, (GOAL,))


def with_ramp(gap: int) -> MapGround:
    """Return the same, with a ramp of four cells in the middle of the way."""
    plain = ground(gap=gap)
    buildable, height = plain.buildable.copy(), plain.height.copy()
    buildable[30:34] = False
    height[30:34] = np.linspace(10, 8, 4)[:, None]
    height[34:] = 8.0
    return MapGround(buildable, plain.walkable, height, plain.starts)


def atlas(of: MapGround, *places: WorldPoint) -> Atlas:
    return atlas_of(of, tuple(Base(place, (), ()) for place in places), HOME)


def test_bases_are_numbered_by_the_way_from_home() -> None:
    far, near = WorldPoint(50.5, 5.5), WorldPoint(10.5, 28.5)
    found = atlas(ground(), GOAL, far, near, HOME)
    assert [(one.name, one.at, one.start) for one in found.bases] == [
        ("Base 1", HOME, True), ("Base 2", near, False), ("Base 3", far, False), ("Base 4", GOAL, True),
    ]  # fmt: skip


@pytest.mark.parametrize(("gap", "found"), [(3, [("Passage 1", 3)]), (7, [("Passage 1", 7)]), (20, [])])
def test_the_way_to_the_enemy_has_passages_where_it_is_narrow(gap: int, found: list[tuple[str, int]]) -> None:
    passages = [place for place in atlas(ground(gap=gap), HOME, GOAL).places if place.what == "passage"]
    assert [(place.name, place.width) for place in passages] == found
    assert all(24 <= place.at.x < 40 for place in passages)


def test_a_ramp_is_ground_that_rises_and_takes_no_structures() -> None:
    (ramp,) = [place for place in atlas(with_ramp(5), HOME, GOAL).places if place.what != "base"]
    assert (ramp.name, ramp.what, ramp.at) == ("Ramp 1", "ramp", WorldPoint(32.0, 16.5))


def test_a_flat_patch_without_structures_is_no_ramp() -> None:
    flat = with_ramp(20)
    level = MapGround(flat.buildable, flat.walkable, np.full((64, 32), 10.0, np.float32), flat.starts)
    assert [place for place in atlas(level, HOME, GOAL).places if place.what == "ramp"] == []


def test_a_point_is_at_the_nearest_place_within_half_a_screen() -> None:
    found = atlas(ground(), HOME, GOAL)
    near = found.nearest((12.0, 20.0))
    assert near is not None
    assert near.name == "Base 1"
    assert found.nearest((8.5, 31.0)) is None
