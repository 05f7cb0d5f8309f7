"""When to use which skill, one function per skill. A skill that is not valid now is never planned.

Ranges, radii and prices are common knowledge of players; the host checks them again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.scripted.skilled.combat import threats
from khala_agents.scripted.skilled.kinds import IGNORED, kind_of
from khala_agents.scripted.skilled.space import crowd, distance, middle, nearest, towards

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_agents.scripted.reading import Point, TextUnit
    from khala_agents.scripted.skilled.plan import ReplyPlan

STORM_DAMAGE = 80.0
STORM_RADIUS = 1.5
NOVA_DAMAGE = 100.0


def use(plan: ReplyPlan, prey: str = "", keep: int = 1) -> None:
    """Plan the skills of a team that are worth it now; leave `keep` calls for a fight or a move."""
    plan.prey = prey
    for name, skill in SKILLS.items():
        if plan.left <= keep:
            return
        if any(name in action.name for action in plan.team.actions):
            skill(plan)


def _bodies(plan: ReplyPlan, *without: str) -> list[TextUnit]:
    """Return the biological enemies, without those under an effect."""
    return [
        unit
        for unit in plan.team.enemies
        if not kind_of(unit).structure and unit.type not in IGNORED and not set(without) & set(unit.effects)
    ]


def _friends(plan: ReplyPlan) -> list[TextUnit]:
    return [*plan.team.own, *plan.team.allies]


def _price(unit: TextUnit) -> float:
    """Return the worth of a unit under an area skill: its hit points, up to a storm's damage, times its worth."""
    kind = kind_of(unit)
    return min(unit.hit_points, STORM_DAMAGE) * (0.5 + kind.damage / 20.0) * (0.3 if kind.role == "support" else 1.0)


def storm(plan: ReplyPlan) -> None:
    """Storm a crowd with each templar that can, each a different crowd."""
    pool = _bodies(plan, "PsiStorm")
    for caster in sorted(plan.team.own, key=lambda unit: -unit.energy):
        if caster.energy < 75 or plan.left <= 0:
            return
        near = [unit for unit in pool if distance(caster, unit) < 10.0]
        found = crowd(near, STORM_RADIUS, _price, _friends(plan))
        if found is None or found[0] < 160:
            return
        if not plan.cast("PsiStorm_Screen", caster, found[1]):
            return
        pool = [unit for unit in pool if distance(unit, found[1]) > 2 * STORM_RADIUS]


def nova(plan: ReplyPlan) -> None:
    """Send a ball at the enemy with the largest crowd around, if no friend is near it."""
    pool = _bodies(plan)
    for caster in plan.team.own:
        near = [unit for unit in pool if distance(caster, unit) < 13.0 and not kind_of(unit).flying]
        found = crowd(near, 1.75, _price, _friends(plan))
        if found is None or found[0] < 130:
            return
        target = nearest(found[1], near)
        if target is None or not plan.cast("PurificationNova_Attack", caster, target.tag):
            return
        pool = [unit for unit in pool if distance(unit, target) > 4.0]


def _count_each(unit: TextUnit) -> float:
    del unit
    return 1.0


def guardian_shield(plan: ReplyPlan) -> None:
    """Raise one shield over the team while several enemies shoot from afar."""
    friends = _friends(plan)
    if sum("GuardianShield" in unit.effects for unit in friends) > len(friends) / 3:
        return
    shooters = [foe for foe in threats(plan.team) if kind_of(foe).reach > 2 and foe.distance < 11]
    if len(shooters) >= 4:
        casters = [unit for unit in plan.team.own if unit.energy >= 75]
        centre = middle(friends)
        for caster in sorted(casters, key=lambda unit: distance(unit, centre))[:1]:
            plan.cast("GuardianShield", caster)


def force_field(plan: ReplyPlan) -> None:
    """Raise a wall through the middle of the advancing enemies, so that half of them cannot pass."""
    fields = [unit for unit in plan.team.enemies + plan.team.allies if unit.type == "ForceField"]
    walkers = [u for u in _bodies(plan) if not kind_of(u).flying and kind_of(u).role == "army"]
    if any(unit.type in {"Ultralisk", "Ravager", "Colossus", "Archon", "Thor"} for unit in walkers):
        walkers = [unit for unit in walkers if unit.distance < 9]  # they break a wall that they reach
    if len(walkers) < 6:
        return
    ours, theirs = middle(_friends(plan)), middle(walkers)
    gap = distance(ours, theirs)
    if not 4.0 < gap < 13.0:
        return
    for place_, caster in zip(_wall(ours, theirs, min(gap - 1.0, 8.0)), _rich(plan, 50), strict=False):
        if all(distance(place_, field) > 1.5 for field in fields):
            plan.cast("ForceField_Screen", caster, place_)


def _rich(plan: ReplyPlan, energy: float) -> list[TextUnit]:
    return [unit for unit in plan.team.own if unit.energy >= energy]


def _wall(ours: Point, theirs: Point, away_: float) -> list[Point]:
    """Return three places in a row across the way from one place to another."""
    centre = towards(ours, theirs, away_)
    dx, dy = (theirs[0] - ours[0]), (theirs[1] - ours[1])
    length = max((dx * dx + dy * dy) ** 0.5, 1e-6)
    across = (-dy / length, dx / length)
    return [(centre[0] + across[0] * k * 3.0, centre[1] + across[1] * k * 3.0) for k in (0, 1, -1)]


def graviton_beam(plan: ReplyPlan) -> None:
    """Lift a Queen, or a worker when there is none, once another Phoenix is there to shoot."""
    team = plan.team
    free = [unit for unit in team.own if unit.energy >= 50 and "Graviton" not in unit.order]
    if len(team.own) < 2 or any("GravitonBeam" in unit.effects for unit in team.enemies) or len(free) < 1:
        return
    guarded = any(kind_of(foe).structure and kind_of(foe).air > 0 for foe in team.enemies)
    prey = [u for u in _bodies(plan) if not kind_of(u).flying and not {"Ultralisk", "Larva"} & {u.type}]
    workers = dict.fromkeys(("Drone", "Probe", "SCV"), -1 if plan.prey == "worker" and not guarded else 2)
    order = {"Queen": 0, "Hydralisk": 1, "Infestor": 1, **workers}
    caster = max(free, key=lambda unit: unit.energy)
    target = min(
        (unit for unit in prey if unit.type in order),
        key=lambda unit: (order[unit.type], unit.hit_points // 60, distance(unit, caster), unit.tag),
        default=None,
    )
    if target is not None and distance(target, caster) < 9:
        plan.cast("GravitonBeam", caster, target.tag)


def prismatic_alignment(plan: ReplyPlan) -> None:
    """Align when at least half of the team is in a fight."""
    foes = [unit for unit in _bodies(plan) if unit.distance < 9]
    if len(foes) >= 2 and not any("VoidRaySwarmDamageBoost" in unit.effects for unit in plan.team.own):
        plan.give("Ability_PrismaticAlignment")


def time_warp(plan: ReplyPlan) -> None:
    """Warp time over the largest advancing crowd."""
    found = crowd([unit for unit in _bodies(plan) if not kind_of(unit).flying], 3.5, _count_each)
    if found is not None and found[0] >= 6:
        for caster in _rich(plan, 100):
            if distance(caster, found[1]) < 11:
                plan.cast("TimeWarp_Screen", caster, found[1])


def pulsar_beam(plan: ReplyPlan) -> None:
    """Switch the beam on as soon as something on the ground is near."""
    prey = [unit for unit in _bodies(plan) if not kind_of(unit).flying and unit.distance < 6]
    if prey and not any("OracleWeapon" in unit.effects for unit in plan.team.own) and _rich(plan, 45):
        plan.give("Ability_PulsarBeamOn")


def fungal(plan: ReplyPlan) -> None:
    """Grow fungus on a crowd."""
    found = crowd(_bodies(plan, "FungalGrowth"), 2.25, _price, ())
    if found is not None and found[0] >= 200:
        for caster in _rich(plan, 75)[:1]:
            if distance(caster, found[1]) < 10:
                plan.cast("FungalGrowth_Screen", caster, found[1])


def stim(plan: ReplyPlan) -> None:
    """Use stim when the fight begins and no unit is hurt much."""
    team = plan.team
    near = [foe for foe in threats(team) if foe.distance < 8]
    stimmed = any("Stim" in effect for unit in team.own for effect in unit.effects)
    name = next((action.name for action in team.actions if "Stim" in action.name and not action.args), None)
    if name and near and not stimmed and min(unit.share for unit in team.own) > 0.5:
        plan.give(name)


def siege(plan: ReplyPlan) -> None:
    """Siege tanks when walkers come into their range, and unsiege them when nothing is left."""
    walkers = [foe for foe in _bodies(plan) if not kind_of(foe).flying]
    near = [foe for foe in walkers if foe.distance < 12]
    dug = any(unit.type == "SiegeTankSieged" for unit in plan.team.own)
    names = [action.name for action in plan.team.actions if not action.args]
    if near and not dug:
        plan.give(next((name for name in names if name.endswith("Morph_SiegeMode")), ""))
    elif dug and not walkers:
        plan.give(next((name for name in names if name.endswith("Morph_Unsiege")), ""))


def archon(plan: ReplyPlan) -> None:
    """Merge two templar without energy into one Archon."""
    tired = [unit for unit in plan.team.own if unit.type == "HighTemplar" and unit.energy < 40 and not unit.order]
    if len(tired) >= 2 and plan.give("Select_Two_Units_Morph_Archon", tired[0].tag, tired[1].tag):
        plan.busy |= {tired[0].tag, tired[1].tag}


SKILLS: dict[str, Callable[[ReplyPlan], None]] = {
    "PsiStorm": storm,
    "PurificationNova": nova,
    "GuardianShield": guardian_shield,
    "ForceField": force_field,
    "GravitonBeam": graviton_beam,
    "PrismaticAlignment": prismatic_alignment,
    "TimeWarp": time_warp,
    "PulsarBeamOn": pulsar_beam,
    "FungalGrowth": fungal,
    "Stim": stim,
    "Morph_Siege": siege,
    "Morph_Unsiege": siege,
    "Morph_Archon": archon,
}
"""By a part of the names of the actions that each needs; tried in this order."""
