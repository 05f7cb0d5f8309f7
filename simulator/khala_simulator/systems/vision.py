"""Vision: what each player sees, where the map has a fog of war.

The rules: a cell is visible when its centre is within the sight of a unit of the player's and not above the unit's own
cliff level, unless the unit flies. On maps whose script removes the fog every player sees everything. Units that are
cloaked or burrowed are seen where a detector of the player, a scan, or a revealing buff covers them.

The steps of one look, and why they come in this order:

1. ``Eyes.light`` redraws the visibility of cells, every ``VISION_PERIOD`` loops and when a unit came or went.
2. ``_see_units`` writes which units stand on visible cells. Where there is fog it runs in every loop, as units walk in
   and out of the light between two redraws.
3. ``_hide`` takes cloaked units away again from players that do not detect them. It comes after the light, because
   detection can only keep a unit in sight and never shows a dark cell.
4. ``_reveal`` shows units under a revealing buff to the player that applied it, whatever came before.
5. ``fog.remember`` notes structures that went out of sight, after the light of this look.

How cells are counted: ``Eyes`` keeps for each player how many eyes see each cell, and an ``Eye`` of each slot as it was
at the last look. A look takes away the eyes that changed and adds what they are now, so that a unit that stands costs
nothing. Eyes that are no units, such as scans, are a set; its differences are added and taken away in the same way.

To be kept in step by hand: each eye is taken away with the very numbers with which it was added, so these are kept and
never computed again. ``NUMBERS`` is the length of an ``Eye``; ``_write``, ``_differ`` and ``_watch`` each name its five
numbers. Owner 0 is an unused slot or a neutral unit, and counts nothing. ``api.sight`` reads ``cell_at`` as well.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import fog
from khala_simulator.native import columns, memory
from khala_simulator.numeric import geometry
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.world import World

Eye = tuple[int, int, int, float, int]
"""What sees: for which player (0: for nobody), its cell, its radius, and the cliff level from which on it is blind."""

NUMBERS: Final = 5  # of an eye
AIR: Final = Layer.AIR.value
SEEN_BEFORE: Final = 1
VISIBLE: Final = 2
FROM_ABOVE: Final = 1 << 20  # higher than any cliff: nothing hides from it
VISION_PERIOD: Final = MECHANICS.vision_period
HIGH_GROUND_STEP: Final = MECHANICS.high_ground_step


def look(world: World) -> None:
    """Update ``visibility`` and ``visible``; where there is fog or a unit hides, every few loops."""
    changed = world.looked_at != world.population
    fogged = world.fog
    loop = world.loop
    due = changed or loop % VISION_PERIOD == 0
    if not (fogged or changed or (world.hiding and due)):
        return
    if fogged and due:
        _eyes_of(world).light(world)
    _see_units(world, columns.columns_of(world))
    if len(world.buffs):
        _reveal(world)
    if fogged and due:
        for player in range(1, len(world.players)):
            fog.remember(world, player)
    world.looked_at = world.population


def _see_units(world: World, c: Columns) -> None:
    """Write which living units each player sees."""
    live = world.live
    slots = memory.ints(live)
    visibility = memory.uint8s(world.visibility)
    players, height, width = world.visibility.shape
    fogged = world.fog
    hidden = []
    for player in range(players):
        for slot in range(world.top):
            c.visible[player * c.capacity + slot] = False
    for i in range(len(live)):
        slot = slots[i]
        cell = cell_at(c.pos[slot], width, height)
        if c.cloaked[slot]:  # whatever burrows is cloaked until something uncovers it
            hidden.append(slot)
        for player in range(players):
            c.visible[player * c.capacity + slot] = (
                not fogged or c.owner[slot] == player or visibility[player * height * width + cell] == VISIBLE
            )
    if hidden and world.hiding:
        _hide(world, c, hidden)


def _hide(world: World, c: Columns, hidden: list[int]) -> None:
    """Take cloaked units from the sight of players that do not detect them."""
    slots = np.array(hidden, dtype=np.int64)
    for player in range(len(world.players)):
        found = are_detected(world, player, slots)
        is_found = memory.bools(found)
        for i in range(len(hidden)):
            slot = hidden[i]
            if c.owner[slot] != player and not is_found[i]:
                c.visible[player * c.capacity + slot] = False


def are_detected(world: World, player: int, slots: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (k,) whether a detector or a scan of the player reaches each unit's edge."""
    eyes = world.units_of(player)
    eyes = eyes[world.detects[eyes] > 0.0]
    scans = [item for item in world.area_effects if item.detects and item.owner == player]
    at = np.concatenate((world.pos[eyes], np.array([item.at for item in scans]).reshape(-1, 2)))
    reach = np.concatenate((world.detects[eyes], np.array([item.radius for item in scans])))
    offset = world.pos[slots][:, None, :] - at
    near = offset[..., 0] ** 2 + offset[..., 1] ** 2 <= (reach + world.radius[slots, None]) ** 2
    found: NDArray[np.bool_] = near.any(axis=1)
    return found


def _reveal(world: World) -> None:
    """Show units under a revealing buff to the player that applied it."""
    for row in _buffs(world, _revealing(world.catalog)):
        world.visible[int(row["owner"]), int(row["slot"])] = True


def cell_at(point: memory.Point, width: int, height: int) -> int:
    """Return the number of the cell that a point is in, or of the nearest one on the map."""
    x = int(point.x)
    y = int(point.y)
    return min(max(y, 0), height - 1) * width + min(max(x, 0), width - 1)


# light ----------------------------------------------------------------------------------------------------------------


class Eyes:
    """What the players saw with last, and how many eyes see each cell now."""

    def __init__(self, world: World) -> None:
        self._cliffs = world.map.terrain.cliff
        self._cliff = memory.uint16s(self._cliffs)
        self._height, self._width = self._cliffs.shape
        self._counts = np.zeros(world.visibility.shape, dtype=np.int16)  # (players, h, w)
        self._count = memory.int16s(self._counts)
        self._units = np.zeros((0, NUMBERS))  # (slots, 5) an `Eye` each
        self._lights: set[Eye] = set()  # those that are no units

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world looks anew."""
        return type(None), ()

    def light(self, world: World) -> None:
        """Redraw every player's visibility grid; the neutral player sees nothing."""
        self._count_units(world, columns.columns_of(world))
        if world.area_effects or len(world.buffs) or self._lights:
            self._count_lights(world)
        visibility = memory.uint8s(world.visibility)
        count = self._count
        cells = self._height * self._width
        for cell in range(cells, cells * len(world.players)):
            visibility[cell] = VISIBLE if count[cell] > 0 else min(visibility[cell], SEEN_BEFORE)
        for player in world.players[1:]:
            if "show_map" in player.cheats:
                world.visibility[player.id] = VISIBLE

    def _count_units(self, world: World, c: Columns) -> None:
        """Count what the eyes of units see; only those that differ from the last time.

        Most units stand or stay in their cell: with 130 units a side, 10 eyes of 100 change in a look.
        """
        top = world.top
        if len(self._units) < top:
            self._units = np.vstack((self._units, np.zeros((top - len(self._units), NUMBERS))))
        live = world.live
        slots = memory.ints(live)
        units = np.zeros((top, NUMBERS))
        before = memory.floats(self._units)
        now = memory.floats(units)
        for i in range(len(live)):
            self._write(c, slots[i], now)
        for slot in range(top):
            at = NUMBERS * slot
            if _differ(before, now, at):
                self._watch(before, at, -1)
                self._watch(now, at, 1)
        self._units = units

    def _write(self, c: Columns, slot: int, eyes: Cells) -> None:
        """Write the eye of a living unit."""
        at = NUMBERS * slot
        x = int(c.pos[slot].x)
        y = int(c.pos[slot].y)
        level = self._cliff[cell_at(c.pos[slot], self._width, self._height)]
        eyes[at] = c.owner[slot]
        eyes[at + 1] = x
        eyes[at + 2] = y
        eyes[at + 3] = c.sight[slot]
        eyes[at + 4] = FROM_ABOVE if c.layer[slot] == AIR else level + HIGH_GROUND_STEP

    def _count_lights(self, world: World) -> None:
        """Count what the eyes see that are no units; only those that come or go."""
        lights = set(_lights(world))
        for sign, changed in ((1, lights - self._lights), (-1, self._lights - lights)):
            for light in changed:
                eye = np.array(light, dtype=np.float64)
                self._watch(memory.floats(eye), 0, sign)
        self._lights = lights

    def _watch(self, eyes: Cells, at: int, sign: int) -> None:
        """Add every cell that an eye sees, or take it away."""
        owner = int(eyes[at])
        if not owner:
            return
        x = int(eyes[at + 1])
        y = int(eyes[at + 2])
        below = int(eyes[at + 4])
        shape, half = disc(eyes[at + 3])
        inside = memory.bools(shape)
        first = owner * self._height * self._width
        for row in range(max(y - half, 0), min(y + half + 1, self._height)):
            for column in range(max(x - half, 0), min(x + half + 1, self._width)):
                cell = row * self._width + column
                if inside[(row - y + half) * (2 * half + 1) + column - x + half] and self._cliff[cell] < below:
                    self._count[first + cell] += sign


def _eyes_of(world: World) -> Eyes:
    """Return the eyes of a world, which begin to see now if there are none."""
    if world.eyes is None:
        world.eyes = Eyes(world)
    eyes: Eyes = world.eyes  # type: ignore[assignment]  # to the world it is an object
    return eyes


def _differ(eyes: Cells, others: Cells, at: int) -> bool:
    """Return whether two eyes differ."""
    differ: bool = (
        eyes[at] != others[at]
        or eyes[at + 1] != others[at + 1]
        or eyes[at + 2] != others[at + 2]
        or eyes[at + 3] != others[at + 3]
        or eyes[at + 4] != others[at + 4]
    )
    return differ


def _lights(world: World) -> Iterator[Eye]:
    """Yield what players see without a unit there: by area effects and buffs on others."""
    for item in world.area_effects:
        if item.sights:
            x, y = item.at
            yield item.owner, int(x), int(y), item.sights, FROM_ABOVE
    for row in _buffs(world, _lighting(world.catalog)):
        x, y = world.pos[int(row["slot"])].tolist()
        yield int(row["owner"]), int(x), int(y), world.catalog.buffs[int(row["buff"])].lights, FROM_ABOVE


def _buffs(world: World, kinds: Bools) -> NDArray[np.void]:
    """Return the buffs of some kinds."""
    rows = world.buffs.rows
    found: NDArray[np.void] = rows[kinds.take(rows["buff"])]
    return found


@lru_cache(maxsize=4)
def _revealing(catalog: Catalog) -> Bools:
    """Return whether each kind of buff reveals its bearer."""
    return np.array(["revealed" in kind.flags for kind in catalog.buffs])


@lru_cache(maxsize=4)
def _lighting(catalog: Catalog) -> Bools:
    """Return whether each kind of buff lights the ground around its bearer."""
    return np.array([bool(kind.lights) for kind in catalog.buffs])


@lru_cache(maxsize=64)
def disc(radius: float) -> tuple[NDArray[np.bool_], int]:
    """Return the cells within a radius as a square mask, and how far its middle is from its edge."""
    cells = geometry.disc_cells(radius)
    half = int(np.abs(cells).max(initial=0))
    mask = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.bool_)
    mask[cells[:, 1] + half, cells[:, 0] + half] = True
    return mask, half
