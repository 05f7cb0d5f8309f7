"""State: a player's knowledge of the game at one moment, as values.

    snapshot   `Snapshot`, one per player and step        unit       `Unit` and `UnitOrder`
    episode    `EpisodeInfo`, one per episode             grid       creep, sight and ground as sent
    fog        creep as the player knows it
    read       messages of the SC2 API → these values     pictures   the game's own pixels

Below are names, frames and the knowledge of types. Above is everything that observes or acts; it reads no messages.
"""

from khala_bridge.state.episode import EpisodeInfo, PictureSizes
from khala_bridge.state.grid import Grid
from khala_bridge.state.pictures import GamePictures
from khala_bridge.state.read import read_info, read_snapshot, read_unit
from khala_bridge.state.snapshot import ActionError, Effect, Forfeit, PlayerScore, PlayerState, PowerSource, Snapshot
from khala_bridge.state.unit import Alliance, Display, Unit, UnitOrder

__all__ = [
    "ActionError",
    "Alliance",
    "Display",
    "Effect",
    "EpisodeInfo",
    "Forfeit",
    "GamePictures",
    "Grid",
    "PictureSizes",
    "PlayerScore",
    "PlayerState",
    "PowerSource",
    "Snapshot",
    "Unit",
    "UnitOrder",
    "read_info",
    "read_snapshot",
    "read_unit",
]
