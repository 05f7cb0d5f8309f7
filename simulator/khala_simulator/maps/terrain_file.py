"""The terrain files inside an .SC2Map archive: bytes to grids, and grids to a ``MapTerrain``.

Pure functions without any file. The formats are those of the editor's own files (``MapInfo``, ``t3SyncHeightMap``,
``t3SyncCliffLevel``, ``t3CellFlags``, ``CellAttribute_*``), as far as they are known; the rest of a file is ignored. No
file says which cells are walkable: ``walkability`` has the rule. Above: ``archive``.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.maps import walkability
from khala_simulator.maps.game_map import MapTerrain, height_bytes
from khala_simulator.maps.scenario import LARGEST_SIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import Box, Grid

MAP_INFO_MAGIC: Final = b"IpaM"
SIZE_AT: Final = 16  # width and height in MapInfo
HEIGHTS_MAGIC = b"SMAP"
HEIGHTS_AT = 64
CLIFFS_MAGIC = b"CLIF"
CLIFFS_AT = 32
FLAGS_MAGIC = b"LFCT"
FLAGS_AT = 32
ATTRIBUTE_AT: Final = 4
Z_STEP: Final = 256.0
SIGNED_FROM: Final = 128.0  # heights from here on are below zero
CLIFF_TILE: Final = 1  # bit of a cell's flags
# The names may overlap: a file's name may end before them. Without a limit a long word takes quadratic time.
_TWO_WORDS = re.compile(rb"(?=([A-Za-z]\w{0,99}\x00[A-Za-z]\w{0,99}\x00))")


class TerrainError(ValueError):
    """A file inside an archive is invalid; the text says which and why."""


@dataclass(frozen=True, slots=True)
class MapInfo:
    """The data of ``MapInfo``: the size in cells, and the playable part."""

    size: tuple[int, int]
    playable: Box


@dataclass(frozen=True, eq=False)
class TerrainGrids:
    """The grids of the files: (h, w), but ``vertices`` (h + 1, w + 1)."""

    vertices: NDArray[np.float32]  # z at the cells' corners
    cliff: NDArray[np.uint16]  # level, 64 a step
    on_cliff_tile: Grid
    painted: Grid  # closed for walkers by hand


def read_map_info(data: bytes) -> MapInfo:
    """Return the size and the playable area.

    The area follows the names of the fog and the tile set. The fields between the size and these names differ from
    version to version, so this searches for the names.
    """
    if not data.startswith(MAP_INFO_MAGIC) or len(data) < SIZE_AT + 8:
        raise TerrainError("MapInfo is not a map's info")
    width, height = struct.unpack_from("<2I", data, SIZE_AT)
    if not (0 < width <= LARGEST_SIDE and 0 < height <= LARGEST_SIDE):
        raise TerrainError(f"MapInfo tells a size of {width} x {height} cells")
    for words in _TWO_WORDS.finditer(data, SIZE_AT + 8):
        if words.end(1) + 16 <= len(data):
            x0, y0, x1, y1 = struct.unpack_from("<4I", data, words.end(1))
            if x0 < x1 <= width and y0 < y1 <= height:
                return MapInfo((width, height), (x0, y0, x1, y1))
    raise TerrainError("MapInfo tells no playable area")


def read_heights(data: bytes, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return (h + 1, w + 1) z of the vertices, from ``t3SyncHeightMap``."""
    width, height = size
    pairs = _numbers(data, HEIGHTS_MAGIC, HEIGHTS_AT, "<u2", (height + 1, width + 1, 2), "t3SyncHeightMap")
    z = pairs[:, :, 0] / Z_STEP
    signed: NDArray[np.float32] = np.where(z >= SIGNED_FROM, z - 2 * SIGNED_FROM, z).astype(np.float32)
    return signed


def read_cliffs(data: bytes, size: tuple[int, int]) -> NDArray[np.uint16]:
    """Return (h, w) cliff levels, from ``t3SyncCliffLevel``."""
    cells = _numbers(data, CLIFFS_MAGIC, CLIFFS_AT, "<u2", size[::-1], "t3SyncCliffLevel")
    return cells.astype(np.uint16)


def read_flags(data: bytes, size: tuple[int, int]) -> Grid:
    """Return (h, w) whether each cell belongs to a cliff's tile, from ``t3CellFlags``."""
    cells: Grid = _numbers(data, FLAGS_MAGIC, FLAGS_AT, "u1", size[::-1], "t3CellFlags") & CLIFF_TILE != 0
    return cells


def read_paint(data: bytes, size: tuple[int, int]) -> Grid:
    """Return (h, w) whether any quarter of each cell is painted, from a ``CellAttribute_`` file."""
    cells: Grid = _numbers(data, b"", ATTRIBUTE_AT, "u1", size[::-1], "CellAttribute") != 0
    return cells


def _numbers(data: bytes, magic: bytes, at: int, dtype: str, shape: tuple[int, ...], name: str) -> NDArray[Any]:
    kind = np.dtype(dtype)
    count = int(np.prod(shape))
    if not data.startswith(magic):
        raise TerrainError(f"{name} does not begin with {magic.decode()}")
    if len(data) < at + count * kind.itemsize:
        raise TerrainError(f"{name} ends after {len(data)} bytes, {at + count * kind.itemsize} are needed")
    return np.frombuffer(data, kind, count, at).reshape(shape)


def terrain_of(info: MapInfo, ground: TerrainGrids) -> MapTerrain:
    """Return the terrain that the files describe."""
    width, height = info.size
    x0, y0, x1, y1 = info.playable
    inside = np.zeros((height, width), dtype=np.bool_)
    inside[y0:y1, x0:x1] = True
    glide = walkability.solid(ground.cliff) & ~ground.painted & inside
    walk = walkability.walkable(ground.cliff, ground.on_cliff_tile) & glide
    build = walkability.buildable(ground.cliff, walk)
    told = np.where(inside, height_bytes(ground.vertices), 0).astype(np.uint8)
    none = np.zeros_like(walk)
    terrain = MapTerrain(info.size, info.playable, walk, glide, build, none, ground.cliff, told, ground.vertices)
    for grid in (walk, glide, build, none, told):
        grid.setflags(write=False)
    return terrain
