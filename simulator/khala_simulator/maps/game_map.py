"""Maps: terrain grids joined with the scenario that is played on them.

Immutable and shared by every game on the map; the world holds what structures add to the terrain during a game. All
grids are indexed ``[y, x]`` with row 0 at y = 0 (the bottom), cell (x, y) covering [x, x+1) x [y, y+1).
"""

from __future__ import annotations

import dataclasses
import hashlib
import re
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from khala_simulator.maps.heights import Heights
from khala_simulator.maps.nodes import shown
from khala_simulator.maps.scenario import Flat, Scenario
from khala_simulator.maps.scenario_file import Sheet, sheets

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_simulator.numeric.geometry import Floats

Grid = NDArray[np.bool_]
Box = tuple[int, int, int, int]

BASES = "bases"
"""The folder next to the families; other files only extend its files."""
FIRST_CHOICE = "llm_smac"
"""The family of a bare name that several have: its maps end by themselves."""
FLAT_Z = 10.0
FLAT_CLIFF = 128
_PLAIN = re.compile(r"[A-Za-z0-9_]{1,64}")  # names of shipped terrains
HEIGHT_LOW = -16.0
HEIGHT_SPAN = 32.0
HEIGHT_STEPS = 255


class MapError(ValueError):
    """No such map, or its terrain is missing or does not hold it."""


@dataclass(frozen=True, eq=False)
class MapTerrain:
    """The unchanging ground: (h, w) grids unless a line says otherwise."""

    size: tuple[int, int]  # width, height in cells
    playable: Box  # x0, y0, x1, y1; x1 and y1 exclusive
    walk: Grid  # a ground unit's centre may be here
    glide: Grid  # a cliff walker's centre may be here
    build: Grid  # structures may stand here
    creep: Grid  # creep painted by the map, never receding
    cliff: NDArray[np.uint16]  # level, 64 per step; 0 is void, between multiples is a ramp
    height: NDArray[np.uint8]  # API bytes: z = -16 + 32 v / 255 at the cell's lower-left corner
    vertices: NDArray[np.float32]  # (h + 1, w + 1) ground z at the cells' corners

    @cached_property
    def heights(self) -> Heights:
        """The height of the ground under any point."""
        return Heights(self.vertices, self.size)

    def ground_z(self, points: Floats) -> Floats:
        """Return the ground height under world points (..., 2), interpolated between the corners of their cells."""
        return self.heights.under(points)


@dataclass(frozen=True, eq=False)
class GameMap:
    """A map that can be played.

    ``path`` is its path below ``Maps`` in an install (``llm_smac/2s3z.SC2Map``), ``digest`` a hash of scenario and
    terrain that names exactly this content.
    """

    name: str
    family: str
    terrain: MapTerrain
    scenario: Scenario
    digest: str

    @property
    def path(self) -> str:
        """The path below ``Maps`` in an install, with forward slashes."""
        return f"{self.family}/{self.name}.SC2Map"

    @property
    def camera(self) -> tuple[float, float]:
        """Where the camera starts: the scenario's value, or the middle of the playable area."""
        if self.scenario.camera is not None:
            return self.scenario.camera
        x0, y0, x1, y1 = self.terrain.playable
        return (x0 + x1) / 2.0, (y0 + y1) / 2.0


@lru_cache(maxsize=1)
def _families() -> tuple[str, ...]:
    """Return the folders of shipped maps, sorted."""
    root = resources.files("khala_simulator.data") / "maps"
    return tuple(sorted(folder.name for folder in root.iterdir() if folder.is_dir() and folder.name != BASES))


@lru_cache(maxsize=32)
def _sheets(family: str) -> Mapping[str, Sheet]:
    """Return the scenarios of a family's shipped files as ``family/name``; none of a family that is not there."""
    if family not in _families():
        return {}
    found: dict[str, Sheet] = {}
    for file in (resources.files("khala_simulator.data") / "maps" / family).iterdir():
        if file.name.endswith(".yaml"):
            named = sheets(file.read_text(encoding="utf-8"), f"{family}/{file.name}")
            found |= {f"{family}/{name}": sheet for name, sheet in named}
    return found


@lru_cache(maxsize=1)
def map_names() -> tuple[str, ...]:
    """Return all shipped maps as ``family/name``, sorted."""
    return tuple(sorted(name for family in _families() for name in _sheets(family)))


def map_title(name: str) -> str:
    """Return the title of the shipped map ``family/name``."""
    return _sheets(name.partition("/")[0])[name].title


def find_map(name: str) -> str:
    """Return the shipped map for ``name``: ``family/name``, a bare name, or a path to an .SC2Map file of that name.

    Raises:
        MapError: none is meant, or a bare name means several.
    """
    parts = Path(name.replace("\\", "/")).with_suffix("").parts if name.endswith(".SC2Map") else Path(name).parts
    exact = "/".join(parts[-2:])
    if len(parts) > 1 and exact in _sheets(parts[-2]):
        return exact
    preferred = f"{FIRST_CHOICE}/{''.join(parts[-1:])}"
    if preferred in _sheets(FIRST_CHOICE):
        return preferred
    same = [known for known in map_names() if parts and known.split("/")[1] == parts[-1]]
    if len(same) == 1:
        return same[0]
    if same:
        raise MapError(f"map {name!r} is ambiguous: {', '.join(same)}")
    raise MapError(f"no map {name!r}; shipped are {', '.join(map_names())}")


def load_map(name: str) -> GameMap:
    """Return the shipped map with this name (see ``find_map``); raise ``MapError`` when there is none."""
    return _load(find_map(name))


@lru_cache(maxsize=128)
def _load(full_name: str) -> GameMap:
    sheet = _sheets(full_name.partition("/")[0])[full_name]
    return map_from(sheet.scenario(), sheet.canonical())


def map_from(scenario: Scenario, text: str) -> GameMap:
    """Join a scenario, which ``text`` defines completely, with its terrain."""
    if isinstance(scenario.terrain, Flat):
        terrain, content = _flat(scenario.terrain.flat)
    else:
        terrain, content = _load_terrain(scenario.terrain)
    return game_map(scenario, terrain, text.encode() + content)


def game_map(scenario: Scenario, terrain: MapTerrain, content: bytes) -> GameMap:
    """Return the map of a scenario on a terrain, which ``content`` defines completely.

    Raises:
        MapError: a point or the playable area is not on the terrain; the text names the field.
    """
    width, height = terrain.size
    for field, (x, y, *_) in scenario.stated_points():
        if not (0 <= x <= width and 0 <= y <= height):
            raise MapError(f"{field}: [{x:g}, {y:g}] is not on the map, which has {width} x {height} cells")
    narrowed = terrain if scenario.playable is None else _narrow(terrain, scenario.playable)
    return GameMap(scenario.name, scenario.family, narrowed, scenario, hashlib.sha256(content).hexdigest())


def height_bytes(vertices: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return (h, w) the API's height of every cell (at its lower-left corner), from (h + 1, w + 1) z."""
    scaled = np.rint((vertices[:-1, :-1] - HEIGHT_LOW) * (HEIGHT_STEPS / HEIGHT_SPAN))
    result: NDArray[np.uint8] = np.clip(scaled, 0, HEIGHT_STEPS).astype(np.uint8)
    return result


@lru_cache(maxsize=32)
def _load_terrain(name: str) -> tuple[MapTerrain, bytes]:
    path = resources.files("khala_simulator.data") / "terrain" / f"{name}.npz"
    if not _PLAIN.fullmatch(name) or not path.is_file():
        raise MapError(f"terrain: no terrain {shown(name)!r} is shipped")
    with path.open("rb") as file, np.load(file) as grids:
        arrays = {key: grids[key] for key in grids.files}
    for array in arrays.values():
        array.setflags(write=False)
    content = b"".join(arrays[key].tobytes() for key in sorted(arrays))
    walk = arrays["walk"]
    x0, y0, x1, y1 = (int(v) for v in arrays["playable"])
    terrain = MapTerrain(
        size=(walk.shape[1], walk.shape[0]),
        playable=(x0, y0, x1, y1),
        walk=walk,
        glide=arrays["glide"],
        build=arrays["build"],
        creep=arrays.get("creep", np.zeros_like(walk)),
        cliff=arrays["cliff"],
        height=arrays["height"],
        vertices=arrays["vertices"],
    )
    return terrain, content


@lru_cache(maxsize=32)
def _flat(size: tuple[int, int]) -> tuple[MapTerrain, bytes]:
    """Return level ground that is free everywhere."""
    width, height = size
    free = np.ones((height, width), dtype=np.bool_)
    vertices = np.full((height + 1, width + 1), FLAT_Z, dtype=np.float32)
    cliff = np.full((height, width), FLAT_CLIFF, dtype=np.uint16)
    none = np.zeros_like(free)
    terrain = MapTerrain(size, (0, 0, width, height), free, free, free, none, cliff, height_bytes(vertices), vertices)
    for array in (free, none, vertices, cliff, terrain.height):
        array.setflags(write=False)
    return terrain, repr(size).encode()


@lru_cache(maxsize=64)
def _narrow(terrain: MapTerrain, playable: Box) -> MapTerrain:
    """Return the terrain with only a part in play; heights cover that part alone, as in the game."""
    x0, y0, x1, y1 = playable
    width, height = terrain.size
    if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
        raise MapError(
            f"playable: the playable area {list(playable)} is not within the terrain's {width} x {height} cells"
        )
    inside = np.zeros_like(terrain.walk)
    inside[y0:y1, x0:x1] = True
    grids = {name: getattr(terrain, name) & inside for name in ("walk", "glide", "build", "creep")}
    told = np.where(inside, terrain.height, 0).astype(np.uint8)
    for array in (*grids.values(), told):
        array.setflags(write=False)
    return dataclasses.replace(terrain, playable=playable, height=told, **grids)
