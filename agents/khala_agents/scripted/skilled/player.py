"""One reply of the skilled player: each team plans in turn, then messages to other agents follow."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import points, read
from khala_agents.scripted.skilled import brood, builder, combat, command, economy, journey, skills
from khala_agents.scripted.skilled.kinds import KINDS, kind_of, strength
from khala_agents.scripted.skilled.plan import ReplyPlan
from khala_agents.scripted.skilled.space import middle
from khala_agents.scripted.writing import point, reply

if TYPE_CHECKING:
    import random
    from collections.abc import Callable

    from khala_agents.scripted.reading import Situation, TextTeam

MESSAGE_SHARE = 0.2
"""Part of the replies that contain a message to others."""
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
    return reply(_analysis(situation), orders, _messages(situation, rng))


def _lead(plan: ReplyPlan) -> None:
    own = plan.team.own
    special = next((lead for kind, lead in _LEADERS.items() if any(unit.type.startswith(kind) for unit in own)), None)
    if not own:
        lead_side(plan)
    elif special:
        special(plan)
    elif builder.leads(plan):
        builder.build(plan)
    elif journey.passing(plan):
        journey.travel(plan)
    else:
        battle(plan)


def lead_side(plan: ReplyPlan) -> None:
    """Order what the host carries out with units of the whole side: its army and its production."""
    command.command(plan)
    economy.warp_to_the_front(plan)
    economy.produce(plan)


def battle(plan: ReplyPlan) -> None:
    """Use skills, then fight; without enemies, go where the team is wanted."""
    skills.use(plan, prey=prey(plan))
    if combat.marches(plan):
        combat.march(plan)
    elif not combat.fight(plan, prey(plan)) and not (journey.follows(plan) and combat.escort(plan)):
        journey.travel(plan)


def stay(plan: ReplyPlan) -> None:
    """Order nothing: it has nothing better to do where it is."""


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
    team = plan.team
    plan.prey = "place"
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


_LEADERS: dict[str, Callable[[ReplyPlan], None]] = {
    "WarpPrism": prism,
    "AdeptPhaseShift": shade,
    "Queen": brood.tend,
    "Overlord": stay,
    "Changeling": stay,
    "CreepTumor": stay,
}
"""Who leads teams with units that do not fight as others do, by the beginnings of the names of their types."""


def _analysis(situation: Situation) -> str:
    """Return what an agent sees: around its teams, or, for one without units, of the whole side."""
    own = sum(len(team.own) for team in situation.teams.values())
    if not own:
        return _survey(situation)
    enemies = {unit.tag: unit for team in situation.teams.values() for unit in team.enemies}
    weakest = min(enemies.values(), key=lambda unit: (unit.share, unit.tag), default=None)
    seen = f"{len(enemies)} enemy unit(s) in sight" + (f", {weakest.tag} is hurt most" if weakest else "")
    return f"{own} unit(s) of mine in {len(situation.teams)} team(s), {seen}."


def _survey(situation: Situation) -> str:
    """Return the strength of the side and of what it knows of the enemy, in supply, and where it is attacked."""
    workers = sum(count for kind, count in situation.counts.items() if kind in KINDS and KINDS[kind].role == "worker")
    mine, theirs = strength(situation.counts), strength(situation.seen)
    attacked = f" We are under attack at {point(situation.alarms[0])}." if situation.alarms else ""
    return f"We have {workers} workers and an army of {mine:g} supply; of the enemy's we know {theirs:g}.{attacked}"


def _messages(situation: Situation, rng: random.Random) -> list[tuple[str, str]]:
    """Return what an agent writes: a commander orders, a team in a fight says what it sees, others pass that on.

    A message says what stands in the observation, or orders something; it promises nothing.
    """
    people = situation.correspondents
    if not people:
        return []
    if not situation.teams and _GATHER.search(situation.task):
        return command.marching_orders(situation)
    fighting = [team for team in situation.teams.values() if team.enemies and team.minimap]
    if fighting and rng.random() < MESSAGE_SHARE:
        return [(people[0], _report(fighting[0]))]
    calls = [(sender, place) for sender, text in situation.messages for place in points(text)]
    if calls and not any(team.own for team in situation.teams.values()):
        sender, place = calls[-1]
        return [(name, f"Help {sender} at {point(place)}.") for name in people if name != sender][:3]
    return []


def _report(team: TextTeam) -> str:
    assert team.minimap is not None
    return f"{team.name} is at {point(team.minimap)} of the minimap and sees {len(team.enemies)} enemies."
