"""A battle in this process: game loops, and units as columns, without messages or sockets.

It is the game that a client of the game process plays: the same map, seed and orders make the same world, loop for
loop, and units have the values that an observation has. It is for maps of one agent without fog, such as SMAC's, whose
player sees all units at any time. Environments for reinforcement learning are above it; below it is `api`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.abilities import commands
from khala_simulator.api import vitals
from khala_simulator.api.game import HostedGame, Setup
from khala_simulator.api.game_info import known_structures, paths
from khala_simulator.api.layers import Frame
from khala_simulator.api.seat import PlayerSeat
from khala_simulator.api.sight import look
from khala_simulator.api.vital_rows import ROWS
from khala_simulator.maps.game_map import load_map
from khala_simulator.tables.versions import DEFAULT_VERSION
from khala_simulator.tick import advance
from khala_simulator.world.columns import INDEX_SHIFT, SLOT_BITS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

PLAYER: Final = 1
ENEMY: Final = 2


class BattleGround(NamedTuple):
    """The map, as the game's information on it has it."""

    size: tuple[int, int]
    """Width and height of the map, world units."""
    playable: tuple[int, int, int, int]
    """x0, y0, x1, y1."""
    walkable: Bools
    """[height, width], row 0 in the south; not under structures."""
    height: NDArray[np.uint8]
    """[height, width], row 0 in the south."""


class Units(NamedTuple):
    """Columns of units, one for each; numbers are rounded to those of a message, which has 32 bits for each."""

    tag: Ints
    type_id: Ints
    numbers: Floats
    """[8, n]: x, y, life, life_max, shields, shields_max, energy, cooldown."""

    @property
    def x(self) -> Floats:
        """World units from the west."""
        return _row(self.numbers, 0)

    @property
    def y(self) -> Floats:
        """World units from the south."""
        return _row(self.numbers, 1)

    @property
    def life(self) -> Floats:
        """Hit points."""
        return _row(self.numbers, 2)

    @property
    def life_max(self) -> Floats:
        """Hit points of an unhurt unit."""
        return _row(self.numbers, 3)

    @property
    def shields(self) -> Floats:
        """Shield points."""
        return _row(self.numbers, 4)

    @property
    def shields_max(self) -> Floats:
        """Shield points of an unhurt unit."""
        return _row(self.numbers, 5)

    @property
    def energy(self) -> Floats:
        """Energy."""
        return _row(self.numbers, 6)

    @property
    def cooldown(self) -> Floats:
        """Game loops until its weapon can fire again; 0 without one."""
        return _row(self.numbers, 7)


def _row(numbers: Floats, number: int) -> Floats:
    row: Floats = numbers[number]
    return row


class Battle:
    """One running game.

    Attributes:
        world: to which `khala_simulator.smac` gives orders.
        types: what the API says of the types of units.
    """

    def __init__(
        self,
        map_name: str,
        *,
        seed: int,
        difficulty: int = sc.VeryHard,
        version: str = DEFAULT_VERSION,
    ) -> None:
        """Begin a game.

        Args:
            map_name: of a shipped map, `SMAC_Maps/3m`.
            seed: of all that the game leaves to chance.
            difficulty: the API's number of the computer player's level, 1 to 10.
            version: of the game whose tables it has.

        Raises:
            ValueError: the map has fog.
        """
        players = (
            sc.PlayerSetup(type=sc.Participant),
            sc.PlayerSetup(type=sc.Computer, difficulty=difficulty),  # type: ignore[arg-type]  # the API's numbers
        )
        game_map = load_map(map_name)
        if game_map.scenario.visibility.fog:
            raise ValueError(f"{map_name} has fog: a battle without messages is for maps whose player sees all units")
        self._game = HostedGame(
            Setup(game_map, b"", map_name, players, seed=seed, disable_fog=False, realtime=False), version
        )
        self.world: World = self._game.world
        self.types: Types = self._game.types
        self._seat: PlayerSeat | None = None

    @property
    def loop(self) -> int:
        """Game loops since its begin."""
        return self.world.loop

    def digest(self) -> str:
        """Return the SHA-256 of everything that decides the future."""
        return self.world.digest()

    def ground(self) -> BattleGround:
        """Return the map as it is now."""
        terrain = self.world.map.terrain
        structures = known_structures(PlayerSeat(self.world, self.types, PLAYER, sc.InterfaceOptions()))
        return BattleGround(terrain.size, terrain.playable, paths(self.world, structures), terrain.height)

    # acting -------------------------------------------------------------------------------------------------------

    def kill(self, tags: Iterable[int]) -> None:
        """Kill units of any player; they die in the next loop."""
        commands.debug_kill(self.world, tags)

    def advance(self, loops: int) -> None:
        """Play a number of game loops."""
        advance(self.world, loops)

    def forget_past(self) -> None:
        """Drop the lists of past events, which grow in a long game and have no reader here."""
        world = self.world
        world.deaths, world.deaths_seen = world.deaths[world.deaths_seen :], 0
        world.mishaps, world.alerts = [], []

    # seeing -------------------------------------------------------------------------------------------------------

    def tags(self) -> tuple[Ints, Ints]:
        """Return the tags of the player's units and of the enemies, in the order in which an observation has them."""
        sight = look(self.world, self.types, PLAYER, show_cloaked=False)
        return sight.tag[sight.owner == PLAYER], sight.tag[sight.owner == ENEMY]

    def look(self, tags: Ints) -> tuple[Bools, Units]:
        """Return which of these units are in the world, and all of them; of the others, the numbers mean nothing."""
        world = self.world
        there = np.empty(len(tags), dtype=np.bool_)
        numbers = np.zeros((ROWS, len(tags)))
        vitals.look(world, self.types, np.ascontiguousarray(tags), there, numbers)
        rows = world.type[tags >> INDEX_SHIFT & SLOT_BITS]
        return there, Units(tags, self.types.id[rows], numbers)

    def picture(self, width: int, height: int) -> NDArray[np.uint8]:
        """Return a picture of the playable part of the map, [height, width, 3] RGB, as a client has it rendered."""
        if self._seat is None or (self._seat.screen.columns, self._seat.screen.rows) != (width, height):
            self._seat = self._camera(width, height)
        seat, world = self._seat, self.world
        sight = seat.look()
        nothing = np.zeros(len(sight), dtype=np.bool_)
        frame = Frame(world, self.types, PLAYER, sight, nothing, seat.camera, sight.pos[nothing], fogged=False)
        assert seat.renders is not None
        return seat.renders.screen(frame)

    def _camera(self, width: int, height: int) -> PlayerSeat:
        """Return a seat whose camera has the whole playable area in its picture."""
        x0, y0, x1, y1 = self.world.map.terrain.playable
        wide = max(x1 - x0, (y1 - y0) * width / height)
        size = common_pb2.Size2DI(x=width, y=height)
        render = sc.SpatialCameraSetup(width=wide, resolution=size, minimap_resolution=size)
        seat = PlayerSeat(self.world, self.types, PLAYER, sc.InterfaceOptions(raw=True, render=render))
        seat.hands.camera = (x0 + x1) / 2, (y0 + y1) / 2
        return seat
