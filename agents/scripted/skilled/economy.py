"""Leading what has no team of units: production, building, research, and the army of easy control."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from agents.scripted.reading import Team
    from agents.scripted.skilled.plan import Plan


def leads(team: Team) -> bool:
    """Whether a team is production, not an army."""
    return bool(team.own) and all(unit.type in {"WarpGate", "Gateway"} for unit in team.own)


def lead(plan: Plan, observation: str) -> None:
    """Plans what is built, trained, researched and commanded for the whole side."""
    del plan, observation
