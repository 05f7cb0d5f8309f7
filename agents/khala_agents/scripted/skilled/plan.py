"""The orders that a player plans for one team, and the limit on their number."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_agents.scripted.writing import call, inside

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.scripted.reading import Point, Situation, TextTeam, TextUnit


@dataclass(slots=True)
class ReplyPlan:
    """Calls for one team in one reply; skills first, the order for the whole team last."""

    team: TextTeam
    situation: Situation
    calls: list[str] = field(default_factory=list)
    support: Mapping[str, float] = field(default_factory=dict)
    """By the tag of an enemy: how many units of all teams have it in reach."""
    prey: str = ""
    """What else the team hunts, beyond the fight: "worker", "hall" or "place"; "" if other teams may call it."""
    busy: set[str] = field(default_factory=set)
    """Tags of units that have an order in this reply."""

    @property
    def left(self) -> int:
        """Number of calls that the team may still get."""
        return self.situation.max_actions - len(self.calls)

    def give(self, name: str, *values: str | Point) -> bool:
        """Add a call, if the action is valid and the limit allows it; return whether it was added."""
        form = next((action for action in self.team.actions if action.name == name), None)
        if form is None or self.left <= 0 or len(form.args) != len(values):
            return False
        fitted = [
            value if isinstance(value, str) else inside(value, self.team) if kind == "screen" else value
            for kind, value in zip(form.args, values, strict=True)
        ]
        self.calls.append(call(name, *fitted))
        return True

    def cast(self, skill: str, caster: TextUnit, *values: str | Point) -> bool:
        """Order one unit's skill by its own action, or by the team's if the unit is the whole team."""
        tag = caster.tag
        if tag in self.busy or any(name in skill for name in caster.not_ready):
            return False
        alone = len(self.team.own) == 1
        names = [action.name for action in self.team.actions if skill in action.name]
        single = [name for name in names if name.startswith("Select_") and "_Two_" not in name]
        done = any(self.give(name, tag, *values) for name in single)
        if not done and (alone or not single):
            done = any(self.give(name, *values) for name in names if name not in single)
        if done:
            self.busy.add(tag)
        return done
