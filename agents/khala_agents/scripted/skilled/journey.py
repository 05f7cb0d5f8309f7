"""Where a team without enemies in sight goes: by a message, by its task, or to where enemies must be."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

from khala_agents.scripted.reading import points

if TYPE_CHECKING:
    from khala_agents.scripted.reading import Point, Situation, TextTeam
    from khala_agents.scripted.skilled.plan import ReplyPlan

MAP_CENTRE = (32.0, 32.0)
_PASSING = re.compile(r"\b(do not stop|around|along|out of sight|unseen)\b", re.IGNORECASE)
_PEACEFUL = re.compile(r"\b(gather|retreat|come home|wait)\b", re.IGNORECASE)
ARRIVED = 2.0
"""Cells of the minimap."""
FAR = 6.0
STRAY = 14.0
"""World units from the first unit of a team."""


class MarchingOrder(NamedTuple):
    """What a message orders."""

    goal: Point
    fights: bool
    """Whether to fight on the way."""


def passing(plan: ReplyPlan) -> bool:
    """Return whether the team is on a way on which it does not fight."""
    team = plan.team
    named = points(plan.team.task)
    if not named or team.minimap is None or not _PASSING.search(team.task):
        return False
    return math.dist(named[-1], team.minimap) > ARRIVED


def follows(plan: ReplyPlan) -> bool:
    """Return whether only a commander's orders say where the team goes."""
    return task_goal(plan.team, plan.situation) is None


def travel(plan: ReplyPlan) -> bool:
    """Plan the way of a team; return whether it has one to go."""
    team = plan.team
    told = None if plan.prey else told_order(plan.situation)
    goal = told.goal if told else task_goal(team, plan.situation)
    if goal is None or team.minimap is None:
        return False
    if math.dist(goal, team.minimap) <= ARRIVED and not (told and _strays(team)):
        return False
    if told is None and all(unit.order for unit in team.own) and not team.allies:
        return True  # already on its way
    if told is None and sum(bool(unit.order) for unit in team.own) > len(team.own) / 2:
        return True
    if math.dist(goal, team.minimap) > FAR and plan.give("Ability_AdeptPhaseShift_Minimap", goal):
        plan.give("Move_Minimap", goal)
        return True
    fights = told is not None and (told.fights or bool(team.enemies))
    return (fights and plan.give("Attack_Minimap", goal)) or plan.give("Move_Minimap", goal)


def _strays(team: TextTeam) -> bool:
    """Return whether a unit without an order is far from the first one: it is new, and has not heard of the order."""
    head = team.own[0]
    return any(not unit.order and math.dist((unit.x, unit.y), (head.x, head.y)) > STRAY for unit in team.own)


def told_order(situation: Situation) -> MarchingOrder | None:
    """Return the last order by a message that names a place; None if there is none."""
    told = [(text, named[-1]) for _, text in situation.messages if (named := points(text))]
    if not told:
        return None
    text, goal = told[-1]
    return MarchingOrder(goal, fights=not _PEACEFUL.search(text))


def task_goal(team: TextTeam, situation: Situation) -> Point | None:
    """Return the last place in the team's task, or else in the side's task; None to wait for a commander's order.

    Who has neither a place nor a commander goes to the middle of the map.
    """
    for text in (team.task, situation.task):
        if named := points(text):
            return named[-1]
        if text is team.task and text:
            return None
    return None if "Commander" in situation.correspondents else MAP_CENTRE
