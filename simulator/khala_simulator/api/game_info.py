"""The answer to `game_info`: players, options and the map.

All of it but the paths is the same for the whole game, and clients ask once per loop; so the message is serialised once
and only the pathing grid is replaced. Above: `play.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import wire
from khala_simulator.api.sight import Alliance
from khala_simulator.api.viewer import Viewer

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from s2clientprotocol import common_pb2

    from khala_simulator.api.game import HostedGame
    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.api.wire import Part
    from khala_simulator.world.world import World

    Structure = tuple[int, float, float]  # row of its type, and where it stands

MODS = ("Core", "Liberty", "Swarm", "Void", "VoidMulti")
_START_RAW = sc.ResponseGameInfo.DESCRIPTOR.fields_by_name["start_raw"].number
RACES = {"terran": 1, "zerg": 2, "protoss": 3}
"""The API's numbers of races."""


class GameInfo:
    """The game info of one seat."""

    def __init__(self, game: HostedGame, seat: PlayerSeat) -> None:
        self._world = game.world
        self._seat = seat
        self._fixed = _message(game, seat).SerializeToString()
        self._map = _start_raw(seat).SerializeToString()
        self._known: tuple[Structure, ...] | None = None
        self._paths = b""

    def encode(self) -> list[Part]:
        """Return the parts of a `ResponseGameInfo`."""
        known = known_structures(self._seat)
        if known != self._known:
            start = raw_pb2.StartRaw()
            _write_image(start.pathing_grid, _crop(self._seat, paths(self._world, known)), 1)
            self._known = known
            self._paths = start.SerializeToString()
        return [self._fixed, *wire.embed(_START_RAW, [self._map, self._paths])]


def _message(game: HostedGame, seat: PlayerSeat) -> sc.ResponseGameInfo:
    game_map = game.setup.game_map
    info = sc.ResponseGameInfo(
        map_name=game_map.name,
        local_map_path=f"{game_map.name}.SC2Map",
        mod_names=[f"Mods/{name}.SC2Mod" for name in MODS],
        options=seat.options,
    )
    for number, asked in enumerate(game.setup.players, start=1):
        player = info.player_info.add(player_id=number, type=asked.type, race_requested=asked.race)
        if asked.player_name:
            player.player_name = asked.player_name
        if asked.type == sc.Computer:
            player.difficulty, player.ai_build = asked.difficulty, asked.ai_build
        race = RACES.get(game.world.players[number].race)
        if race is not None and (number == seat.player or isinstance(seat, Viewer)):
            player.race_actual = race  # type: ignore[assignment]  # numbers of the API's own enum
    for number, asked in enumerate(game.setup.observers, start=len(game.setup.players) + 1):
        info.player_info.add(player_id=number, type=asked.type, player_name=asked.player_name)
    return info


def _start_raw(seat: PlayerSeat) -> raw_pb2.StartRaw:
    """Return the part of the map that never changes; the placement grid is of the bare terrain, as in the game."""
    terrain = seat.world.map.terrain
    start = raw_pb2.StartRaw()
    start.map_size.x, start.map_size.y = _crop(seat, terrain.build).shape[::-1]
    x0, y0, x1, y1 = terrain.playable
    (start.playable_area.p0.x, start.playable_area.p0.y) = (x0 - int(seat.origin[0]), y0 - int(seat.origin[1]))
    (start.playable_area.p1.x, start.playable_area.p1.y) = (x1 - int(seat.origin[0]), y1 - int(seat.origin[1]))
    _write_image(start.placement_grid, _crop(seat, terrain.build), 1)
    _write_image(start.terrain_height, _crop(seat, terrain.height), 8)
    for x, y in _start_locations(seat):
        start.start_locations.add(x=x - seat.origin[0], y=y - seat.origin[1])
    return start


def _start_locations(seat: PlayerSeat) -> list[tuple[float, float]]:
    """Return where others may have started: every start location of the map but the player's own."""
    scenario = seat.world.map.scenario
    fixed = [spec.start for spec in scenario.players.values() if spec.start is not None]
    own = seat.world.players[seat.player].start
    return [place for place in dict.fromkeys((*fixed, *scenario.start_locations)) if place != own]


def _crop(seat: PlayerSeat, grid: NDArray[np.generic]) -> NDArray[np.generic]:
    if not seat.options.raw_crop_to_playable_area:
        return grid
    x0, y0, x1, y1 = seat.world.map.terrain.playable
    return grid[y0:y1, x0:x1]


def known_structures(seat: PlayerSeat) -> tuple[Structure, ...]:
    """Return the structures and resources that the player sees or remembers; its game info omits others."""
    sight = seat.look()
    stays = seat.types.structure[sight.row] | (sight.alliance == Alliance.NEUTRAL.value)
    rows, points = sight.row[stays].tolist(), sight.pos[stays].tolist()
    return tuple((row, x, y) for row, (x, y) in zip(rows, points, strict=True))


def paths(world: World, structures: tuple[Structure, ...]) -> NDArray[np.bool_]:
    """Return [y, x] where ground units can walk, if these structures are all that stands there."""
    grid = world.map.terrain.walk.copy()
    catalog = world.catalog
    for row, x, y in structures:
        footprint = catalog.footprints.get(catalog.units[row].footprint)
        if footprint is not None and footprint.cells:
            cells = np.floor((x + 1e-9, y + 1e-9)).astype(np.int64) + np.array(footprint.cells, dtype=np.int64)
            cells = np.clip(cells, 0, np.array(grid.shape[::-1]) - 1)
            grid[cells[:, 1], cells[:, 0]] = False
    return grid


def _write_image(image: common_pb2.ImageData, grid: NDArray[Any], bits_per_pixel: int) -> None:
    """Fill an image with a grid [y, x] of the map; raw images start at the bottom-left, as the grids do."""
    image.bits_per_pixel = bits_per_pixel
    image.size.y, image.size.x = grid.shape
    packed = np.packbits(grid.astype(np.bool_), axis=None) if bits_per_pixel == 1 else grid.astype(np.uint8)
    image.data = packed.tobytes()
