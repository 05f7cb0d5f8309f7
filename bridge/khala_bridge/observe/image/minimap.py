"""The minimap as an agent sees it: the whole map, all units in sight, its teams, and its losses.

The ground under it is the same for all agents of a side, and made once a step (`Moment` keeps it by size). Structures
and resources are squares, units are dots; a frame with a team's name shows the extent of that team's screen.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.observe.image import palette
from khala_bridge.observe.image.canvas import SMALL_PX, Canvas, inner_px
from khala_bridge.observe.image.marks import Marked, place
from khala_bridge.observe.image.painting import shade, tint
from khala_bridge.observe.image.palette import LIVERIES
from khala_bridge.observe.image.screen import RANK, Legend

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.observe.image.moment import Moment, Subject
    from khala_bridge.observe.image.painting import Painting
    from khala_bridge.observe.image.palette import Colour, Side
    from khala_protocol.messages import Point

ALERT: Colour = (60, 236, 255)
_CROSS_PX = 5
_FRAMES_AT_MOST = 6
"""Number of teams with a frame; the others get a cross, since more frames would cover the map."""
_DOTS: dict[str, Colour] = {
    "minerals": palette.MINERALS,
    "rich": palette.RICH_MINERALS,
    "geyser": palette.VESPENE,
    "stone": palette.mix(palette.HIGH, palette.INK, 0.3),
}


class TeamMark(NamedTuple):
    """A team on the minimap."""

    name: str
    camera: Camera


def draw(
    moment: Moment,
    world: MapFrame,
    teams: Sequence[TeamMark],
    own: frozenset[int],
    alerts: Iterable[Point],
    size_px: int,
    *,
    others: Sequence[tuple[str, Point]] = (),
    grid: bool = True,
    pixels: Image | None = None,
) -> tuple[Image, Legend]:
    """Return the minimap of an agent.

    Args:
        moment: the things to draw.
        world: the frame of the map.
        teams: the agent's teams, for their frames and names.
        own: tags of their units.
        alerts: points of the minimap where something was lost.
        size_px: of the picture on both axes, margins included.
        others: names and points of teams of other agents, for crosses and names.
        grid: whether to draw grid lines.
        pixels: the game's own minimap, `inner_px` large, on which units are drawn already; None draws it.
    """
    ground = _base(moment, world, inner_px(size_px, world.minimap_size)) if pixels is None else pixels
    canvas = Canvas.on(ground, size_px, world.minimap_size)
    if grid:
        canvas.rule()
    image = canvas.inner

    def place_of(x: float, y: float) -> tuple[int, int]:
        return canvas.pixel(*world.minimap(x, y))

    scale = canvas.scale * world.minimap_size / max(world.width, world.height)
    sides: dict[Side, None] = {}
    for subject in moment.subjects:
        side: Side = "team" if subject.tag in own else subject.side
        sides[side] = None
        if pixels is None or side == "team":
            _dot(image, subject, side, place_of(subject.x, subject.y), scale)
    for alert in alerts:
        cv2.circle(image, canvas.pixel(*alert), 9, palette.INK, 4, cv2.LINE_AA)
        cv2.circle(image, canvas.pixel(*alert), 9, ALERT, 2, cv2.LINE_AA)
    _name_teams(canvas, teams, others, world, scale)
    if pixels is not None:
        return canvas.image, Legend(("team",) if own else (), rendered=True)
    return canvas.image, Legend(tuple(sorted(sides, key=RANK.__getitem__)))


def _base(moment: Moment, world: MapFrame, size_px: int) -> Image:
    """Return the ground with creep and fog."""
    scale = size_px / max(world.width, world.height)
    image = _ground(moment.painting, round(world.width * scale), round(world.height * scale)).copy()
    veil = moment.veil
    if veil.creep is not None:
        tint(image, veil.creep)
    if veil.sight is not None:
        shade(image, veil.sight)
    if image.shape[:2] == (size_px, size_px):
        return image
    full = np.full((size_px, size_px, 3), palette.VOID, np.uint8)
    full[: image.shape[0], : image.shape[1]] = image
    return full


@functools.lru_cache(16)
def _ground(painting: Painting, width: int, height: int) -> Image:
    """Return a map's ground in the size of a minimap."""
    return np.asarray(cv2.resize(painting.image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _dot(image: Image, subject: Subject, side: Side, at: tuple[int, int], scale: float) -> None:
    """Draw a unit: a square if it cannot move, else a disc; never too small to see."""
    x, y = at
    radius = subject.radius * scale
    if side == "neutral":
        half = max(1, round(0.8 * radius))
        colour = _DOTS.get(subject.shape, _DOTS["stone"])
        image[max(y - half, 0) : y + half + 1, max(x - half, 0) : x + half + 1] = colour
        return
    livery = LIVERIES[side]
    if subject.shape == "structure":
        half = max(3, round(0.85 * radius))
        colour = palette.mix(livery.body, palette.INK, 0.5) if subject.ghost else livery.body
        image[max(y - half, 0) : y + half + 1, max(x - half, 0) : x + half + 1] = livery.rim
        image[max(y - half + 1, 0) : y + half, max(x - half + 1, 0) : x + half] = colour
        return
    size = max(2, round(radius))
    cv2.circle(image, at, size + 1, livery.rim, -1)
    cv2.circle(image, at, size, livery.body, -1)


def _name_teams(
    canvas: Canvas, teams: Sequence[TeamMark], others: Sequence[tuple[str, Point]], world: MapFrame, scale: float
) -> None:
    """Draw frames of the teams' screens, crosses at their heads, and their names."""
    image = canvas.inner
    half = round(CAMERA_WIDTH / 2 * scale)
    marked = []
    for number, team in enumerate(teams):
        x, y = canvas.pixel(*world.minimap(team.camera.x, team.camera.y))
        if number < _FRAMES_AT_MOST:
            cv2.rectangle(image, (x - half, y - half), (x + half, y + half), palette.INK, 3)
            cv2.rectangle(image, (x - half, y - half), (x + half, y + half), palette.LINE, 1)
        marked.append(Marked(team.name, "neutral", x, y, _CROSS_PX))
    marked += (Marked(name, "own", *canvas.pixel(*point), _CROSS_PX) for name, point in others)
    for mark in marked:
        colour = palette.LINE if mark.side == "neutral" else LIVERIES[mark.side].mark
        for right, down in ((_CROSS_PX, 0), (0, _CROSS_PX)):
            cv2.line(image, (mark.x - right, mark.y - down), (mark.x + right, mark.y + down), palette.INK, 3)
            cv2.line(image, (mark.x - right, mark.y - down), (mark.x + right, mark.y + down), colour, 1)
    place(image, marked, marked, 7 if canvas.image.shape[0] < SMALL_PX else 9)
