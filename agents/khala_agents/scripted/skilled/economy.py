"""Lead the production of the whole side: workers, supply, structures, research, and the units of the army.

A build order is a list of wants, checked from the top at each observation: the first ones that are possible and not
met are ordered. The observation lists what is possible, and counts what exists or is being made. So the player
needs no memory, and replaces whatever was destroyed.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import Price
from khala_agents.scripted.skilled.builds import BUILDS, Build, Line, Want
from khala_agents.scripted.skilled.kinds import TOWN_HALLS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.scripted.reading import Situation
    from khala_agents.scripted.skilled.plan import ReplyPlan

LARVAE_MAKE = frozenset(
    f"Train_{kind}" for kind in ("Drone", "Overlord", "Zergling", "Roach", "Hydralisk", "Mutalisk", "Corruptor")
)
SUPPLY_OF_ONE = 8
BOOST_EVERY_S = 6
"""Boosts are ordered again so often; most of the time their casters gather energy."""
ENOUGH_WORKERS = 44
"""Workers from which Chrono Boost is for the army."""


def produce(plan: ReplyPlan) -> None:
    """Follow the build order of the race that is playing, if this team leads production."""
    build = next((b for b in BUILDS if any(plan.team.can(sign) for sign in b.signs)), None)
    if build is None:
        return
    purse = ReplyBudget.of(plan)
    if _order_supply(purse, build) and _order_wants(purse, build):
        for line in build.army:
            _order_units(purse, line)
    if plan.situation.time_s % BOOST_EVERY_S < 2:  # a decision every two seconds
        _boost(plan, build)


@dataclass(slots=True)
class ReplyBudget:
    """What this reply may still spend."""

    plan: ReplyPlan
    minerals: int
    vespene: int
    supply: float
    larvae: int
    bought: Counter[str] = field(default_factory=Counter)

    @classmethod
    def of(cls, plan: ReplyPlan) -> ReplyBudget:
        """Return the budget at the beginning of a reply."""
        now = plan.situation
        room = max(0.0, now.supply_cap - now.supply_used)
        return cls(plan, now.minerals, now.vespene, room, now.counts.get("Larva", 0))

    def buy(self, action: str) -> bool:
        """Order something, if it can be paid after all earlier orders; return whether it was ordered."""
        price = self.plan.situation.prices.get(action, Price())
        enough = price.minerals <= self.minerals and price.vespene <= self.vespene and price.supply <= self.supply
        larva = action in LARVAE_MAKE
        refused = any(f"<{action}(" in text for text in self.plan.situation.rejected)
        if refused or not enough or self.bought[action] >= price.times or self.larvae < larva:
            return False
        if not self.plan.give(action):
            return False
        self.bought[action] += 1
        self.larvae -= larva
        self.minerals -= price.minerals
        self.vespene -= price.vespene
        self.supply -= price.supply
        return True


def _order_supply(purse: ReplyBudget, build: Build) -> bool:
    """Order supply if it will be short; return False if its money has to be saved."""
    situation, action = purse.plan.situation, build.supply.action
    if not needs_supply(situation, build) or _just_ordered(situation, action):
        return True
    return purse.buy(action) or action not in situation.impossible or situation.minerals >= 2 * 100


def _order_wants(purse: ReplyBudget, build: Build) -> bool:
    """Order what is wanted, from the top; return False where the money for the next thing has to be saved."""
    situation = purse.plan.situation
    for want in build.wants:
        for _ in range(missing(situation, want)):
            if purse.buy(want.action):
                continue
            if want.first and want.action in situation.impossible:
                return False
            break
    return purse.plan.left > 0


def _order_units(purse: ReplyBudget, line: Line) -> None:
    """Order units from producers that are free."""
    situation = purse.plan.situation
    free = _free(situation, line)
    labs = situation.counts.get(f"{line.producer}TechLab", 0) - sum(situation.producing.get(a, 0) for a in line.lab)
    for action in line.units:
        room = min(free, labs) if action in line.lab else free
        if action in line.most:
            room = min(room, line.most[action] - _there(situation, action.partition("_")[2], action))
        while room > 0 and purse.buy(action):
            room, free = room - 1, free - 1


def _free(situation: Situation, line: Line) -> int:
    """Return how many units of a line can begin without waiting for another."""
    if line.producer == "WarpGate":
        return situation.warpgates
    if not line.producer:
        return situation.counts.get("Larva", 0)
    busy = sum(situation.producing.get(action, 0) for action in (*line.units, *line.others))
    return situation.counts.get(line.producer, 0) + situation.counts.get(f"{line.producer}Reactor", 0) - busy


def _boost(plan: ReplyPlan, build: Build) -> None:
    """Use energy that makes production faster, where something is produced."""
    workers = sum(plan.situation.counts.get(kind, 0) for kind in ("Probe", "SCV", "Drone"))
    for action in build.boosts:
        wanted = {"ChronoBoost_Economy": workers < ENOUGH_WORKERS, "ChronoBoost_Military": workers >= ENOUGH_WORKERS}
        if wanted.get(action, True):
            plan.give(action)


def needs_supply(situation: Situation, build: Build) -> bool:
    """Return whether supply will soon be short, counting what is being made."""
    begun = sum(situation.begun.get(kind, 0) for kind in build.supply.makes.split("|"))
    pending = SUPPLY_OF_ONE * (begun + situation.producing.get(build.supply.action, 0))
    room = situation.supply_cap + pending - situation.supply_used
    return situation.supply_cap + pending < 200 and room < 2 + situation.supply_used / 6


def missing(situation: Situation, want: Want) -> int:
    """Return how many of something to order now: what is wanted, without what exists or is being made."""
    if any(_count(situation.counts, kinds) < count for kinds, count in want.after.items()):
        return 0  # its turn has not come yet
    making = situation.producing.get(want.action, 0)
    if not want.makes:
        return int(not making)
    halls = max(1, _count(situation.counts, "|".join(sorted(TOWN_HALLS))))
    lacking = want.wanted * (halls if want.per_hall else 1) - _there(situation, want.makes, want.action)
    at_once = halls - making if want.at_once else 1
    return max(0, min(lacking, at_once))


def _there(situation: Situation, kinds: str, action: str) -> int:
    """Return how many of some types there are or will be."""
    begun = _count(situation.begun, kinds)
    promised = 0 if begun or not action.startswith("Build_") else int(_just_ordered(situation, action))
    return _count(situation.counts, kinds) + begun + promised + situation.producing.get(action, 0)


def _just_ordered(situation: Situation, action: str) -> bool:
    return any(name == action for _, name, _ in situation.accepted)


def _count(counts: Mapping[str, int], kinds: str) -> int:
    return sum(counts.get(kind, 0) for kind in kinds.split("|"))


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
