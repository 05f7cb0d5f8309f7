"""Fight with one team: choose a target, step back, pull hurt units out of the fight.

The team shoots at the enemy whose loss helps most for the time it takes. While its weapons cool down, it steps out
of the reach of slower or shorter-ranged enemies. Units that are nearly dead blink or walk out of reach first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.scripted.skilled.journey import told_order, travel
from khala_agents.scripted.skilled.kinds import IGNORED, TOWN_HALLS, kind_of
from khala_agents.scripted.skilled.space import away, distance, middle, nearest

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_agents.scripted.reading import TextTeam, TextUnit
    from khala_agents.scripted.skilled.plan import ReplyPlan

CROWD = 6
"""Units from which a team fights by itself while it marches."""
HURT = 0.5
"""Share of hit points below which a unit is pulled back."""
IN_DANGER = 7.0
BESIDE = 3.0
"""World units from its friends' middle within which a team without weapons stays."""
STEP_BACK = 4.5
BLINK = 7.5
WALK_COST = 1.5
"""World units of walking that halve what a target is worth."""
MELEE_WALK_COST = 1.0
"""The same for units that stand in each other's way."""
COOLING_S = 0.3
CLINGING = 230.0
"""Worth of an enemy that chases the team closely during a raid; a worker is worth 200."""


def targets(team: TextTeam) -> list[TextUnit]:
    """Return the enemies that some unit of the team has a weapon against, on this map."""
    mine = [kind_of(unit) for unit in team.own]
    return [
        enemy
        for enemy in team.enemies
        if enemy.type not in IGNORED and team.reaches(enemy) and any(kind.hits(kind_of(enemy)) for kind in mine)
    ]


def threats(team: TextTeam) -> list[TextUnit]:
    """Return the enemies that have a weapon against some unit of the team."""
    mine = [kind_of(unit) for unit in team.own]
    return [
        enemy
        for enemy in team.enemies
        if enemy.built >= 100 and kind_of(enemy).role != "worker" and any(kind_of(enemy).hits(kind) for kind in mine)
    ]


def worth(enemy: TextUnit, prey: str) -> float:
    """Return the worth of killing an enemy.

    Args:
        enemy: of the other side.
        prey: what else the team hunts, beyond the fight: "worker" or "hall"; "" for nothing.
    """
    kind = kind_of(enemy)
    value = kind.damage
    if prey == "worker" and kind.role == "worker":
        value = 200.0
    if prey == "hall" and enemy.type in TOWN_HALLS:
        value = 2e5
    if enemy.hallucination or enemy.built < 100:
        value *= 0.2
    return value


def support(teams: Iterable[TextTeam]) -> dict[str, float]:
    """Return, by the tag of an enemy, how many units of all teams have it in reach, or nearly."""
    count: dict[str, float] = {}
    for team in teams:
        for enemy in team.enemies:
            able = sum(_gap(unit, enemy) < 1.0 and kind_of(unit).hits(kind_of(enemy)) for unit in team.own)
            count[enemy.tag] = count.get(enemy.tag, 0.0) + able
    return count


def best_target(plan: ReplyPlan, prey: str = "") -> TextUnit | None:
    """Return the enemy whose loss helps most for the time and the way it takes; None without targets.

    A target that other teams reach as well is better.
    """
    team = plan.team
    most = max(1.0, *plan.support.values()) if plan.support else 1.0
    shooters = [unit for unit in team.own if kind_of(unit).reach >= 0]
    if not shooters:
        return None
    patience = MELEE_WALK_COST if all(kind_of(unit).melee for unit in shooters) else WALK_COST

    def value(enemy: TextUnit) -> tuple[float, str]:
        able = [unit for unit in shooters if kind_of(unit).hits(kind_of(enemy))]
        ways = sorted(max(0.0, distance(unit, enemy) - _range(unit, enemy) - 1.0) for unit in able)
        way = ways[len(ways) // 2]
        value = worth(enemy, prey)
        if prey == "worker" and kind_of(enemy).melee and any(_gap(enemy, unit) < 1.0 for unit in team.own):
            value = max(value, CLINGING)  # a team that is chased closely cannot raid
        shared = 0.5 + plan.support.get(enemy.tag, 0.0) / most
        return -shared * value / (enemy.hit_points + 30.0) / 2 ** (way / patience), enemy.tag

    return min(targets(team), key=value, default=None)


def fight(plan: ReplyPlan, prey: str = "") -> bool:
    """Plan a fight of one team against the enemies it sees; return whether there is one."""
    team = plan.team
    target = best_target(plan, prey)
    foes = threats(team)
    if target is None and not foes:
        return False
    if prey != "hall":  # a team that destroys a base does not come back
        save_the_hurt(plan, foes)
    if target is None:
        return bool(prey) or _keep_off(plan, foes)
    return (not prey and step_back(plan, foes)) or shoot(plan, target)


def shoot(plan: ReplyPlan, target: TextUnit) -> bool:
    """Order the team to attack one enemy; units without a weapon against it take the next best one."""
    team = plan.team
    able = [unit for unit in team.own if kind_of(unit).hits(kind_of(target))]
    if len(able) == len(team.own) or not team.can("Select_Unit_Attack_Unit"):
        return plan.give("Attack_Unit", target.tag)
    given = [plan.give("Select_Unit_Attack_Unit", unit.tag, target.tag) for unit in able]
    return any(given)


def marches(plan: ReplyPlan) -> bool:
    """Return whether a team is so large that it fights on its way by itself: one target would be too few."""
    return len(plan.team.own) >= CROWD and any(action.name == "Attack_Minimap" for action in plan.team.actions)


def march(plan: ReplyPlan) -> bool:
    """Follow the last order with all units; without one, fight where the team stands if it does not fight yet."""
    team = plan.team
    if told_order(plan.situation) is not None:
        return travel(plan)
    fighting = sum(unit.order.startswith("Attack") for unit in team.own)
    if not targets(team) or 2 * fighting >= len(team.own) or team.minimap is None:
        return False
    return plan.give("Attack_Minimap", team.minimap)


def escort(plan: ReplyPlan) -> bool:
    """Keep a team without weapons in the middle of armed friends, while it sees any; return whether it does."""
    team = plan.team
    armed = [ally for ally in team.allies if kind_of(ally).reach >= 0 and kind_of(ally).role == "army"]
    if not armed or any(kind_of(unit).reach >= 0 for unit in team.own) or any(kind_of(a).structure for a in armed):
        return False
    there = middle(armed)
    return distance(there, middle(team.own)) <= BESIDE or plan.give("Move_Screen", there)


def save_the_hurt(plan: ReplyPlan, foes: Sequence[TextUnit], keep: int = 1) -> None:
    """Pull nearly dead units out of reach, those in danger first; leave `keep` calls for the team."""
    hit = plan.team.hit
    hurt = [
        unit
        for unit in plan.team.own
        if unit.share < HURT and (unit.tag in hit or _caught(unit, foes)) and _is_pressed(unit, foes)
    ]
    if len(plan.team.own) > 1 and len(hurt) == len(plan.team.own):
        return  # no unit would be left to fight
    for unit in sorted(hurt, key=lambda unit: unit.share):
        if plan.left <= keep:
            return
        refuge = away(plan.team, (unit.x, unit.y), foes, BLINK)
        if plan.cast("Blink_Screen", unit, refuge):
            continue
        if unit.share < HURT / 2 and kind_of(unit).speed > 2.9:
            if kind_of(unit).melee:  # its team would lose the fight that it leaves
                plan.give("Select_Unit_Move_Screen", unit.tag, refuge)
            else:
                plan.cast("Move_Screen", unit, refuge)


def step_back(plan: ReplyPlan, foes: Sequence[TextUnit]) -> bool:
    """While weapons cool down, step out of the reach of enemies that have to follow; return whether it is worth it."""
    team = plan.team
    kinds = [kind_of(unit) for unit in team.own]
    cooling = sum(unit.weapon_s > COOLING_S for unit in team.own)
    if not foes or 2 * cooling <= len(team.own) or min(kind.reach for kind in kinds) < 2:
        return False
    reach, speed = min(kind.reach for kind in kinds), min(kind.speed for kind in kinds)
    close = [foe for foe in foes if any(_gap(foe, unit) < 1.0 for unit in team.own)]
    chased = [foe for foe in close if kind_of(foe).reach < reach - 0.9 and kind_of(foe).speed <= speed + 0.1]
    if not chased or 2 * len(chased) < len(close):
        return False
    if any(kind_of(ally).melee for ally in team.allies):
        return False  # they hold the line, and need the fire
    centre = middle(team.own)
    return plan.give("Move_Screen", away(team, centre, foes, STEP_BACK))


def _keep_off(plan: ReplyPlan, foes: Sequence[TextUnit]) -> bool:
    """Keep a team that cannot fight out of reach."""
    near = [foe for foe in foes if any(_gap(foe, unit) < 2.0 for unit in plan.team.own)]
    if near:
        plan.give("Move_Screen", away(plan.team, middle(plan.team.own), near, 4.0))
    return True


def _caught(unit: TextUnit, foes: Sequence[TextUnit]) -> bool:
    """Return whether an enemy with a melee weapon stands next to a unit."""
    return any(kind_of(foe).melee and _gap(foe, unit) < 1.0 for foe in foes)


def _is_pressed(unit: TextUnit, foes: Sequence[TextUnit]) -> bool:
    foe = nearest(unit, foes)
    return foe is not None and distance(unit, foe) < max(IN_DANGER, kind_of(foe).reach + 1.5)


def _gap(foe: TextUnit, unit: TextUnit) -> float:
    """Return how far a foe has to come until it reaches a unit."""
    return distance(foe, unit) - _range(foe, unit) - 1.0


def _range(unit: TextUnit, other: TextUnit) -> float:
    kind = kind_of(unit)
    return kind.air if kind_of(other).flying else kind.ground
