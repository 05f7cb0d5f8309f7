"""One reply of the skilled player: each team plans in turn, then messages to other agents follow."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import points, read
from khala_agents.scripted.skilled import builder, combat, economy, journey, skills
from khala_agents.scripted.skilled.kinds import kind_of
from khala_agents.scripted.skilled.plan import ReplyPlan
from khala_agents.scripted.skilled.space import middle
from khala_agents.scripted.writing import point, reply

if TYPE_CHECKING:
    import random

    from khala_agents.scripted.reading import Situation, TextTeam

MESSAGE_SHARE = 0.2
"""Part of the replies that contain a message to others."""
ORDERS_EVERY_S = 12
"""How often a commander sends the marching order."""
_RAID = re.compile(r"\b(raid|workers?|drones?|probes?|scvs?)\b", re.IGNORECASE)
_GATHER = re.compile(r"\bgather\b", re.IGNORECASE)
_HALL = re.compile(r"(?<!your )\b(hatchery|nexus|command center)\b", re.IGNORECASE)
_ATTACK = re.compile(r"\b(raid|kill|destroy)\b", re.IGNORECASE)


def skilled(observation: str, rng: random.Random) -> str:
    """Use skills, concentrate fire, keep distance, raid and build, by the text of the observation alone."""
    situation = read(observation)
    support = combat.support(situation.teams.values())
    orders: dict[str, list[str]] = {}
    for team in situation.teams.values():
        plan = ReplyPlan(team, situation, support=support)
        _lead(plan)
        if plan.calls:
            orders[team.name] = plan.calls
    return reply(_analysis(situation), orders, _said(situation, rng))


def _lead(plan: ReplyPlan) -> None:
    team = plan.team
    if not team.own:
        economy.lead(plan)
        return
    if any(unit.type.startswith("WarpPrism") for unit in team.own):
        prism(plan)
        return
    if builder.leads(plan):
        builder.build(plan)
        return
    if all(unit.type == "AdeptPhaseShift" for unit in team.own):
        shade(plan)
        return
    if journey.passing(plan):
        journey.travel(plan)
        return
    skills.use(plan, prey=prey(plan))
    if not combat.fight(plan, prey(plan)):
        journey.travel(plan)


def prey(plan: ReplyPlan) -> str:
    """Return what a team hunts by its task: "worker", "hall", or "" for the enemy's army."""
    text = plan.team.task or plan.situation.task
    if not _ATTACK.search(text):
        return ""
    return "hall" if _HALL.search(text) else "worker" if _RAID.search(text) else ""


def shade(plan: ReplyPlan) -> None:
    """Order where the Adepts appear: among workers, if the team sees any."""
    workers = [unit for unit in plan.team.enemies if kind_of(unit).role == "worker"]
    if workers:
        plan.give("Move_Screen", middle(workers))
    else:
        journey.travel(plan)


def prism(plan: ReplyPlan) -> None:
    """Fly to the place that its task names and open a field of power there; flee when it is shot at."""
    team, plan.prey = plan.team, "place"
    foes = [foe for foe in combat.threats(team) if foe.distance < 9]
    phasing = any(unit.type == "WarpPrismPhasing" for unit in team.own)
    if phasing:
        if foes and min(unit.share for unit in team.own) < combat.HURT:
            plan.give("Morph_WarpPrismTransportMode")
        return
    if foes and min(unit.share for unit in team.own) < combat.HURT:
        combat.fight(plan)
    elif not journey.travel(plan):
        plan.give("Morph_WarpPrismPhasingMode")


def _analysis(situation: Situation) -> str:
    own = sum(len(team.own) for team in situation.teams.values())
    enemies = {unit.tag: unit for team in situation.teams.values() for unit in team.enemies}
    weakest = min(enemies.values(), key=lambda unit: (unit.share, unit.tag), default=None)
    seen = f"{len(enemies)} enemy unit(s) in sight" + (f", {weakest.tag} is hurt most" if weakest else "")
    return f"{own} unit(s) of mine in {len(situation.teams)} team(s), {seen}."


def _said(situation: Situation, rng: random.Random) -> list[tuple[str, str]]:
    """Return a call for help from a team in a fight to its first contact; a commander passes calls on."""
    people = situation.correspondents
    if not people:
        return []
    fighting = [team for team in situation.teams.values() if team.enemies and team.minimap]
    if fighting and rng.random() < MESSAGE_SHARE:
        return [(people[0], _report(fighting[0]))]
    if situation.friends and _GATHER.search(situation.task) and situation.time_s % ORDERS_EVERY_S < 2:
        groups = [name for name in people if name.startswith("CombatGroup")]
        return [(name, economy.marching_order(situation)) for name in groups]
    calls = [(sender, place) for sender, text in situation.messages for place in points(text)]
    if calls and not any(team.own for team in situation.teams.values()):
        sender, place = calls[-1]
        return [(name, f"{sender} fights at {point(place)}: help there.") for name in people if name != sender][:3]
    return []


def _report(team: TextTeam) -> str:
    assert team.minimap is not None
    return f"{team.name} fights {len(team.enemies)} enemies at {point(team.minimap)} of the minimap."
