"""What calls an agent that is not asked at every step: its units were attacked, or have nothing to do.

Functions of what the side sees now and of the agent's units at its last observation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Mapping

    from khala_bridge.observe.observation import SideObservation
    from khala_protocol.messages import Trigger

MIN_LOSS = 1.0
"""Loss of health and shield that counts as an attack; the game's numbers waver below it."""


def vitals(observation: SideObservation, agent: str) -> dict[int, float]:
    """Return health and shield of each unit of an agent, by tag."""
    units = observation.snapshot.units
    tags = (tag for team in observation.teams[agent] for tag in team.tags)
    return {tag: units[tag].health + units[tag].shield for tag in tags if tag in units}


def triggers(observation: SideObservation, agent: str, before: Mapping[int, float]) -> Iterator[Trigger]:
    """Yield what happened to an agent's units since they had the vitals `before`."""
    now = vitals(observation, agent)
    if were_attacked(before, now, observation.died):
        yield "attacked"
    if any(not observation.snapshot.units[tag].orders for tag in now):
        yield "idle"


def were_attacked(before: Mapping[int, float], now: Mapping[int, float], died: Container[int]) -> bool:
    """Return True if a unit that had the vitals `before` has lost health or died."""
    return any(tag in died or now.get(tag, total) <= total - MIN_LOSS for tag, total in before.items())
