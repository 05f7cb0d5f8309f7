"""Where a team without enemies in sight goes: by a message, by its task, or to where enemies must be."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import points

if TYPE_CHECKING:
    from khala_agents.scripted.reading import Point, Situation, TextTeam
    from khala_agents.scripted.skilled.plan import ReplyPlan

MAP_CENTRE = (32.0, 32.0)
_PASSING = re.compile(r"\b(do not stop|around|along|out of sight|unseen)\b", re.IGNORECASE)
ARRIVED = 2.0
"""Cells of the minimap."""
FAR = 6.0


def passing(plan: ReplyPlan) -> bool:
    """Return whether the team is on a way on which it does not fight."""
    team, named = plan.team, points(plan.team.task)
    if not named or team.minimap is None or not _PASSING.search(team.task):
        return False
    return math.dist(named[-1], team.minimap) > ARRIVED


def travel(plan: ReplyPlan) -> bool:
    """Plan the way of a team; return whether it has one to go."""
    team, told = plan.team, None if plan.prey else told_goal(plan.situation)
    goal = told or task_goal(team, plan.situation)
    if goal is None or team.minimap is None or math.dist(goal, team.minimap) <= ARRIVED:
        return False
    if told is None and all(unit.order for unit in team.own) and not team.allies:
        return True  # already on its way
    if told is None and sum(bool(unit.order) for unit in team.own) > len(team.own) / 2:
        return True
    if math.dist(goal, team.minimap) > FAR and plan.give("Ability_AdeptPhaseShift_Minimap", goal):
        plan.give("Move_Minimap", goal)
        return True
    return plan.give("Move_Minimap", goal)


def told_goal(situation: Situation) -> Point | None:
    """Return the place of the last call for help that names one."""
    named = [place for _, text in situation.messages for place in points(text)]
    return named[-1] if named else None


def task_goal(team: TextTeam, situation: Situation) -> Point | None:
    """Return the last place in the team's task, or else in the side's task, or else the middle of the map."""
    for text in (team.task, situation.task):
        if named := points(text):
            return named[-1]
        if text is team.task and text:
            return None
    return MAP_CENTRE
