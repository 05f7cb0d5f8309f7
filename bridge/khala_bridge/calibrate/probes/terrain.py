"""Creep and sight: what covers the ground, and what is seen of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.calibrate.cast import known, melee_types
from khala_bridge.calibrate.ground import grid
from khala_bridge.calibrate.lab import LOOPS_PER_SECOND, MOVE, Put
from khala_bridge.calibrate.probe import FOG, Samples, probe

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab

_SEEN: Final = 2
"""Of a cell of the visibility map that is in sight."""
_GENERATE_CREEP: Final = 1692
_WIDE: Final = (34, 34)
_ON_CREEP: Final = ("Queen", "Zergling", "Roach", "Hydralisk", "Ultralisk", "Drone", "Infestor", "Baneling", "Ravager",
                    "SpineCrawlerUprooted", "Marine")  # fmt: skip


def _layer(lab: Lab, name: str) -> NDArray[np.uint8]:
    return grid(getattr(lab.observation.observation.raw_data.map_state, name))


def _cells(layer: NDArray[np.bool_], at: Point, radius: float) -> int:
    ys, xs = np.indices(layer.shape)
    return int((layer & ((xs + 0.5 - at[0]) ** 2 + (ys + 0.5 - at[1]) ** 2 <= radius**2)).sum())


@probe(
    "creep.spread",
    measures="Cells of creep around a new source after so many loops.",
    settles="How fast creep spreads, in which order, and which cells it covers in the end.",
    unit="cells",
    resolution=7.0,
)
def creep(lab: Lab) -> Samples:
    """Make one source of each kind and watch its creep."""
    kinds = known(lab, ("Hatchery", "CreepTumorBurrowed", "NydusCanal", "Overlord"))
    (x, y), *_, (away_x, away_y) = lab.ground.places(*_WIDE)
    at = (int(x) + 0.5, int(y) + 0.5)
    for kind in kinds:
        (tag,) = lab.make(Put(kind, at))
        if kind == "Overlord":
            lab.cheat("tech_tree")
            lab.make(Put("Hatchery", (int(away_x) + 0.5, int(away_y) + 0.5)))  # a player with creep, as in any game
            lab.order(_GENERATE_CREEP, tag)
        begun = lab.loop
        for loops in (32, 100, 200, 400, 800, 1600):
            lab.step(begun + loops - lab.loop)
            yield f"{kind} after {loops}", _cells(_layer(lab, "creep") > 0, at, 16)
        lab.clear()
        _dry(lab, at)


def _dry(lab: Lab, at: Point) -> None:
    for _ in range(60):
        if not _cells(_layer(lab, "creep") > 0, at, 16):
            return
        lab.step(64)


@probe(
    "creep.recede",
    measures="Cells of creep so many loops after its source is gone.",
    settles="How long creep stays, and how fast it recedes.",
    unit="cells",
    resolution=3.0,
)
def recede(lab: Lab) -> Samples:
    """Remove a Hatchery."""
    x, y = lab.ground.places(*_WIDE)[0]
    at = (int(x) + 0.5, int(y) + 0.5)
    (tag,) = lab.make(Put("Hatchery", at))
    lab.step(1600)
    lab.kill(tag)
    begun = lab.loop
    for loops in (32, 100, 200, 400, 800):
        lab.step(begun + loops - lab.loop)
        yield f"after {loops}", _cells(_layer(lab, "creep") > 0, at, 16)
    lab.clear()
    _dry(lab, at)


@probe(
    "creep.speed",
    measures="World units a second on creep, of each Zerg type, and of a Marine.",
    settles="What creep adds to speed.",
    unit="world units/s",
    resolution=0.01,
)
def creep_speed(lab: Lab) -> Samples:
    """Walk along the north of a Hatchery."""
    x, y = lab.ground.places(*_WIDE)[0]
    x, y = int(x) + 0.5, int(y) + 0.5
    lab.make(Put("Hatchery", (x, y)))
    lab.step(1600)
    for kind in known(lab, _ON_CREEP):
        (tag,) = lab.make(Put(kind, (x - 7, y + 4.5)))
        lab.order(MOVE, tag, point=(x + 9, y + 4.5))
        lab.step(16)
        before = lab.at(tag)
        lab.step(16)
        yield kind, math.dist(before, lab.at(tag)) / 16 * LOOPS_PER_SECOND
        lab.kill(tag)
        lab.step()
    lab.clear()
    _dry(lab, (x, y))


@probe(
    "vision.radius",
    measures="Cells that one unit sees on level ground, of each type.",
    settles="Radii of sight, and which cells a circle holds.",
    unit="cells",
    resolution=0.0,
    setting=FOG,
)
def radius(lab: Lab) -> Samples:
    """Put each on the same cell."""
    at = _middle(lab)
    base = None
    for kind in known(lab, melee_types()):
        if base is None:
            lab.step(24)
            base = _layer(lab, "visibility") == _SEEN
        (tag,) = lab.make(Put(kind, at))
        lab.step(20)
        if tag in lab.units:
            yield kind, int(((_layer(lab, "visibility") == _SEEN) & ~base).sum())
        lab.clear()
        lab.step(20)


def _middle(lab: Lab) -> Point:
    """Return the middle of a cell of level ground, as far from our hall as the map allows."""
    x, y = max(
        lab.ground.places(8, 8), key=lambda at: min(math.dist(at, lab.at(tag)) for tag in lab.units if tag in lab.first)
    )
    return int(x) + 0.5, int(y) + 0.5


@probe(
    "vision.moment",
    measures="Loops between two changes of what a unit sees that walks, and a flyer.",
    settles="How often sight is looked over.",
    unit="loops",
    exact=False,
    setting=FOG,
)
def moment(lab: Lab) -> Samples:
    """Compare the map of visibility of each loop with the one before."""
    x, y = _middle(lab)
    for kind in known(lab, ("Reaper", "Phoenix")):
        (tag,) = lab.make(Put(kind, (x - 3, y)))
        lab.order(MOVE, tag, point=(x + 7, y))
        lab.step(8)
        before = _layer(lab, "visibility")
        last = 0
        for loop in range(1, 33):
            lab.step()
            now = _layer(lab, "visibility")
            if (now != before).any():
                if last:
                    yield kind, loop - last
                before, last = now, loop
        lab.clear()


@probe(
    "vision.high_ground",
    measures="Share of the cells within 8 that a unit below a cliff sees on its own level, and on the one above.",
    settles="Who sees up a cliff.",
    unit="share",
    resolution=0.02,
    setting=FOG,
)
def high_ground(lab: Lab) -> Samples:
    """Stand where both levels are near."""
    at, height = _below_a_cliff(lab)
    ys, xs = np.indices(height.shape)
    near = (xs + 0.5 - at[0]) ** 2 + (ys + 0.5 - at[1]) ** 2 <= 64
    own = int(height[int(at[1]), int(at[0])])
    for kind in known(lab, ("Marine", "Colossus", "Medivac", "Reaper")):
        lab.make(Put(kind, at))
        lab.step(20)
        seen = _layer(lab, "visibility") == _SEEN
        for name, cells in (("own level", near & (height == own)), ("above", near & (height >= own + 12))):
            yield f"{kind}, {name}", float(seen[cells].mean()) if cells.any() else 0.0
        lab.clear()
        lab.step(20)


def _below_a_cliff(lab: Lab) -> tuple[Point, NDArray[np.int16]]:
    """Return a place of the level ground with much of a higher level near it, and the heights of the map."""
    height = lab.height.astype(np.int16)
    ys, xs = np.indices(height.shape)
    best = -1
    place = _middle(lab)
    for x, y in lab.ground.places(3, 3):
        own = int(height[int(y), int(x)])
        above = (height >= own + 12) & ((xs - x) ** 2 + (ys - y) ** 2 <= 36)
        if (count := int(above.sum())) > best:
            best = count
            place = (int(x) + 0.5, int(y) + 0.5)
    return place, height


PROBES = (creep, recede, creep_speed, radius, moment, high_ground)
