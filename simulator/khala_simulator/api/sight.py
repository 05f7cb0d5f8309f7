"""What one player perceives of all units at this loop, as columns: the source of every part of an observation.

The rules of perception are here and nowhere else: the side of each unit, what fog and cloak hide, and what is still
known of a hidden unit. Some of the units that a scenario makes, drawn at their birth, come last and in descending
order of their slots: so the order of recorded first observations differs from episode to episode.

Above: `raw.py`, `layers.py`, `ui.py`. Below: the world's columns.
"""

from __future__ import annotations

import dataclasses
import enum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.economy import building_sites
from khala_simulator.native import columns, memory
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some
from khala_simulator.systems import vision
from khala_simulator.systems.vision import are_detected
from khala_simulator.world.columns import INDEX_SHIFT, NOBODY
from khala_simulator.world.orders import OrderKind
from khala_simulator.world.snapshots import RememberedUnit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.maps.heights import Heights
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells, Points
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

API_NEUTRAL = 16
EMPTY_SLOT = 0
PLACEHOLDER_TAG = 3 << 32
OBSERVER = 0  # the player id of a seat that owns nothing and sees everything

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


SELF: Final = Alliance.SELF.value
NEUTRAL: Final = Alliance.NEUTRAL.value
ENEMY: Final = Alliance.ENEMY.value
VISIBLE: Final = Display.VISIBLE.value
HIDDEN: Final = Display.HIDDEN.value
UNKNOWN: Final = Cloak.UNKNOWN.value
CLOAKED: Final = Cloak.CLOAKED.value
DETECTED: Final = Cloak.DETECTED.value
NOT_CLOAKED: Final = Cloak.NOT_CLOAKED.value
ALLIED: Final = Cloak.ALLIED.value
IDLE: Final = OrderKind.IDLE.value
VISIBLE_CELL: Final = 2  # of `World.visibility`


@dataclasses.dataclass(frozen=True, slots=True)
class Sight:
    """The units that a player perceives, one row each; vitals of units that are not seen clearly are 0.

    The memory of each column is contiguous.
    """

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
    sight = _units_seen(world, types, player, show_cloaked, through_fog)
    shown = [] if through_fog else world.memories[player].shown
    if shown:
        sight = _with_snapshots(sight, world, types, player, shown, Display.SNAPSHOT)
    if show_placeholders and (plans := _placeholders(world, player)):
        sight = _with_snapshots(sight, world, types, player, plans, Display.PLACEHOLDER)
    return sight


def _units_seen(world: World, types: Types, player: int, show_cloaked: bool, through_fog: bool) -> Sight:
    """Return the units that a player perceives now."""
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    width, height = world.map.terrain.size
    visibility = memory.uint8s(world.visibility[player])
    fogged = world.fog
    observes = player == OBSERVER
    kept = memory.new_ints(len(live))
    cloaks = memory.new_ints(len(live))
    clears = memory.new_ints(len(live))
    keeps = memory.ints(kept)
    cloak = memory.ints(cloaks)
    clear = memory.ints(clears)
    n = 0
    for last in range(2):
        for i in range(len(live)):
            slot = slots[len(live) - 1 - i if last else i]
            if c.listed_last[slot] != last:
                continue
            own = c.owner[slot] == player and not observes
            hides = _cloak(c, slot, own, observes or c.visible[player * c.capacity + slot])
            seen = (
                not fogged
                or c.owner[slot] == player
                or visibility[vision.cell_at(c.pos[slot], width, height)] == VISIBLE_CELL
            )
            if (seen or through_fog) and (show_cloaked or through_fog or hides != CLOAKED):
                keeps[n] = slot
                cloak[n] = hides if seen else UNKNOWN
                clear[n] = seen and hides != CLOAKED
                n += 1
    return _make_sight(world, types, c, player, kept[:n], cloaks[:n], clear)


def _cloak(c: Columns, slot: int, own: bool, uncovered: bool) -> int:
    """Return what a player knows of the cloak of a unit of its own or another's, if it sees the place."""
    if not c.cloaked[slot] and not (c.burrowed[slot] and not own):
        return NOT_CLOAKED
    if own:
        return ALLIED
    return DETECTED if uncovered else CLOAKED


def _placeholders(world: World, player: int) -> list[RememberedUnit]:
    """Return the structures that the player's builders are on their way to build, with made-up tags."""
    return [
        RememberedUnit(PLACEHOLDER_TAG | i << INDEX_SHIFT, 0, unit.row, player, point, (0.0, -1.0), 0.0)
        for i, (unit, point) in enumerate(building_sites.planned_structures(world, player))
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
    joined = {
        field.name: np.concatenate((known.get(field.name, none).astype(column.dtype), column))
        for field in dataclasses.fields(Sight)
        for column in (getattr(sight, field.name),)
    }
    return Sight(**joined)


def _make_sight(world: World, types: Types, c: Columns, player: int, slot: Ints, cloak: Ints, clear: Cells) -> Sight:
    """Return what a player perceives of these units: how they hide, and which it sees clearly."""
    n = len(slot)
    slots = memory.ints(slot)
    stats = world.stats
    row = _pick_ints(c.type, slots, n)
    owner = _pick_ints(c.owner, slots, n)
    place = memory.new_ints(n)
    rows = memory.ints(row)
    owners = memory.ints(owner)
    places = memory.ints(place)  # in tables (players, types)
    alliance = memory.new_ints(n)
    display = memory.new_ints(n)
    sides = memory.ints(alliance)
    displays = memory.ints(display)
    type_count = len(types.id)
    neutral = API_NEUTRAL
    observes = player == OBSERVER
    for i in range(n):
        places[i] = owners[i] * type_count + rows[i]
        displays[i] = VISIBLE if clear[i] else HIDDEN
        if owners[i] == player and not observes:
            sides[i] = SELF
        else:
            sides[i] = NEUTRAL if owners[i] == 0 else ENEMY
        if owners[i] == 0:
            owners[i] = neutral
    pos = _pick_points(c.pos, slots, n)
    return Sight(
        slot=slot,
        row=row,
        tag=_pick_ints(c.tag, slots, n),
        type_id=_pick_ints(memory.ints(types.id), rows, n),
        owner=owner,
        alliance=alliance,
        display=display,
        cloak=cloak,
        pos=pos,
        z=_heights(world.map.terrain.heights, pos, memory.floats(types.height), rows, n),
        facing=geometry.facing(_pick_points(c.heading, slots, n)),
        radius=_pick_floats(memory.floats(types.radius), rows, n),
        life=_pick_clear(c.life, slots, clear, n),
        life_max=_pick_clear(memory.floats(stats.life_max), places, clear, n),
        shields=_pick_clear(c.shields, slots, clear, n),
        shields_max=_pick_clear(memory.floats(stats.shields_max), places, clear, n),
        energy=_pick_clear(c.energy, slots, clear, n),
        energy_max=_pick_clear(memory.floats(stats.energy_max), places, clear, n),
        build_progress=_pick_floats(c.build_progress, slots, n),
        flying=_pick_bools(memory.bools(types.flying), rows, n),
        burrowed=_pick_bools(c.burrowed, slots, n),
        hallucination=_fakes(world, player, slot, alliance, _pick_bools(c.hallucination, slots, n)),
        active=_active(world, c, slots, clear, n),
    )


def _fakes(world: World, player: int, slot: Ints, alliance: Ints, fakes: Bools) -> Bools:
    """Return (k,) which units the player knows to be hallucinations: its own, and others' under its detectors."""
    if player != OBSERVER and some(fakes):
        foreign = np.flatnonzero(fakes & (alliance != Alliance.SELF.value))
        if foreign.size:
            fakes[foreign] = are_detected(world, player, slot[foreign])
    return fakes


def _active(world: World, c: Columns, slots: Cells, clear: Cells, n: int) -> Bools:
    """Return (n,) which units have an order, fight by themselves, or make something, if they are seen clearly."""
    array = memory.new_bools(n)
    active = memory.bools(array)
    jobs = world.jobs
    makes = bool(jobs)
    for i in range(n):
        slot = slots[i]
        if clear[i]:
            active[i] = c.order_kind[slot] != IDLE or c.target[slot] != NOBODY or (makes and slot in jobs)
    return array


def _heights(heights: Heights, pos: Floats, above: Cells, rows: Cells, n: int) -> Floats:
    """Return (n,) the height of each unit: that of the ground, and how far its type is above it."""
    array = memory.new_floats(n)
    z = memory.floats(array)
    at = memory.points(pos)
    for i in range(n):
        z[i] = heights.at(at[i].x, at[i].y) + above[rows[i]]
    return array


def _pick_clear(column: Cells, at: Cells, clear: Cells, n: int) -> Floats:
    """Return (n,) the numbers at these places of a column, 0 for units that the player does not see clearly."""
    array = memory.new_floats(n)
    found = memory.floats(array)
    for i in range(n):
        found[i] = column[at[i]] * clear[i]
    return array


def _pick_floats(column: Cells, at: Cells, n: int) -> Floats:
    """Return (n,) the numbers at these places of a column."""
    array = memory.new_floats(n)
    found = memory.floats(array)
    for i in range(n):
        found[i] = column[at[i]]
    return array


def _pick_ints(column: Cells, at: Cells, n: int) -> Ints:
    """Return (n,) the numbers at these places of a column."""
    array = memory.new_ints(n)
    found = memory.ints(array)
    for i in range(n):
        found[i] = column[at[i]]
    return array


def _pick_bools(column: Cells, at: Cells, n: int) -> Bools:
    """Return (n,) the values at these places of a column."""
    array = memory.new_bools(n)
    found = memory.bools(array)
    for i in range(n):
        found[i] = column[at[i]]
    return array


def _pick_points(column: Points, at: Cells, n: int) -> Floats:
    """Return (n, 2) the points at these places of a column."""
    array = memory.new_points(n)
    found = memory.points(array)
    for i in range(n):
        found[i] = column[at[i]]
    return array


def _alliance(owner: Ints, own: Bools) -> Ints:
    others = np.where(owner == 0, Alliance.NEUTRAL.value, Alliance.ENEMY.value)
    return np.where(own, Alliance.SELF.value, others)


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
    seen: Bools = inside & (cells == VISIBLE_CELL)
    return seen
