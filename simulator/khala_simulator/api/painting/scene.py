"""The screen: what the camera shows, painted from the ground up.

In order: ground and fog, effects on the ground, units from below to above, shots, effects that hang over the units,
bars. Above: `render.py`. Below: `ground.py`, `sprites.py`, `weather.py`, `marks.py`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from khala_simulator.api.effects import BLIP_RADIUS, blips, seen_buffs
from khala_simulator.api.painting import marks, palette, weather
from khala_simulator.api.painting.ground import PaintedGround
from khala_simulator.api.painting.silhouettes import Class, class_of
from khala_simulator.api.painting.sprites import DIRECTIONS, SpriteLook, wardrobe
from khala_simulator.api.shots import in_flight, strikes
from khala_simulator.api.sight import Alliance, Cloak, Display

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.layers import Frame
    from khala_simulator.api.painting.marks import Point
    from khala_simulator.api.painting.palette import Colour
    from khala_simulator.api.projection import ScreenView
    from khala_simulator.api.types import Types
    from khala_simulator.tables.records import UnitType

    Image = NDArray[np.uint8]

GRID_FROM = 5.0
"""Pixels per cell from which the cells are shown."""
SPARK_LOOPS = 2
MOST_PIPS = 4
TAIL = 0.6
"""World units that a missile draws behind it."""
TINY, SMALL, TALL = 4.2, 6.0, 30.0
"""Radius in pixels below which bars show only damage and construction, without a border; below which bars are one pixel
high; and from which they are three."""
BARE = frozenset({Class.MINERALS, Class.GEYSER, Class.ROCKS, Class.BARRIER})
"""Classes that have no bars until they are damaged."""


class DrawnUnit(NamedTuple):
    """One unit on the screen, in pixels."""

    row: int  # of the sight
    x: float
    y: float
    radius: float


class ScenePainter:
    """Paints the screen of one client; keeps the ground under the camera and the sprites it has used."""

    def __init__(self, screen: ScreenView, types: Types) -> None:
        self._screen, self._types = screen, types
        self._scale = 1 / screen.scale
        self._wardrobe = wardrobe(types.catalog, self._scale)
        self._level = np.array([_level(unit) for unit in types.catalog.units])
        self._bare = np.array([class_of(unit) in BARE for unit in types.catalog.units])
        self._ground = PaintedGround(screen.columns, screen.rows, self._scale, grid=self._scale >= GRID_FROM)

    def paint(self, frame: Frame) -> Image:
        """Return the image of this frame."""
        screen = self._screen
        image = self._ground.paint(frame.world, frame.player, screen.view(frame.camera), fog=frame.fogged)
        actors = self._actors(frame)
        sky = weather.paint_below(image, frame, screen)
        self._units(image, frame, actors)
        self._blips(image, frame)
        self._shots(image, frame)
        weather.paint_above(image, frame, screen, sky)
        self._bars(image, frame, actors)
        self._buffs(image, frame, actors)
        return image

    def _actors(self, frame: Frame) -> list[DrawnUnit]:
        """Return the units in view in drawing order, from below to above, the larger ones first."""
        sight, screen = frame.sight, self._screen
        x, y = screen.to_pixels(sight.pos[:, 0], sight.pos[:, 1], frame.camera)
        radius = sight.radius * self._scale
        margin = radius * 2 + 4
        near = (x > -margin) & (x < screen.columns + margin) & (y > -margin) & (y < screen.rows + margin)
        layer = self._level[sight.row]
        rows = np.flatnonzero(near)
        rows = rows[np.lexsort((-radius[rows], layer[rows]))]
        columns = (rows, x[rows], y[rows], radius[rows])
        return [DrawnUnit(*values) for values in zip(*(column.tolist() for column in columns), strict=True)]

    # units ------------------------------------------------------------------------------------------------------------

    def _units(self, image: Image, frame: Frame, actors: list[DrawnUnit]) -> None:
        looks = self._looks(frame)
        selected = frame.selected.tolist()
        for actor in actors:
            if selected[actor.row]:
                width = 1 + (actor.radius > TALL)
                marks.ring(image, (actor.x, actor.y), actor.radius * 1.18 + 1.5, palette.SELECTED, width)
        for actor in actors:
            self._wardrobe.sprite(looks[actor.row]).stamp(image, int(actor.x), int(actor.y))

    def _looks(self, frame: Frame) -> list[SpriteLook]:
        """Return the look of each unit of the sight."""
        sight = frame.sight
        turn = np.round(sight.facing * (DIRECTIONS / (2 * math.pi))).astype(np.int64) % DIRECTIONS
        turn *= ~self._types.structure[sight.row]
        veiled = (sight.cloak != Cloak.NOT_CLOAKED.value) | (sight.display != Display.VISIBLE.value)
        veiled |= sight.hallucination | sight.burrowed
        sides = palette.sides(sight.owner, sight.alliance, frame.player)
        columns = (sight.row, sides, turn, veiled, sight.build_progress < 1)
        return list(map(SpriteLook._make, zip(*(column.tolist() for column in columns), strict=True)))

    def _blips(self, image: Image, frame: Frame) -> None:
        """Draw dark discs without a type where radar detects a unit."""
        for point in blips(frame.world, self._types, frame.player):
            x, y = self._pixel(frame, point)
            marks.dot(image, (x, y), BLIP_RADIUS * self._scale, palette.BLIP)

    # shots ------------------------------------------------------------------------------------------------------------

    def _shots(self, image: Image, frame: Frame) -> None:
        sight, world = frame.sight, frame.world
        attacker, target, melee = strikes(world, sight)
        if len(attacker):
            self._beams(image, frame, attacker[~melee], target[~melee])
        hurt = (world.loop - world.damaged_loop[sight.slot] <= SPARK_LOOPS) & (sight.display == Display.VISIBLE.value)
        for row in np.flatnonzero(hurt).tolist():
            size = max(1.5, sight.radius[row] * self._scale * 0.42)
            marks.spark(image, self._pixel(frame, sight.pos[row]), size, int(sight.slot[row]) + world.loop)
        self._missiles(image, frame)

    def _missiles(self, image: Image, frame: Frame) -> None:
        shown = in_flight(frame.world, frame.player, through_fog=not frame.fogged)
        if shown is None:
            return
        sides = palette.sides(shown.owner, shown.alliance, frame.player).tolist()
        for pos, goal, side in zip(shown.pos, shown.goal, sides, strict=True):
            way = goal - pos
            behind = pos - way / max(math.hypot(*way), 1e-6) * TAIL
            head, tail = self._pixel(frame, pos), self._pixel(frame, behind)
            marks.missile(image, head, tail, palette.LIVERIES[side].beam, max(1.0, 0.11 * self._scale))

    def _beams(self, image: Image, frame: Frame, attacker: NDArray[np.int64], target: NDArray[np.int64]) -> None:
        sight = frame.sight
        sides = palette.sides(sight.owner, sight.alliance, frame.player)
        shots: list[tuple[Point, Point, Colour]] = []
        for shooter, victim in zip(attacker.tolist(), target.tolist(), strict=True):
            way = sight.pos[victim] - sight.pos[shooter]
            ahead = way / max(math.hypot(*way), 1e-6)
            start, end = (
                sight.pos[shooter] + ahead * sight.radius[shooter],
                sight.pos[victim] - ahead * sight.radius[victim] * 0.7,
            )
            beam = palette.LIVERIES[int(sides[shooter])].beam
            shots.append((self._pixel(frame, start), self._pixel(frame, end), beam))
        if shots:
            marks.beams(image, shots, 1 + (self._scale > 14))

    def _pixel(self, frame: Frame, point: NDArray[np.float64]) -> Point:
        return self._screen.to_pixels(float(point[0]), float(point[1]), frame.camera)

    # bars -------------------------------------------------------------------------------------------------------------

    def _bars(self, image: Image, frame: Frame, actors: list[DrawnUnit]) -> None:
        sight = frame.sight
        quiet = (sight.display != Display.VISIBLE.value) | (sight.life_max <= 0)
        quiet |= self._bare[sight.row] & ((sight.life >= sight.life_max) | (sight.alliance == Alliance.NEUTRAL.value))
        columns = (quiet, sight.life, sight.life_max, sight.shields, sight.shields_max, sight.energy, sight.energy_max,
                   sight.build_progress)  # fmt: skip
        table = list(zip(*(column.tolist() for column in columns), strict=True))
        for actor in reversed(actors):
            hidden, life, life_max, shields, shields_max, energy, energy_max, progress = table[actor.row]
            if hidden:
                continue
            shares: list[tuple[float, Colour]] = []
            if shields_max > 0:
                shares.append((shields / shields_max, palette.SHIELD))
            shares.append((life / life_max, marks.health_colour(life / life_max)))
            if energy_max > 0 and actor.radius >= TINY:
                shares.append((energy / energy_max, palette.ENERGY))
            if progress < 1:
                shares.append((progress, palette.PROGRESS))
            if actor.radius < TINY and all(share >= 1 for share, _ in shares):
                continue
            height = 1 if actor.radius < SMALL else 2 if actor.radius < TALL else 3
            size = (max(5 if actor.radius < TINY else 7, round(actor.radius * 1.7)), height)
            bottom = int(actor.y - actor.radius * 1.12) - 1
            marks.bars(image, int(actor.x), bottom, size, shares, border=int(actor.radius >= TINY))

    def _buffs(self, image: Image, frame: Frame, actors: list[DrawnUnit]) -> None:
        """Draw a pip for each buff, below the unit."""
        worn = seen_buffs(frame.world, frame.sight)
        if worn is None:
            return
        colours: dict[int, list[Colour]] = {}
        for row, foreign in zip(worn.row.tolist(), worn.foreign.tolist(), strict=True):
            colours.setdefault(row, []).append(palette.BANE if foreign else palette.BOON)
        size = 2 if self._scale < GRID_FROM * 3 else 3
        for actor in actors:
            if some := colours.get(actor.row):
                left = int(actor.x) - (size + 1) * len(some[:MOST_PIPS]) // 2
                marks.pips(image, left, int(actor.y + actor.radius) + 1, size, some[:MOST_PIPS])


def _level(unit: UnitType) -> int:
    """Return the drawing level of a type: structures, walkers, those that walk over the others, flyers."""
    if unit.flying:
        return 3
    return 2 if "air" in unit.planes else 0 if unit.structure else 1
