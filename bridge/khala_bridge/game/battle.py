"""The end of a battle on a map that has none.

SMAC's maps bring both sides back when both are dead, and the game goes on. SMAC's package ends the episode itself, as
is done here: a side has lost when none of the units that it began with can fight any more.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

from khala_bridge.state.unit import Alliance

if TYPE_CHECKING:
    from khala_bridge.state import Snapshot

HEALERS: Final = frozenset({"Medivac"})
"""Types that do not fight on alone, for SMAC's package."""


class Battle:
    """The units with which both sides begin."""

    def __init__(self, first: Snapshot) -> None:
        """Remember the units of an episode that begins."""
        self._units = frozenset(first.units)

    def judge(self, now: Snapshot) -> Snapshot:
        """Return the snapshot with the outcome of the battle; the same one while both sides fight on.

        If both died at once, the map has brought them back by now: units of another battle, which are taken out.
        """
        if now.ended:
            return now
        left = {tag: unit for tag, unit in now.units.items() if tag in self._units}
        fighting = {unit.alliance for unit in left.values() if unit.name not in HEALERS}
        if {Alliance.OWN, Alliance.ENEMY} <= fighting:
            return now
        if Alliance.OWN in fighting:
            return dataclasses.replace(now, ended=True, outcome="win")
        if Alliance.ENEMY in fighting:
            return dataclasses.replace(now, ended=True, outcome="loss")
        own = tuple(unit for unit in now.own if unit.tag in left)
        return dataclasses.replace(now, ended=True, outcome="draw", known=left, units=left, own=own)
