"""Projectiles of abilities: they chase a unit or head for a point and do something where they arrive.

A weapon's missile lives in ``world.missiles``; an ability's missile is an area effect, because on arrival it runs a
rule instead of dealing damage. Abilities call ``launch`` for a missile that moves and register their rule in
``ARRIVALS``; a missile is lost when its target dies or can't be touched any more. A thrown object (``throw``) is
invisible on its way: its rule runs once, when it is due. Speeds are estimates (see ``data/mechanics.yaml`` and
``missile_speed_n`` of the abilities, per normal second).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import distance, gap, lay, number, place_of
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.world.active_buffs import FOREVER
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import AreaEffectRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.area_effects import Point
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

NO_TARGET: Final = 0
SPEED_UNKNOWN: Final = "How fast the missile flies."

ARRIVALS: Final[dict[str, Callable[[World, AreaEffect, int], None]]] = {}
"""What a missile does where it arrives, by the ability's ``effect``: a function of the world, the missile (its place is
where it arrived) and the target (a slot, or NOBODY for one that was sent to a point)."""


def launch(world: World, cast: Cast, speed_n: float) -> AreaEffect:
    """Send a missile from the caster to the cast's target; it flies from the next loop on."""
    return launch_at(world, cast.ability, cast.slot, cast.target, speed_n, point=cast.point)


def launch_at(
    world: World, ability: Ability, source: int, target: int, speed_n: float, *, point: Point | None = None
) -> AreaEffect:
    """Send an ability's missile from a unit to another one, or with no target (NOBODY) to a point."""
    x, y = world.pos[source].tolist()
    homing = target != NOBODY
    goal = point if point is not None and not homing else (x, y)
    missile = AreaEffect(
        "missile",
        owner=int(world.owner[source]),
        points=[(x, y)],
        radius=0.0,
        begun=world.loop,
        end=FOREVER,
        due=world.loop + 1,
        ability=ability.id,
        source=world.tag_of(source),
        target=world.tag_of(target) if homing else NO_TARGET,
        memory={"step": speed_n / LOOPS_PER_NORMAL_SECOND, "x": goal[0], "y": goal[1], "from_x": x, "from_y": y},
    )
    world.area_effects.append(missile)
    return missile


def fly(world: World, missile: AreaEffect) -> None:
    """Move a missile by one loop; at its target's edge or its point it arrives."""
    target = world.slot_of(missile.target) if missile.target else NOBODY
    if missile.target and (target == NOBODY or not _touchable(world, target)):
        end(world, missile)
        return
    goal = _goal(world, missile, target)
    body = float(world.radius[target]) if target != NOBODY else 0.0
    (x, y), step = missile.at, missile.memory["step"]
    away = math.hypot(goal[0] - x, goal[1] - y)
    if away - body > step:
        missile.points = [(x + (goal[0] - x) * step / away, y + (goal[1] - y) * step / away)]
        return
    missile.points = [goal]
    end(world, missile)
    ability = world.catalog.ability(missile.ability)
    ARRIVALS[ability.effect](world, missile, target)


def end(world: World, missile: AreaEffect) -> None:
    """Take a missile, or any other area effect, out of the world at the end of this loop."""
    missile.end = world.loop


def flown(missile: AreaEffect) -> float:
    """Return the distance of a missile from its launch point."""
    (x, y), memory = missile.at, missile.memory
    return math.hypot(x - memory["from_x"], y - memory["from_y"])


def _touchable(world: World, target: int) -> bool:
    return bool(world.targetable[target]) and world.carrier[target] == NOBODY


def _goal(world: World, missile: AreaEffect, target: int) -> Point:
    if target == NOBODY:
        return missile.memory["x"], missile.memory["y"]
    x, y = world.pos[target].tolist()
    return x, y


# thrown ---------------------------------------------------------------------------------------------------------------


def flight_loops(world: World, cast: Cast) -> int:
    """Return the loops from the throw until it arrives: at the point, or at the target's present edge."""
    step = number(cast, "missile_speed_n") / LOOPS_PER_NORMAL_SECOND
    if cast.target == NOBODY:
        return math.ceil(distance(world, cast.slot, place_of(world, cast)) / step)
    return math.ceil((gap(world, cast.slot, cast.target) + float(world.radius[cast.slot])) / step)


def throw(world: World, cast: Cast, rule: str, *, radius: float = 0.0, delay_loops: float = 0.0) -> AreaEffect:
    """Send something to where a cast is aimed; its ``rule`` runs once, when it arrives."""
    due = world.loop + flight_loops(world, cast) + delay_loops
    item = lay(world, cast, rule, end=due, due=due)
    item.radius = radius
    item.target = world.tag_of(cast.target)
    return item


AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"missile": fly}
