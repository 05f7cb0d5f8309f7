"""What one player perceives of all units at this loop, as columns: the source of every part of an observation.

The rules of perception are here and nowhere else: the side of each unit, what fog and cloak hide, and what is still
known of a hidden unit. Rows are in drawing order, ground units before flying ones.

Above: `raw.py`, `layers.py`, `ui.py`. Below: the world's arrays.
"""

from __future__ import annotations

import dataclasses
import enum
from typing import TYPE_CHECKING, Any

import numpy as np

from khala_simulator import compiled
from khala_simulator.economy import building_sites
from khala_simulator.numeric import geometry
from khala_simulator.systems.vision import detected
from khala_simulator.world.orders import OrderKind
from khala_simulator.world.snapshots import INDEX_SHIFT, RememberedUnit
from khala_simulator.world.world import NOBODY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

API_NEUTRAL = 16
EMPTY_SLOT = 0
PLACEHOLDER_TAG = 3 << 32
OBSERVER = 0  # the player id of a seat that owns nothing and sees everything
_VISIBLE_CELL = 2

# Columns are compared with the `value` of an enum: converting the enum itself takes numpy 2 us more each time.


class Alliance(enum.IntEnum):
    """The side of a unit, with the API's numbers."""

    SELF = 1
    ALLY = 2
    NEUTRAL = 3
    ENEMY = 4


class Display(enum.IntEnum):
    """How a unit is perceived, with the API's numbers."""

    VISIBLE = 1
    SNAPSHOT = 2
    HIDDEN = 3
    PLACEHOLDER = 4


class Cloak(enum.IntEnum):
    """What the player knows of a unit's cloak, with the API's numbers."""

    UNKNOWN = 0
    CLOAKED = 1
    DETECTED = 2
    NOT_CLOAKED = 3
    ALLIED = 4


@dataclasses.dataclass(frozen=True, slots=True)
class Sight:
    """The units that a player perceives, one row each; vitals of units that are not seen clearly are 0."""

    slot: Ints
    row: Ints  # unit type, row of the catalog
    tag: Ints
    type_id: Ints
    owner: Ints  # 16 is neutral
    alliance: Ints  # Alliance
    display: Ints  # Display
    cloak: Ints  # Cloak
    pos: Floats  # [n, 2] world
    z: Floats
    facing: Floats
    radius: Floats
    life: Floats
    life_max: Floats
    shields: Floats
    shields_max: Floats
    energy: Floats
    energy_max: Floats
    build_progress: Floats
    flying: Bools
    burrowed: Bools
    hallucination: Bools
    active: Bools

    def __len__(self) -> int:
        return len(self.slot)


def look(
    world: World,
    types: Types,
    player: int,
    *,
    show_cloaked: bool,
    show_placeholders: bool = False,
    through_fog: bool = False,
) -> Sight:
    """Return the units that `player` perceives now; `through_fog` adds those in the fog, as hidden ones."""
    kernel = compiled.part("sight")
    seen = units_seen if kernel is None else kernel.units_seen
    sight: Sight = seen(world, types, player, show_cloaked, through_fog)
    shown = [] if through_fog else world.memories[player].shown
    if shown:
        sight = _with_snapshots(sight, world, types, player, shown, Display.SNAPSHOT)
    if show_placeholders and (plans := _placeholders(world, player)):
        sight = _with_snapshots(sight, world, types, player, plans, Display.PLACEHOLDER)
    return sight


def units_seen(world: World, types: Types, player: int, show_cloaked: bool, through_fog: bool) -> Sight:
    """Return the units that a player perceives now; `compiled.sight` does the same in one pass."""
    seen = world.is_visible(player)
    owner = world.owner[world.live]
    own = (owner == player) & (player != OBSERVER)
    cloak = _cloak(world, player, own)
    undetected = cloak == Cloak.CLOAKED.value
    told = (seen | through_fog) & (show_cloaked | through_fog | ~undetected)
    order = np.argsort(types.flying[world.type[world.live]], kind="stable")
    keep = order[told[order]]
    hidden = (~seen | undetected)[keep]
    known = np.where(seen, cloak, Cloak.UNKNOWN.value)[keep]
    fakes = _fakes(world, player, world.live[keep], own[keep])
    return _columns(world, types, keep, hidden, own[keep], known, fakes)


def _placeholders(world: World, player: int) -> list[RememberedUnit]:
    """Return the structures that the player's builders are on their way to build, with made-up tags."""
    return [
        RememberedUnit(PLACEHOLDER_TAG | i << INDEX_SHIFT, 0, unit.row, player, point, (0.0, -1.0), 0.0)
        for i, (unit, point) in enumerate(building_sites.planned(world, player))
    ]


def _with_snapshots(
    sight: Sight, world: World, types: Types, player: int, shown: list[RememberedUnit], display: Display
) -> Sight:
    """Return the sight with a row for each snapshot before the units; its slot is the empty one."""
    row = np.array([s.row for s in shown])
    owner = np.array([s.owner for s in shown])
    pos = np.array([s.pos for s in shown])
    none = np.zeros(len(shown))
    known: dict[str, NDArray[Any]] = {
        "slot": np.full(len(shown), EMPTY_SLOT),
        "row": row,
        "tag": np.array([s.tag for s in shown]),
        "type_id": types.id[row],
        "owner": np.where(owner == 0, API_NEUTRAL, owner),
        "alliance": _alliance(owner, owner == player),
        "display": np.full(len(shown), display.value),
        "cloak": np.full(len(shown), Cloak.UNKNOWN.value),
        "pos": pos,
        "z": world.map.terrain.ground_z(pos) + types.height[row],
        "facing": geometry.facing(np.array([s.heading for s in shown])),
        "radius": types.radius[row],
        "build_progress": np.array([s.build_progress for s in shown]),
        "flying": types.flying[row],
    }
    columns = {
        field.name: np.concatenate((known.get(field.name, none).astype(column.dtype), column))
        for field in dataclasses.fields(Sight)
        for column in (getattr(sight, field.name),)
    }
    return Sight(**columns)


def _fakes(world: World, player: int, slots: Ints, own: Bools) -> Bools:
    """Return (k,) which units the player knows to be hallucinations: its own, and others' under its detectors."""
    fakes: Bools = world.hallucination[slots]
    foreign = np.flatnonzero(fakes & ~own)
    if foreign.size and player != OBSERVER:
        fakes[foreign] = detected(world, player, slots[foreign])
    return fakes


def _columns(world: World, types: Types, keep: Ints, hidden: Bools, own: Bools, cloak: Ints, fakes: Bools) -> Sight:
    slot = world.live[keep]
    row, owner = world.type[slot], world.owner[slot]
    clear = ~hidden
    pos = world.pos[slot]
    stats = world.stats
    return Sight(
        slot=slot,
        row=row,
        tag=world.tag[slot],
        type_id=types.id[row],
        owner=np.where(owner == 0, API_NEUTRAL, owner),
        alliance=_alliance(owner, own),
        display=np.where(hidden, Display.HIDDEN.value, Display.VISIBLE.value),
        cloak=cloak,
        pos=pos,
        z=world.map.terrain.ground_z(pos) + types.height[row],
        facing=geometry.facing(world.heading[slot]),
        radius=types.radius[row],
        life=world.life[slot] * clear,
        life_max=stats.life_max[owner, row] * clear,
        shields=world.shields[slot] * clear,
        shields_max=stats.shields_max[owner, row] * clear,
        energy=world.energy[slot] * clear,
        energy_max=stats.energy_max[owner, row] * clear,
        build_progress=world.build_progress[slot],
        flying=types.flying[row],
        burrowed=world.burrowed[slot],
        hallucination=fakes,
        active=_active(world)[slot] & clear,
    )


def _active(world: World) -> Bools:
    """Return (capacity,) which units have an order, fight by themselves, or make something."""
    active: Bools = (world.order_kind != OrderKind.IDLE.value) | (world.target != NOBODY)
    if world.jobs:
        active[list(world.jobs)] = True
    return active


def _alliance(owner: Ints, own: Bools) -> Ints:
    others = np.where(owner == 0, Alliance.NEUTRAL.value, Alliance.ENEMY.value)
    return np.where(own, Alliance.SELF.value, others)


def _cloak(world: World, player: int, own: Bools) -> Ints:
    """Return [live] what is known of each unit's cloak, seen or not."""
    hiding = world.cloaked[world.live] | (world.burrowed[world.live] & ~own)
    detected = world.visible[player, world.live] | (player == OBSERVER)
    enemy = np.where(detected, Cloak.DETECTED.value, Cloak.CLOAKED.value)
    return np.where(hiding, np.where(own, Cloak.ALLIED.value, enemy), Cloak.NOT_CLOAKED.value)


def alliance_of(owner: Ints, player: int) -> Ints:
    """Return the side of these owners for a player, as `Alliance`."""
    return _alliance(owner, owner == player)


def sees(world: World, player: int, points: Floats) -> Bools:
    """Return (n,) whether a player sees the ground at world points (n, 2) now; points off the map are not seen."""
    width, height = world.map.terrain.size
    x, y = np.floor(points[:, 0]).astype(np.intp), np.floor(points[:, 1]).astype(np.intp)
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    if not world.fog:
        return inside
    cells = world.visibility[player, np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
    seen: Bools = inside & (cells == _VISIBLE_CELL)
    return seen
