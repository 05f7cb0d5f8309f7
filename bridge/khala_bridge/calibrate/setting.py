"""The kinds of games that probes need, and how one begins. Above: `lab`. Below: `connection`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.errors import GameError

if TYPE_CHECKING:
    from khala_bridge.calibrate.connection import Connection


@dataclass(frozen=True, slots=True)
class Setting:
    """The kind of game that a probe needs; probes of one setting share a game."""

    map: str = "Melee/Flat128.SC2Map"
    fog: bool = False
    race: str = "Terran"
    level: int = 1
    peaceful: bool = True
    """Whether the workers of both players are removed."""


def new_game(connection: Connection, setting: Setting, seed: int) -> None:
    """Begin a game as its first player.

    Args:
        connection: to a game that plays nothing, or something that may end.
        setting: of the game.
        seed: of its chance.

    Raises:
        GameError: the game refuses the map or the join.
    """
    race = common_pb2.Race.Value(setting.race)
    players = [
        sc.PlayerSetup(type=sc.Participant),
        sc.PlayerSetup(
            type=sc.Computer,
            race=race,
            difficulty=setting.level,  # type: ignore[arg-type]  # stubs want the enum's own type
        ),
    ]
    wanted = sc.RequestCreateGame(
        local_map=sc.LocalMap(map_path=setting.map),
        player_setup=players,
        disable_fog=not setting.fog,
        random_seed=seed,
    )
    made = connection.send(create_game=wanted)
    if made.HasField("error"):
        name = sc.ResponseCreateGame.Error.Name(made.error)
        raise GameError(f"the game refuses the map {setting.map}: {name} {made.error_details}".rstrip())
    options = sc.InterfaceOptions(raw=True, score=True, show_cloaked=True, show_burrowed_shadows=True)
    joined = connection.send(join_game=sc.RequestJoinGame(race=race, options=options))
    if joined.HasField("error"):
        name = sc.ResponseJoinGame.Error.Name(joined.error)
        raise GameError(f"the game refuses to be joined: {name} {joined.error_details}".rstrip())
