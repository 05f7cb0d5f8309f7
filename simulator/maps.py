"""Maps: terrain grids joined with the scenario that is played on them.

Immutable and shared by every game on the map; what structures add to the terrain during a game is the world's.
All grids are indexed ``[y, x]`` with row 0 at y = 0 (the bottom), cell (x, y) covering [x, x+1) x [y, y+1).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from simulator.scenario import Scenario, parse_scenario

if TYPE_CHECKING:
    from simulator.geometry import Floats

Grid = NDArray[np.bool_]


class MapError(ValueError):
    """No such map, or its terrain is missing."""


@dataclass(frozen=True, eq=False)
class Terrain:
    """The unchanging ground: (h, w) grids unless a line says otherwise."""

    size: tuple[int, int]  # width, height in cells
    playable: tuple[int, int, int, int]  # x0, y0, x1, y1; x1 and y1 exclusive
    walk: Grid  # a ground unit's centre may be here
    glide: Grid  # a cliff walker's centre may be here
    build: Grid  # structures may stand here
    creep: Grid  # creep painted by the map, never receding
    cliff: NDArray[np.uint16]  # level, 64 per step; 0 is void, between multiples is a ramp
    height: NDArray[np.uint8]  # API bytes: z = -16 + 32 v / 255 at the cell's lower-left corner
    vertices: NDArray[np.float32]  # (h + 1, w + 1) ground z at the cells' corners

    def ground_z(self, points: Floats) -> Floats:
        """Ground height under world points (n, 2), interpolated between the corners of their cells."""
        x = np.minimum(np.maximum(points[..., 0], 0.0), self.size[0] - 1e-6)
        y = np.minimum(np.maximum(points[..., 1], 0.0), self.size[1] - 1e-6)
        ix, iy = x.astype(np.intp), y.astype(np.intp)
        fx, fy = x - ix, y - iy
        v, width = self.vertices, self.vertices.shape[1]
        corner = iy * width + ix  # one index into the flat grid costs a third of two
        low = v.take(corner) * (1.0 - fx) + v.take(corner + 1) * fx
        high = v.take(corner + width) * (1.0 - fx) + v.take(corner + width + 1) * fx
        result: Floats = low * (1.0 - fy) + high * fy
        return result


@dataclass(frozen=True, eq=False)
class GameMap:
    """A map that can be played.

    ``path`` is where an install keeps it below ``Maps`` (``llm_smac/2s3z.SC2Map``), ``digest`` a hash of scenario and
    terrain that names exactly this content.
    """

    name: str
    family: str
    terrain: Terrain
    scenario: Scenario
    digest: str

    @property
    def path(self) -> str:
        """Path below ``Maps`` in an install, with forward slashes."""
        return f"{self.family}/{self.name}.SC2Map"

    @property
    def camera(self) -> tuple[float, float]:
        """Where the camera starts: the scenario's word, or the middle of the playable area."""
        if self.scenario.camera is not None:
            return self.scenario.camera
        x0, y0, x1, y1 = self.terrain.playable
        return (x0 + x1) / 2.0, (y0 + y1) / 2.0


@lru_cache(maxsize=1)
def map_names() -> tuple[str, ...]:
    """All shipped maps as ``family/name``, sorted."""
    root = resources.files("simulator.data") / "maps"
    families = (f for f in root.iterdir() if f.is_dir())
    found = (f"{f.name}/{m.name[:-5]}" for f in families for m in f.iterdir() if m.name.endswith(".yaml"))
    return tuple(sorted(found))


def find_map(name: str) -> str:
    """The shipped map that ``name`` means: ``family/name``, a bare name, or a path to an .SC2Map file of that name.

    Raises:
        MapError: none is meant, or a bare name means several.
    """
    parts = Path(name.replace("\\", "/")).with_suffix("").parts if name.endswith(".SC2Map") else Path(name).parts
    exact = "/".join(parts[-2:])
    if exact in map_names():
        return exact
    same = [known for known in map_names() if parts and known.split("/")[1] == parts[-1]]
    if len(same) == 1:
        return same[0]
    if same:
        raise MapError(f"map {name!r} is ambiguous: {', '.join(same)}")
    raise MapError(f"no map {name!r}; shipped are {', '.join(map_names())}")


def load_map(name: str) -> GameMap:
    """The shipped map with this name (see ``find_map``); raises ``MapError`` when there is none."""
    return _load(find_map(name))


@lru_cache(maxsize=128)
def _load(full_name: str) -> GameMap:
    data = resources.files("simulator.data")
    text = (data / "maps" / f"{full_name}.yaml").read_text(encoding="utf-8")
    return map_from(parse_scenario(text, f"{full_name}.yaml"), text)


def map_from(scenario: Scenario, text: str) -> GameMap:
    """Join a scenario, whose file held ``text``, with its shipped terrain."""
    terrain, content = _terrain(scenario.terrain)
    digest = hashlib.sha256(text.encode() + content).hexdigest()
    return GameMap(scenario.name, scenario.family, terrain, scenario, digest)


@lru_cache(maxsize=32)
def _terrain(name: str) -> tuple[Terrain, bytes]:
    path = resources.files("simulator.data") / "terrain" / f"{name}.npz"
    if not path.is_file():
        raise MapError(f"no terrain {name!r} is shipped")
    with path.open("rb") as file, np.load(file) as grids:
        arrays = {key: grids[key] for key in grids.files}
    for array in arrays.values():
        array.setflags(write=False)
    content = b"".join(arrays[key].tobytes() for key in sorted(arrays))
    walk = arrays["walk"]
    x0, y0, x1, y1 = (int(v) for v in arrays["playable"])
    terrain = Terrain(
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
