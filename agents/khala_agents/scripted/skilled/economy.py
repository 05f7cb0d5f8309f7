"""Lead everything without units of its own: production, building and research, and the army of easy control.

A build order is a list of wants, checked from the top at each observation: the first ones that are possible and not
met are ordered. The observation lists what is possible, and counts what exists or is being made. So the player
needs no memory, and replaces whatever was destroyed.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import Price, points
from khala_agents.scripted.skilled.builds import BUILDS, Build, Want
from khala_agents.scripted.writing import point

if TYPE_CHECKING:
    from khala_agents.scripted.reading import Situation
    from khala_agents.scripted.skilled.plan import ReplyPlan

STRONG = 16
"""Number of army units with which the army sets out."""
MANY = 200
LARVAE_MAKE = frozenset({"Train_Drone", "Train_Overlord", "Train_Zergling", "Train_Roach", "Train_Hydralisk"})
WEAK = 6
"""The army comes home with fewer army units than this."""
NO_ARMY = frozenset({"Probe", "SCV", "MULE", "Drone", "Overlord", "Overseer", "Larva", "Egg", "Queen", "Observer"})
HALLS = ("Nexus", "CommandCenter", "OrbitalCommand", "PlanetaryFortress", "Hatchery", "Lair", "Hive")


def lead(plan: ReplyPlan) -> None:
    """Plan building, training, research and the army's orders for the whole side."""
    command(plan)
    warp_to_the_front(plan)
    for build in BUILDS:
        if any(plan.team.can(name) for name in build.signs):
            produce(plan, build)
            return


def command(plan: ReplyPlan) -> None:
    """Send the army out when it is strong, and home when it is weak and the side is attacked."""
    situation, size = plan.situation, army(plan.situation)
    out = any(name == "All_Units_Attack" for _, name, _ in situation.accepted)
    if size >= STRONG or (out and size >= WEAK):
        plan.give("All_Units_Attack")
    elif size and (situation.alarm or out):
        plan.give("All_Units_Defend")


def marching_order(situation: Situation) -> str:
    """Return a commander's order to all groups: where the enemy is, or where to gather."""
    x, y = (sum(values) / len(situation.friends) for values in zip(*situation.friends, strict=True))
    bases = sorted(points(situation.task), key=lambda base: math.dist(base, (x, y))) or [(x, y)]
    known = [place for kind, place in situation.known if kind in _STRUCTURES]
    if army(situation) >= STRONG:
        return f"All groups attack at {point(known[0] if known else bases[-1])}, together."
    return f"All groups gather at {point(bases[0])} and defend it."


def army(situation: Situation) -> int:
    """Return the number of units that fight."""
    structures = sum(count for kind, count in situation.counts.items() if kind in _STRUCTURES)
    civil = sum(count for kind, count in situation.counts.items() if kind in NO_ARMY)
    return sum(situation.counts.values()) - structures - civil


def warp_to_the_front(plan: ReplyPlan) -> None:
    """Warp in at a phasing Warp Prism, if there is one: it went there for that."""
    full = " ".join(plan.situation.rejected)
    fields = [tag for kind, tag, _ in plan.situation.power if kind == "WarpPrismPhasing" and tag not in full]
    if not fields:
        return
    for name in ("Warp_Zealot_Near", "Warp_Stalker_Near"):
        price = plan.situation.prices.get(name, Price())
        for _ in range(min(plan.left, price.times)):
            plan.give(name, fields[len(plan.calls) % len(fields)])


@dataclass(slots=True)
class ReplyBudget:
    """What this reply may still spend."""

    plan: ReplyPlan
    minerals: int
    vespene: int
    supply: float
    bought: Counter[str] = field(default_factory=Counter)

    def buy(self, action: str) -> bool:
        """Order something, if it can be paid after all earlier orders; return whether it was ordered."""
        price = self.plan.situation.prices.get(action, Price())
        larvae = sum(self.bought[name] for name in LARVAE_MAKE) if action in LARVAE_MAKE else -1
        if larvae >= self.plan.situation.counts.get("Larva", 0):
            return False
        enough = price.minerals <= self.minerals and price.vespene <= self.vespene and price.supply <= self.supply
        if not enough or self.bought[action] >= price.times or not self.plan.give(action):
            return False
        self.bought[action] += 1
        self.minerals -= price.minerals
        self.vespene -= price.vespene
        self.supply -= price.supply
        return True


def produce(plan: ReplyPlan, build: Build) -> None:
    """Follow a build order; a want that cannot be paid yet may keep later ones from being paid first."""
    situation = plan.situation
    room = max(0.0, situation.supply_cap - situation.supply_used)
    purse = ReplyBudget(plan, situation.minerals, situation.vespene, room)
    if needs_supply(situation, build) and not _pending(situation, build.supply):
        given = purse.buy(build.supply.action)
        mine = build.supply.action in situation.impossible
        if not given and mine and situation.minerals < 2 * build.supply_minerals:
            return
    for want in build.wants:
        if plan.left <= 0:
            return
        if met(situation, want):
            continue
        if not purse.buy(want.action) and want.first and want.action in situation.impossible:
            return  # its money is saved
    free = _free_producers(situation, build)
    for action in build.army:
        while plan.left > 0 and free > 0 and purse.buy(action):
            free -= 1


def _free_producers(situation: Situation, build: Build) -> int:
    """Return about how many units of the army can begin without waiting for another; larvae do not count."""
    if not build.producers:
        return MANY
    there = sum(situation.counts.get(kind, 0) for kind in build.producers)
    busy = sum(situation.producing.get(action, 0) for action in build.army if not action.startswith("Warp_"))
    return there - busy


def needs_supply(situation: Situation, build: Build) -> bool:
    """Return whether supply will soon be short, counting what is being made."""
    pending = 8 * (situation.begun.get(build.supply.makes, 0) + situation.producing.get(build.supply.action, 0))
    room = situation.supply_cap + pending - situation.supply_used
    return situation.supply_cap < 200 and room < 3 + situation.supply_used / 8


def _pending(situation: Situation, want: Want) -> bool:
    return any(name == want.action for _, name, _ in situation.accepted)


def met(situation: Situation, want: Want) -> bool:
    """Return whether there is enough of something, existing or being made, or its turn has not come yet."""
    halls = sum(situation.counts.get(kind, 0) for kind in HALLS)
    if any(situation.counts.get(kind, 0) < count for kind, count in want.after.items()):
        return True  # its turn has not come yet
    if want.upgrade:
        return want.makes in situation.upgrades or want.action in situation.producing
    there = sum(situation.counts.get(kind, 0) + situation.begun.get(kind, 0) for kind in want.makes.split("|"))
    there += situation.producing.get(want.action, 0)
    there += sum(name == want.action for _, name, _ in situation.accepted) if want.makes not in situation.begun else 0
    if want.at_once and situation.producing.get(want.action, 0) >= max(1, halls):
        return True
    return there >= (want.wanted * halls if want.per_hall else want.wanted)


_STRUCTURES = frozenset(kind for build in BUILDS for kind in build.structures)
