"""How a side of a full game kept house, as its agents saw it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Economy:
    """Economy. All null if no agent of the side ever saw a town hall of its own in its counts.

    Only agents with the section of counts know these numbers: commanders, developers and builders. What one observation
    says holds until the next one.
    """

    supply_blocked_s: float | None
    """Seconds of the game in which all supply was used, and the cap was below the game's 200."""
    minerals_mean: float | None
    """Unspent minerals, mean over time."""
    vespene_mean: float | None
    """Unspent vespene, mean over time."""
    expansion_s: float | None
    """Seconds on the game's clock at which a town hall more than at first was seen, under way or finished; null if
    there was none."""
    workers_5min: int | None
    """Finished workers at 5:00 on the game's clock; null if the episode was over."""
    army_supply_5min: float | None
    """Supply that is not used by finished workers, at 5:00; null if the episode was over."""
    workers_end: int | None
    """Finished workers in the last observation."""
    army_supply_end: float | None
    """Supply that is not used by finished workers, in the last observation."""
    bases_end: int | None
    """Finished town halls in the last observation."""
