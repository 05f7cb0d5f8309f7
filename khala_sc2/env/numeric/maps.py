"""The maps of SMAC: who fights, for how long, and how SMAC tells their units apart.

The numbers are those of SMAC's own table, `smac.env.starcraft2.maps.smac_maps`. Below: nothing.
"""

from __future__ import annotations

import difflib
from typing import Literal, NamedTuple, TypeAlias

from khala_protocol.errors import ConfigError

Kind: TypeAlias = Literal[
    "MMM", "bane", "colossi_stalkers_zealots", "colossus", "hydralisks", "marines", "stalkers", "stalkers_and_zealots",
    "zealots",
]  # fmt: skip


class SmacMap(NamedTuple):
    """What SMAC says of one of its maps."""

    agents: int
    enemies: int
    limit: int
    """Steps of an episode."""
    races: str
    """Initials of the race of the agents and of the enemies."""
    type_bits: int
    """Length of the one-hot code of a unit's type; 0 where all units of a side are alike."""
    kind: Kind


MAPS = {
    "3m": SmacMap(3, 3, 60, "TT", 0, "marines"),
    "8m": SmacMap(8, 8, 120, "TT", 0, "marines"),
    "25m": SmacMap(25, 25, 150, "TT", 0, "marines"),
    "5m_vs_6m": SmacMap(5, 6, 70, "TT", 0, "marines"),
    "8m_vs_9m": SmacMap(8, 9, 120, "TT", 0, "marines"),
    "10m_vs_11m": SmacMap(10, 11, 150, "TT", 0, "marines"),
    "27m_vs_30m": SmacMap(27, 30, 180, "TT", 0, "marines"),
    "MMM": SmacMap(10, 10, 150, "TT", 3, "MMM"),
    "MMM2": SmacMap(10, 12, 180, "TT", 3, "MMM"),
    "2s3z": SmacMap(5, 5, 120, "PP", 2, "stalkers_and_zealots"),
    "3s5z": SmacMap(8, 8, 150, "PP", 2, "stalkers_and_zealots"),
    "3s5z_vs_3s6z": SmacMap(8, 9, 170, "PP", 2, "stalkers_and_zealots"),
    "3s_vs_3z": SmacMap(3, 3, 150, "PP", 0, "stalkers"),
    "3s_vs_4z": SmacMap(3, 4, 200, "PP", 0, "stalkers"),
    "3s_vs_5z": SmacMap(3, 5, 250, "PP", 0, "stalkers"),
    "1c3s5z": SmacMap(9, 9, 180, "PP", 3, "colossi_stalkers_zealots"),
    "2m_vs_1z": SmacMap(2, 1, 150, "TP", 0, "marines"),
    "corridor": SmacMap(6, 24, 400, "PZ", 0, "zealots"),
    "6h_vs_8z": SmacMap(6, 8, 150, "ZP", 0, "hydralisks"),
    "2s_vs_1sc": SmacMap(2, 1, 300, "PZ", 0, "stalkers"),
    "so_many_baneling": SmacMap(7, 32, 100, "PZ", 0, "zealots"),
    "bane_vs_bane": SmacMap(24, 24, 200, "ZZ", 2, "bane"),
    "2c_vs_64zg": SmacMap(2, 64, 400, "PZ", 0, "colossus"),
}


def smac_map(name: str) -> SmacMap:
    """Return what SMAC says of a map.

    Raises:
        ConfigError: it has no such map.
    """
    if name not in MAPS:
        close = difflib.get_close_matches(name, MAPS, n=3)
        hint = f"did you mean {', '.join(close)}? " if close else ""
        raise ConfigError(f"SMAC has no map {name!r}: {hint}It has {', '.join(MAPS)}")
    return MAPS[name]
