"""Lead the army as a whole: when it gathers, attacks and comes home, by orders to the host or by messages to groups.

A commander of easy control orders `All_Units_Attack` and its like; one of standard control has no team and writes
marching orders, each with a place, to the groups that have units (`khala_agents.scripted.skilled.journey` reads them).
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from khala_agents.scripted.skilled.kinds import KINDS, fights, strength
from khala_agents.scripted.writing import point

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_agents.scripted.reading import ArmyGroup, Point, Situation
    from khala_agents.scripted.skilled.plan import ReplyPlan

STRONG = 40.0
"""Supply of army units with which the army sets out."""
WEAK = 14.0
"""The army comes home with less than this."""
CAUTION = 1.4
"""How much stronger than the enemy's known army the own one has to be to set out."""
FULL = 185.0
"""Supply at which it sets out in any case."""
GATHER_EVERY_S = 10
"""How often an army at home is ordered to wait at the foremost base."""
ORDERS_EVERY_S = 6
"""How often marching orders are written to groups that mostly do something else."""
REMIND_EVERY_S = 30
"""How often they are written for a few stragglers, such as new units: a group is shown an order for 60 s."""
AROUND = 4.0
"""Cells of the minimap within which a group is at a place: a large one stands around it."""
ROUNDED = 1.5
"""Cells by which the goal of an order, which a text gives in whole cells, may differ from that of the message."""
IN_FRONT = 4.0
"""Cells of the minimap from the foremost base to where the army gathers."""
HUNT_S = 30
"""How long a group looks for the last structures at one place."""
LIKELY = ("the enemy's", "the enemy began", "may have begun", "never seen")
"""Words in the line of a base where enemies are, the surest first."""
MAP_MIDDLE = (32.0, 32.0)
MOST_MESSAGES = 5
"""As many of a reply are delivered; the others are due the next time."""


def command(plan: ReplyPlan) -> None:
    """Send the whole army out when it is strong, and home when it is weak and the side is attacked."""
    situation = plan.situation
    out = any(name == "All_Units_Attack" for _, name, _ in situation.accepted)
    if attacks(situation, out=out):
        plan.give("All_Units_Attack")
    elif strength(situation.counts) and (out or situation.alarms or situation.time_s % GATHER_EVERY_S < 2):
        plan.give("All_Units_Defend")


def attacks(situation: Situation, *, out: bool) -> bool:
    """Return whether the army shall attack; one that is out already goes on longer."""
    mine, theirs = strength(situation.counts), strength(situation.seen)
    if out:
        return mine >= max(WEAK, theirs / CAUTION)
    return mine >= max(STRONG, theirs * CAUTION) or (situation.supply_used >= FULL and mine >= STRONG)


def marching_orders(situation: Situation) -> list[tuple[str, str]]:
    """Return a commander's orders to the groups that fight: the recipient and the text."""
    groups = [group for group in situation.groups if any(map(marches, group.units))]
    if not groups or situation.time_s % ORDERS_EVERY_S >= 2:  # a decision every two seconds
        return []
    army = _middle(group.at for group in groups)
    target = _target(situation, army)
    home = _gathering(situation, army)
    out = math.dist(army, target or MAP_MIDDLE) < math.dist(army, home)
    names = list(dict.fromkeys(group.agent for group in groups if group.agent in situation.correspondents))
    if attacks(situation, out=out):
        hidden = _hiding_places(situation) or [MAP_MIDDLE]
        first = int(situation.time_s / HUNT_S)
        goals = [target or hidden[(first + number) % len(hidden)] for number in range(len(names))]
        form = "Attack {}."
    elif situation.alarms and not out:
        goals = [min(situation.alarms, key=lambda at: math.dist(at, home))] * len(names)
        form = "Defend {}."
    else:
        goals = [home] * len(names)
        form = "Gather at {} and defend it."
    due = [(name, goal) for name, goal in zip(names, goals, strict=True) if _is_due(situation, name, goal)]
    return [(name, form.format(point(goal))) for name, goal in due[:MOST_MESSAGES]]


def _is_due(situation: Situation, agent: str, goal: Point) -> bool:
    """Return whether an agent needs to hear of an order: its units are not at the place, and not on their way to it."""
    kinds = {kind for group in situation.groups if group.agent == agent for kind in group.units}
    obey = astray = 0
    for part in situation.army:
        number = sum(count for kind, count in part.units.items() if kind in kinds)
        if _obeys(part, goal):
            obey += number
        else:
            astray += number
    often = ORDERS_EVERY_S if astray >= obey else REMIND_EVERY_S
    return (astray > 0 or not obey) and situation.time_s % often < 2


def _obeys(part: ArmyGroup, goal: Point) -> bool:
    """Return whether a part of the army is at a place, on its way there, or fights what is in its way."""
    if math.dist(part.at, goal) <= AROUND:
        return True
    return not part.idle and (part.goal is None or math.dist(part.goal, goal) <= ROUNDED)


def marches(kind: str) -> bool:
    """Return whether units of a type go with the army, to fight or to help."""
    return fights(kind) or kind in {"Medivac", "Raven", "Observer", "Overseer"}


def _target(situation: Situation, army: Point) -> Point | None:
    """Return where enemies are known to live, or else where they may: the nearest such place; None if all were seen.

    Without a map it is the place opposite of the army: maps are the same from both ends.
    """
    known = [at for kind, at in situation.known if kind in KINDS and KINDS[kind].structure]
    for places in (known, *(_bases(situation, words) for words in LIKELY)):
        if places:
            return min(places, key=lambda at: math.dist(at, army))
    return None if situation.places else (2 * MAP_MIDDLE[0] - army[0], 2 * MAP_MIDDLE[1] - army[1])


def _hiding_places(situation: Situation) -> list[Point]:
    """Return where the last structures may be hidden: places out of sight, and points all over the map."""
    named = [place.at for place in situation.places if not re.search("yours|in sight", place.about)]
    x0, y0, x1, y1 = situation.playable
    return named + [(x0 + (x1 - x0) * i / 8, y0 + (y1 - y0) * j / 8) for i in (1, 4, 7) for j in (1, 4, 7)]


def _gathering(situation: Situation, army: Point) -> Point:
    """Return the place in front of the foremost own base; without a map, where the army is."""
    own = _bases(situation, "yours")
    if not own:
        return army
    enemy = _target(situation, MAP_MIDDLE) or MAP_MIDDLE
    base = min(own, key=lambda at: math.dist(at, enemy))
    way = max(math.dist(base, enemy), IN_FRONT)
    return tuple(a + (b - a) * IN_FRONT / way for a, b in zip(base, enemy, strict=True))  # type: ignore[return-value]


def _bases(situation: Situation, words: str) -> list[Point]:
    """Return the bases whose lines contain some words; of those that are in sight only the players' own."""
    bases = [place for place in situation.places if place.name.startswith("Base ") and words in place.about]
    return [base.at for base in bases if "no town hall known" not in base.about or "in sight" not in base.about]


def _middle(places: Iterable[Point]) -> Point:
    found = list(places)
    return sum(x for x, _ in found) / len(found), sum(y for _, y in found) / len(found)
