"""A user's own .SC2Map archive as a map that can be played.

Terrain, playable area, start locations, units and the mods that it depends on are read from it. The simulator can't
run its script: a battle with a known name has the script and the units of its scenario, any other map is a plain melee
game.

Above: ``map_file``, ``install``. Below: ``terrain_file``, ``maps``.
"""

from __future__ import annotations

import hashlib
import io
import math
import re
import struct
import zlib
from functools import lru_cache
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree as ET

import mpyq
import numpy as np

from khala_simulator.maps import terrain_file
from khala_simulator.maps.game_map import GameMap, MapError, find_map, game_map, load_map
from khala_simulator.maps.scenario import Scenario
from khala_simulator.maps.terrain_file import TerrainError, TerrainGrids
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import DEFAULT_DATA, DataSet

if TYPE_CHECKING:
    from khala_simulator.maps.game_map import MapTerrain

MAGIC: Final = b"MPQ"
OBJECTS: Final = "Objects"
CLOSED: Final = ("CellAttribute_Pnp", "CellAttribute_Pwd")  # unwalkable paint
QUARTER_TURN: Final = np.pi / 2.0  # from the editor's rotation, 0 downwards, to the API's facing, 0 eastwards
FAMILY: Final = "user"
DEPENDENCIES: Final = ("DocumentInfo", "DocumentHeader")
"""Where an archive names the mods that it depends on; both say the same."""
MOD: Final = re.compile(rb"file:Mods[/\\](\w+)\.SC2Mod", re.IGNORECASE)
DATA_OF_MODS: Final[dict[frozenset[bytes], DataSet]] = {
    frozenset({b"liberty"}): "liberty",
    frozenset({b"void"}): "void",
    frozenset({b"swarm", b"void"}): "void",
    frozenset({b"liberty", b"swarm", b"void"}): "void",
}
"""The data set of a map by its mods; Void brings Swarm and Liberty with it, any others are taken as multiplayer."""
PLAYERS: Final = 2
"""Of a map without start locations, whose own script would make what is there."""


class ArchiveError(ValueError):
    """The bytes are no archive of a map, or an unreadable one; the text says why."""


def read_archive(data: bytes, path: str) -> GameMap:
    """Return the map in the bytes of an archive; ``path`` holds its name.

    Raises:
        ArchiveError: it can't be read, and its name is not that of a shipped map either.
    """
    name = PurePosixPath(path.replace("\\", "/")).stem
    known = _known(path)
    try:
        terrain, content = _terrain_of(data)
    except ArchiveError:
        if known is not None:
            return known
        raise
    digest = content + name.encode()
    archive = _open(data)
    if known is not None and not known.scenario.melee and known.terrain.size == terrain.size:
        return game_map(_with_data(known.scenario, archive), terrain, digest)
    try:
        melee = _melee(_member(archive, OBJECTS), name, terrain.size)
        return game_map(_with_data(melee, archive), terrain, digest)
    except MapError as error:
        raise ArchiveError(str(error)) from error


def _with_data(scenario: Scenario, archive: Any) -> Scenario:
    """Return a scenario with the data set of the mods that an archive depends on, where it names any."""
    text = next((found for name in DEPENDENCIES if (found := _find(archive, name))), b"")
    mods = frozenset(name.lower() for name in MOD.findall(text))
    return scenario.model_copy(update={"data": DATA_OF_MODS.get(mods, DEFAULT_DATA)}) if mods else scenario


def _known(path: str) -> GameMap | None:
    """Return the shipped map of this name."""
    try:
        return load_map(find_map(path if path.endswith(".SC2Map") else f"{path}.SC2Map"))
    except MapError:
        return None


@lru_cache(maxsize=8)
def _terrain_of(data: bytes) -> tuple[MapTerrain, bytes]:
    """Return the terrain of an archive and a hash of the whole; cached, as many games use the same bytes."""
    archive = _open(data)
    try:
        info = terrain_file.read_map_info(_member(archive, "MapInfo"))
        painted = np.zeros(info.size[::-1], dtype=np.bool_)
        for name in CLOSED:
            paint = _find(archive, name)
            if paint is not None:
                painted |= terrain_file.read_paint(paint, info.size)
        ground = TerrainGrids(
            vertices=terrain_file.read_heights(_member(archive, "t3SyncHeightMap"), info.size),
            cliff=terrain_file.read_cliffs(_member(archive, "t3SyncCliffLevel"), info.size),
            on_cliff_tile=terrain_file.read_flags(_member(archive, "t3CellFlags"), info.size),
            painted=painted,
        )
    except TerrainError as error:
        raise ArchiveError(str(error)) from error
    return terrain_file.terrain_of(info, ground), hashlib.sha256(data).digest()


def _open(data: bytes) -> Any:
    try:
        return mpyq.MPQArchive(io.BytesIO(data), listfile=False)
    except (ValueError, TypeError, struct.error, KeyError, IndexError) as error:
        raise ArchiveError(f"the archive is damaged: {error}") from error


def _find(archive: Any, name: str) -> bytes | None:
    try:
        found: bytes | None = archive.read_file(name)
    except (ValueError, TypeError, struct.error, zlib.error, OSError, IndexError, RuntimeError) as error:
        raise ArchiveError(f"{name} in the archive can't be read: {error}") from error
    return found


def _member(archive: Any, name: str) -> bytes:
    found = _find(archive, name)
    if found is None:
        raise ArchiveError(f"the archive has no {name}")
    return found


# what stands on the map -----------------------------------------------------------------------------------------------


def _melee(objects: bytes, name: str, size: tuple[int, int]) -> Scenario:
    """Return a melee game on the start locations of a map, with its units; without any, two players with nothing."""
    try:
        root = _tree(objects)
        starts = [_point(o) for o in root.iter("ObjectPoint") if o.get("Type") == "StartLoc"]
        players = len(starts) or PLAYERS
        units = [unit for o in root.iter("ObjectUnit") if (unit := _unit(o, players, size)) is not None]
    except (ET.ParseError, ValueError, LookupError) as error:  # LookupError: an unknown encoding
        raise ArchiveError(f"{OBJECTS} in the archive can't be read: {error}") from error
    slot = {"race": "random", "control": "open", **({"ai": "melee"} if starts else {})}
    return Scenario.model_validate(
        {
            "name": re.sub(r"\W", "_", name, flags=re.ASCII) or "map",
            "family": FAMILY,
            "title": f"{'Melee' if starts else 'An open field'} on {name}",
            "terrain": "archive",
            "melee": bool(starts),
            "start_locations": starts,
            "players": dict.fromkeys(range(1, players + 1), slot),
            "units": units,
        }
    )


def _tree(data: bytes) -> ET.Element:
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ValueError("it declares entities")
    return ET.fromstring(data)  # noqa: S314  # without entities


def _point(element: ET.Element) -> tuple[float, float]:
    x, y = (_number(number) for number in element.get("Position", "").split(",")[:2])
    return x, y


def _number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is no number")
    return number


def _unit(element: ET.Element, players: int, size: tuple[int, int]) -> dict[str, Any] | None:
    """Return a placed unit in the form of a scenario; None for an unknown type, an absent player, or off the map."""
    kind = element.get("UnitType", "")
    owner = int(element.get("Player", "0"))
    if kind not in load_catalog().row_of_name or not 0 <= owner <= players:
        return None
    x, y = _point(element)
    if not (0 <= x <= size[0] and 0 <= y <= size[1]):
        return None
    unit: dict[str, Any] = {"player": owner, "unit": kind, "at": [(x, y)]}
    if (turned := element.get("Rotation")) is not None:
        unit["facing"] = (_number(turned) - QUARTER_TURN) % (2.0 * np.pi)
    return unit
