"""Look at an install: does its game start, which maps does it load, does it draw.

Above: `khala_sc2.commands.doctor`. Below: `connection`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.calibrate.catalogue import PROBES
from khala_bridge.calibrate.connection import run_game, version
from khala_bridge.errors import GameError
from khala_bridge.task.maps import known_maps

if TYPE_CHECKING:
    from pathlib import Path

    from khala_bridge.calibrate.connection import Connection

_PIXELS: Final = 64


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found."""

    version: str
    build: int
    loaded: tuple[str, ...]
    """Files below `Maps` that the game plays."""
    refused: dict[str, str]
    """Files that it does not, with its reason."""
    absent: tuple[str, ...]
    """Files of Khala's maps that are not there."""
    renders: bool
    rendering: str
    """What was drawn, or why nothing was."""


def survey(sc2path: Path, environment: dict[str, str] | None = None) -> Survey:
    """Start the game of an install, and try every map that Khala knows.

    Raises:
        GameMissing: there is no game.
        GameError: it cannot be run_game, or dies.
    """
    files = sorted({spec.file for spec in known_maps().values()} | {probe.setting.map for probe in PROBES})
    there = [file for file in files if (sc2path / "Maps" / file).is_file()]
    with run_game(sc2path, environment) as connection:
        said, build, _ = version(connection)
        tried = {file: _try(connection, file) for file in there}
        loaded = tuple(file for file, trouble in tried.items() if not trouble)
        renders, rendering = _draws(connection, loaded[0]) if loaded else (False, "no map to draw")
    return Survey(
        version=said,
        build=build,
        loaded=loaded,
        refused={file: trouble for file, trouble in tried.items() if trouble},
        absent=tuple(file for file in files if file not in tried),
        renders=renders,
        rendering=rendering,
    )


def _try(connection: Connection, file: str, options: Any = None) -> str:
    """Begin a game on a map; return why it cannot be, "" if it can."""
    setups = [sc.PlayerSetup(type=sc.Participant)]
    spec = next((spec for spec in known_maps().values() if spec.file == file), None)
    if spec is None or spec.opponent is not None:
        setups.append(sc.PlayerSetup(type=sc.Computer, race=common_pb2.Terran, difficulty=sc.VeryEasy))
    create = sc.RequestCreateGame(local_map=sc.LocalMap(map_path=file), player_setup=setups)
    try:
        made = connection.send(create_game=create)
        if made.HasField("error"):
            return f"{sc.ResponseCreateGame.Error.Name(made.error)} {made.error_details}".strip()
        join = sc.RequestJoinGame(race=common_pb2.Terran, options=options or sc.InterfaceOptions(raw=True))
        joined = connection.send(join_game=join)
    except GameError as error:
        return str(error)
    if joined.HasField("error"):
        return f"{sc.ResponseJoinGame.Error.Name(joined.error)} {joined.error_details}".strip()
    return ""


def _draws(connection: Connection, file: str) -> tuple[bool, str]:
    size = common_pb2.Size2DI(x=_PIXELS, y=_PIXELS)
    setup = sc.SpatialCameraSetup(width=24, resolution=size, minimap_resolution=size)
    trouble = _try(connection, file, sc.InterfaceOptions(raw=True, render=setup, feature_layer=setup))
    if trouble:
        return False, trouble
    connection.send(step=sc.RequestStep(count=1))
    seen = connection.send(observation=sc.RequestObservation()).observation
    if not seen.render_data.map.data:
        return False, "the game draws no images (rgb), only feature layers"
    return True, f"images (rgb) and feature layers, {_PIXELS} x {_PIXELS} asked for and sent"
