"""A block of a map as an image: height as lightness, slopes in relief, cliffs with edges, ramps in stripes.

Only the parts that never change; knows no units and no player. A block is painted with a margin of its surroundings, so
that blocks fit together. Above: `ground.py`.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from khala_simulator.api.painting import palette

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import MapTerrain

    Image = NDArray[np.uint8]
    Floats = NDArray[np.float32]
    Mask = NDArray[np.bool_]

MARGIN = 3
"""Cells around a block that influence its look."""
LIGHT = (-0.62, 0.62)
"""Direction from which the light falls, in the world: from the upper left."""
RELIEF = 0.34
SHADE = (0.62, 1.4)
CONTOUR = 0.5
"""World units of height from one stripe of a ramp to the next."""
FALL = 0.8
"""Ground that falls by this much in a cell and a half has a crest."""
ROUND = 0.42
"""How far in cells the corners of cliffs are rounded."""
GRAIN_COARSE, GRAIN_FINE = 2.2, 1.4
"""Strength of the texture that keeps large areas from being flat, in steps of colour."""


class Cells(NamedTuple):
    """A rectangle of cells: [x0, x1) x [y0, y1)."""

    x0: int
    y0: int
    x1: int
    y1: int


def paint_block(terrain: MapTerrain, cells: Cells, density: int) -> Image:
    """Return the ground of some cells with `density` pixels per cell, north at the top; void outside of the map."""
    near = Cells(cells.x0 - MARGIN, cells.y0 - MARGIN, cells.x1 + MARGIN, cells.y1 + MARGIN)
    walk = _smooth(_window(terrain.walk, near), density)
    solid = _smooth(_window(terrain.cliff > 0, near), density)
    ramp = _smooth(_window(terrain.walk & (terrain.cliff % 64 != 0), near), density) & walk
    height = _heights(terrain, near, density)
    colour = _tint(terrain, height)
    colour *= _relief(height, density)[..., None]
    blend(colour, palette.ROCK, 0.72 * ~walk)
    _hatch(colour, ~walk & solid, density)
    _stripe(colour, height, ramp)
    _grain(colour, terrain, near)
    blend(colour, palette.VOID, 0.9 * ~solid)
    _edges(colour, walk, height, density)
    blend(colour, palette.VOID, 0.55 * ~_smooth(_window(_playable(terrain), near), density))
    edge = MARGIN * density
    return np.clip(colour[edge:-edge, edge:-edge], 0, 255).astype(np.uint8)


def blend(colour: Floats, paint: palette.Colour, part: NDArray[np.floating[Any]]) -> None:
    """Mix a paint into an image, `part` [rows, columns] of it."""
    colour += (np.array(paint, np.float32) - colour) * part[..., None].astype(np.float32)


def _window(grid: NDArray[Any], cells: Cells, more: int = 0) -> Floats:
    """Return part of a grid, its northernmost row first; beyond the map as at its border, masks false."""
    rows = np.arange(cells.y0, cells.y1 + more)[::-1]
    columns = np.arange(cells.x0, cells.x1 + more)
    inside = ((rows >= 0) & (rows < grid.shape[0]))[:, None] & ((columns >= 0) & (columns < grid.shape[1]))
    rows, columns = np.clip(rows, 0, grid.shape[0] - 1), np.clip(columns, 0, grid.shape[1] - 1)
    part = grid[rows[:, None], columns].astype(np.float32)
    return part * inside if grid.dtype == np.bool_ else part


def _smooth(part: Floats, density: int) -> Mask:
    """Return a mask of cells as a mask of pixels, its corners rounded."""
    hard = cv2.resize(part, None, fx=density, fy=density, interpolation=cv2.INTER_NEAREST)
    result: Mask = cv2.GaussianBlur(hard, (0, 0), density * ROUND, borderType=cv2.BORDER_REPLICATE) > 0.5
    return result


def _heights(terrain: MapTerrain, cells: Cells, density: int) -> Floats:
    """Return the ground z of every pixel, interpolated between the corners of its cell."""
    corners = _window(terrain.vertices, cells, more=1)
    size = ((cells.x1 - cells.x0) * density, (cells.y1 - cells.y0) * density)
    inverse = np.array([[1 / density, 0, 0.5 / density], [0, 1 / density, 0.5 / density]], np.float32)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(corners, inverse, size, flags=flags, borderMode=cv2.BORDER_REPLICATE), np.float32)


@functools.lru_cache(maxsize=16)
def _floor(terrain: MapTerrain) -> tuple[float, float]:
    """Return the lowest and the highest usable ground, except for rare extremes."""
    floor = terrain.vertices[:-1, :-1][terrain.cliff > 0]
    if not floor.size:
        return 8.0, 12.0
    low, high = np.percentile(floor, (2, 98)).tolist()
    return low, max(high, low + 4.0)


def _tint(terrain: MapTerrain, height: Floats) -> Floats:
    low, high = _floor(terrain)
    part = np.clip((height - low) / (high - low), -0.25, 1.0)[..., None].astype(np.float32)
    result: Floats = np.array(palette.LOW, np.float32) * (1 - part) + np.array(palette.HIGH, np.float32) * part
    return result


def _relief(height: Floats, density: int) -> Floats:
    """Return light and shade of slopes, as a factor."""
    soft = cv2.GaussianBlur(height, (0, 0), density * 0.2)
    east = cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=density / 8)
    north = -cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=density / 8)
    return np.clip(1 - RELIEF * (east * LIGHT[0] + north * LIGHT[1]), *SHADE).astype(np.float32)


def _stripe(colour: Floats, height: Floats, ramp: Mask) -> None:
    """Paint ramps in sand, striped across their slope."""
    blend(colour, palette.RAMP, 0.45 * ramp)
    dark = np.mod(height, CONTOUR) < CONTOUR / 2
    colour *= np.where(ramp & dark, 0.86, 1.0).astype(np.float32)[..., None]


def _hatch(colour: Floats, rock: Mask, density: int) -> None:
    """Hatch unwalkable ground; the hatching continues from block to block."""
    rows, columns = rock.shape
    line = (np.arange(rows)[:, None] + np.arange(columns)) % density < max(1, density // 6)
    colour *= np.where(rock & line, 0.72, 1.0).astype(np.float32)[..., None]


@functools.lru_cache(maxsize=4)
def _noise(terrain: MapTerrain) -> Floats:
    """Return two random values per cell, always the same."""
    width, height = terrain.size
    return np.random.default_rng(7).standard_normal((2 * height, 2 * width)).astype(np.float32)


def _grain(colour: Floats, terrain: MapTerrain, cells: Cells) -> None:
    rows, columns = colour.shape[:2]
    coarse = _window(_noise(terrain), Cells(2 * cells.x0, 2 * cells.y0, 2 * cells.x1, 2 * cells.y1))
    fine = np.random.default_rng(cells.x0 % 997 + 1000 * (cells.y0 % 997)).standard_normal((rows // 2, columns // 2))
    grain = GRAIN_COARSE * cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC)
    grain += GRAIN_FINE * cv2.resize(fine.astype(np.float32), (columns, rows), interpolation=cv2.INTER_LINEAR)
    colour += grain[..., None]


def _edges(colour: Floats, walk: Mask, height: Floats, density: int) -> None:
    """Draw a dark line where walking ends, and a bright one above it where the ground falls away."""
    size = max(1, round(density / 8)) * 2 + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    whole = walk.astype(np.uint8)
    outer = (cv2.dilate(whole, disc) > 0) & ~walk
    inner = walk & (cv2.erode(whole, disc) == 0)
    around = 3 * density // 2 | 1
    fall = height - cv2.erode(height, np.ones((around, around), np.uint8))
    blend(colour, palette.CREST, 0.75 * (inner & (fall > FALL)))
    blend(colour, palette.EDGE, 0.85 * outer)


def _playable(terrain: MapTerrain) -> Mask:
    x0, y0, x1, y1 = terrain.playable
    inside = np.zeros(terrain.walk.shape, np.bool_)
    inside[y0:y1, x0:x1] = True
    return inside
