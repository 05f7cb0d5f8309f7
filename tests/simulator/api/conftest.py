"""Games for tests: a map and units of the test's choice, and what a player receives of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game import HostedGame, Setup
from khala_simulator.api.observation import observe
from khala_simulator.combat import lifecycle
from khala_simulator.maps.map_file import read_map

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.world.world import World

BARE = """# A map of Khala's simulator
name: bare
family: test
title: No script
terrain: {terrain}
visibility: {{fog: {fog}, black_mask: {fog}}}
camera: [16, 16]
players:
  1: {{race: protoss, control: agent}}
  2: {{race: zerg, control: computer}}
"""
DTYPES: dict[int, np.dtype[Any]] = {8: np.dtype(np.uint8), 24: np.dtype(np.uint8), 32: np.dtype("<i4")}


def unpack(data: common_pb2.ImageData) -> NDArray[Any]:
    """Return an image by the contract: rows from the top, most significant bit first, little-endian, RGB."""
    if data.bits_per_pixel == 1:
        pixels = np.unpackbits(np.frombuffer(data.data, np.uint8))[: data.size.x * data.size.y]
    else:
        pixels = np.frombuffer(data.data, DTYPES[data.bits_per_pixel])
    return pixels.reshape((data.size.y, data.size.x) + ((3,) if data.bits_per_pixel == 24 else ()))


class Table:
    """A game with one player who looks at it."""

    def __init__(self, options: sc.InterfaceOptions, terrain: str = "agria_open", *, fog: bool = False) -> None:
        text = BARE.format(terrain=terrain, fog=str(fog).lower())
        players = (
            sc.PlayerSetup(type=sc.Participant, race=common_pb2.Protoss),
            sc.PlayerSetup(type=sc.Computer, race=common_pb2.Zerg),
        )
        game_map = read_map(text.encode(), "bare.SC2Map")
        self.game = HostedGame(Setup(game_map, b"", "bare", players, 1, disable_fog=False, realtime=False), "4.10")
        self.seat: PlayerSeat = self.game.sit(1, options)

    @property
    def world(self) -> World:
        return self.game.world

    def put(self, name: str, owner: int, x: float, y: float, facing: float = 0.0) -> int:
        return lifecycle.spawn(self.world, self.world.catalog.unit(name), owner, (x, y), facing)

    def respond(self) -> sc.ResponseObservation:
        return sc.ResponseObservation.FromString(b"".join(observe(self.game, self.seat)))

    def observe(self) -> sc.Observation:
        return self.respond().observation

    def screen(self, name: str) -> NDArray[Any]:
        return unpack(getattr(self.observe().feature_layer_data.renders, name))

    def minimap(self, name: str) -> NDArray[Any]:
        return unpack(getattr(self.observe().feature_layer_data.minimap_renders, name))

    def picture(self) -> NDArray[Any]:
        return unpack(self.observe().render_data.map)

    def overview(self) -> NDArray[Any]:
        return unpack(self.observe().render_data.minimap)


@pytest.fixture(scope="session")
def make_table() -> Callable[..., Table]:
    return Table
