"""The screen of a team: 24 by 24 world units around its camera, from above.

It is drawn from raw data, so that each team has a screen of its own, wherever the game's camera is. `draw` is the
whole of it; `Legend` holds the facts for a picture's title.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.observe.image import palette
from khala_bridge.observe.image.bodies import LETTERS_FROM_PX, BodyLook, body, direction_of
from khala_bridge.observe.image.canvas import SMALL_PX, Canvas, inner_px
from khala_bridge.observe.image.effects import draw_orders, draw_patches
from khala_bridge.observe.image.marks import Marked, place
from khala_bridge.observe.mark_digits import marks_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.frames import Camera
    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.observe.image.moment import Moment, Subject
    from khala_bridge.observe.image.palette import Colour, Side

_BAR_PX = 3
RANK: dict[Side, int] = {"team": 0, "enemy": 1, "own": 2, "ally": 3, "neutral": 4}
"""Sides in the order in which their marks get places."""


@dataclass(frozen=True)
class Legend:
    """The facts about a picture for its title."""

    sides: tuple[Side, ...] = ()
    """Owners of the units on it."""
    codes: dict[str, str] = field(default_factory=dict)
    """Letters on bodies → their types."""
    example: tuple[str, int] | None = None
    """A mark, and its tag."""
    unmarked: int = 0
    """Number of units without room for a mark."""
    rendered: bool = False
    """Whether the game drew it, in colours of its own; the added parts have ours."""


class _Drawn(NamedTuple):
    """A subject, its side as this team sees it, and its place in pixels."""

    subject: Subject
    side: Side
    x: int
    y: int
    radius: int


def draw(
    moment: Moment, camera: Camera, team: frozenset[int], size_px: int, *, marks: bool = True, grid: bool = True
) -> tuple[Image, Legend]:
    """Return the screen of a team.

    Args:
        moment: the things to draw.
        camera: the team's.
        team: tags of its units.
        size_px: of the picture on both axes, margins included.
        marks: whether units carry the digits of their tags, and the letters of their types.
        grid: whether to draw grid lines.
    """
    ground = moment.painting.seen(camera, inner_px(size_px, camera.size), moment.veil)
    canvas = Canvas.on(ground, size_px, camera.size)
    if grid:
        canvas.rule()
    image = canvas.inner
    scale = canvas.inner.shape[0] / CAMERA_WIDTH
    place_of = _placing(canvas, camera)
    draw_patches(image, moment.power, place_of, scale, names=False)
    seen = _seen(canvas, moment, camera, team)
    draw_orders(image, (drawn.subject for drawn in seen if drawn.side == "team"), place_of)
    for drawn in seen:
        stamp = body(_look(drawn, lettered=marks))
        stamp.press(image, drawn.x - stamp.size[0] // 2, drawn.y - stamp.size[1] // 2)
    draw_patches(image, moment.effects, place_of, scale, names=True)
    for drawn in seen:
        _bars(image, drawn)
    return canvas.image, _legend(seen, _mark(canvas, seen) if marks else _Marks(), lettered=marks)


def draw_over(
    pixels: Image,
    moment: Moment,
    camera: Camera,
    team: frozenset[int],
    size_px: int,
    *,
    marks: bool = True,
    grid: bool = True,
) -> tuple[Image, Legend]:
    """Return the screen of a team from pixels of the game, with axes, grid and marks added."""
    canvas = Canvas.on(pixels, size_px, camera.size)
    if grid:
        canvas.rule()
    seen = _seen(canvas, moment, camera, team)
    legend = _legend(seen, _mark(canvas, seen) if marks else _Marks(), lettered=False)
    return canvas.image, replace(legend, sides=legend.sides if marks else (), rendered=True)


def _placing(canvas: Canvas, camera: Camera) -> Callable[[float, float], tuple[int, int]]:
    def place_of(x: float, y: float) -> tuple[int, int]:
        return canvas.pixel(*camera.screen(x, y))

    return place_of


def _seen(canvas: Canvas, moment: Moment, camera: Camera, team: frozenset[int]) -> list[_Drawn]:
    """Return the subjects on the screen, in the order of drawing; a team's own units come last on their level."""
    scale = canvas.inner.shape[0] / CAMERA_WIDTH
    place_of = _placing(canvas, camera)
    seen = [
        _Drawn(
            subject,
            "team" if subject.tag in team else subject.side,
            *place_of(subject.x, subject.y),
            max(3, round(subject.radius * scale)),
        )
        for subject in moment.around(camera.x, camera.y, CAMERA_WIDTH / 2)
    ]
    return sorted(seen, key=lambda drawn: (drawn.subject.level, drawn.side == "team"))


def _look(drawn: _Drawn, *, lettered: bool) -> BodyLook:
    unit = drawn.subject
    direction = direction_of(unit.facing, unit.shape)
    return BodyLook(
        unit.shape, drawn.side, drawn.radius, direction, unit.code if lettered else "", unit.ghost, unit.built < 1
    )


def _bars(image: Image, drawn: _Drawn) -> None:
    """Draw bars: construction, health and shield above a hurt unit, and the energy of the team's own units."""
    unit = drawn.subject
    if drawn.side == "neutral" or unit.health < 0:
        return
    rows: list[tuple[float, Colour]] = []
    if unit.built < 1:
        rows.append((unit.built, palette.PROGRESS))
    if unit.health < 1 or 0 <= unit.shield < 1:
        rows += [(unit.shield, palette.SHIELD)] if unit.shield >= 0 else []
        rows.append((unit.health, palette.health_colour(unit.health)))
    if unit.energy >= 0 and drawn.side == "team":
        rows.append((unit.energy, palette.ENERGY))
    width = max(2 * drawn.radius, 12)
    left, top = drawn.x - width // 2, drawn.y - drawn.radius - 2 - _BAR_PX * len(rows)
    if rows:
        _fill(image, left - 1, top - 1, width + 2, _BAR_PX * len(rows) + 1, palette.INK)
    for number, (share, colour) in enumerate(rows):
        _fill(image, left, top + number * _BAR_PX, round(width * share), _BAR_PX - 1, colour)


def _fill(image: Image, left: int, top: int, width: int, height: int, colour: Colour) -> None:
    """Fill a rectangle, as far as it is inside the image."""
    image[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)] = colour


class _Marks(NamedTuple):
    """The marks of a picture."""

    example: tuple[str, int] | None = None
    left_out: int = 0


def _mark(canvas: Canvas, seen: Sequence[_Drawn]) -> _Marks:
    """Draw the marks."""
    image = canvas.inner
    size = image.shape[0]
    inside = [drawn for drawn in seen if 0 <= drawn.x < size and 0 <= drawn.y < size]
    wanting = [drawn for drawn in inside if drawn.side != "neutral" and drawn.subject.shape != "field"]
    wanting.sort(key=lambda it: (RANK[it.side], abs(2 * it.x - size) + abs(2 * it.y - size), it.subject.tag))
    texts = marks_of(drawn.subject.tag for drawn in wanting)
    tags = {text: tag for tag, text in texts.items()}
    placed = place(
        image,
        [Marked(texts[drawn.subject.tag], drawn.side, drawn.x, drawn.y, drawn.radius) for drawn in wanting],
        [Marked("", drawn.side, drawn.x, drawn.y, drawn.radius) for drawn in inside],
        6 if canvas.image.shape[0] < SMALL_PX else 8,
    )
    example = (placed[0].text, tags[placed[0].text]) if placed else None
    return _Marks(example, len(wanting) - len(placed))


def _legend(seen: Sequence[_Drawn], marks: _Marks, *, lettered: bool) -> Legend:
    """Return the facts about the picture."""
    sides = tuple(sorted({drawn.side for drawn in seen}, key=RANK.__getitem__))
    readable = (drawn.subject for drawn in seen if lettered and drawn.subject.code and drawn.radius >= LETTERS_FROM_PX)
    codes = {subject.code: subject.name for subject in readable}
    ordered = dict(sorted(codes.items(), key=lambda item: item[1]))
    return Legend(sides, ordered, marks.example, marks.left_out)
