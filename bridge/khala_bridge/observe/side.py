"""Views of a whole side, for those who lead or build it: what it has, makes and knows of, and where it is in trouble.

Functions of a scene, and of what is remembered of the episode; each makes one part of a `View`. What they see is made
by `khala_bridge.observe.scene`, what is remembered by `khala_bridge.observe.chronicle`; which agent is told which part
is decided by the sections of its text.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from khala_bridge.knowledge import abilities, knowledge
from khala_bridge.observe.body import rounded
from khala_bridge.observe.chronicle import COUNTED_ANYWAY, PASSING, is_structure
from khala_protocol.messages import Alert, Counts, Production, TeamReport, TypeCount, WarpGates

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_bridge.observe.body import Body
    from khala_bridge.observe.chronicle import Chronicle
    from khala_bridge.observe.scene import Scene
    from khala_bridge.state.teams import TeamRoster
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Point, UnitView

SAME_PLACE = 10.0
"""World units within which losses are one alert; about half a screen."""
WARNINGS = frozenset({"NuclearLaunchDetected", "NydusWormDetected", "MineralsExhausted", "VespeneExhausted"})
"""What the game's own alerts say that is to be seen nowhere else."""


def counts(scene: Scene, chronicle: Chronicle) -> Counts:
    """What the side has, makes, and has seen of the enemy."""
    left_out = PASSING - COUNTED_ANYWAY
    own = [body.view for body in scene.bodies.values() if body.is_own and body.name not in left_out]
    by_type: dict[str, list[UnitView]] = {}
    for view in own:
        by_type.setdefault(view.type, []).append(view)
    counted = [_type_count(name, by_type[name]) for name in sorted(by_type)]
    return Counts(
        units=tuple(count for count in counted if not is_structure(count.type)),
        structures=tuple(count for count in counted if is_structure(count.type)),
        production=tuple(_production(body.view for body in scene.bodies.values() if body.is_own)),
        planned=scene.planned,
        enemies=chronicle.enemies(),
    )


def _type_count(name: str, views: Sequence[UnitView]) -> TypeCount:
    ready = [view for view in views if view.build_progress >= 1]
    under_way = sorted((view.build_progress for view in views if view.build_progress < 1), reverse=True)
    idle = sum(not view.orders for view in ready) if works(name) else None
    return TypeCount(type=name, ready=len(ready), idle=idle, under_way=tuple(under_way))


def works(name: str) -> bool:
    """Whether units of a type are meant to be busy: they gather, or they produce or research as structures."""
    known = knowledge().get(name)
    if known is None:
        return False
    facts = (abilities()[number] for number in known.ability_ids if number in abilities())
    return known.worker or (known.structure and any(_makes(fact.does) for fact in facts))


def _makes(does: str) -> bool:
    return does in {"train", "research"}


def _production(own: Iterable[UnitView]) -> Iterator[Production]:
    """What orders train, research and morph, by their names."""
    begun: dict[str, list[float]] = {}
    queued: Counter[str] = Counter()
    for view in own:
        for place, order in enumerate(view.orders):
            if not order.name.startswith(("Train_", "Research_", "Morph_")):
                continue
            if order.progress is not None or (place == 0 and is_structure(view.type)):
                begun.setdefault(order.name, []).append(order.progress or 0.0)
            elif is_structure(view.type):
                queued[order.name] += 1
    for name in sorted(begun.keys() | queued.keys()):
        progress = tuple(sorted(begun.get(name, ()), reverse=True))
        yield Production(order=name, progress=progress, queued=queued[name])


def alerts(scene: Scene) -> tuple[Alert, ...]:
    """Where own units lost health or died since the observation before, in the order of their tags."""
    changes, dead = scene.events.changes, scene.events.dead
    hurt = [body for body in scene.bodies.values() if body.is_own and changes.get(body.view.tag, 0) < 0]
    fallen = [body for tag, body in sorted(scene.fallen.items()) if body.is_own and hex(tag) in dead]
    groups: list[list[Body]] = []
    for body in (*hurt, *fallen):
        near = next((g for g in groups if math.dist((g[0].x, g[0].y), (body.x, body.y)) <= SAME_PLACE), None)
        if near is None:
            groups.append([body])
        else:
            near.append(body)
    return tuple(_alert(scene, group) for group in groups)


def _alert(scene: Scene, bodies: Sequence[Body]) -> Alert:
    fallen = sum(body.tag in scene.fallen for body in bodies)
    lost = sum(-scene.events.changes.get(body.view.tag, 0) for body in bodies if body.tag not in scene.fallen)
    return Alert(
        minimap=_middle(scene, bodies),
        units=dict(sorted(Counter(body.name for body in bodies).items())),
        lost=round(lost, 1),
        died=fallen,
    )


def warnings(scene: Scene) -> tuple[str, ...]:
    """What the game itself warns of, each once."""
    return tuple(dict.fromkeys(alert for alert in scene.snapshot.alerts if alert in WARNINGS))


def others(scene: Scene, roster: TeamRoster, task: TaskConfig, agent: str) -> tuple[TeamReport, ...]:
    """The teams of all other agents, in the order of the task."""
    teams = (team for other in task.agents if other.name != agent for team in roster.teams(other.name))
    return tuple(_report(t.agent, t.name, [scene.bodies[tag] for tag in t.tags]) for t in teams if t.tags)


def _report(agent: str, name: str, bodies: Sequence[Body]) -> TeamReport:
    now = sum(body.view.health + body.view.shield for body in bodies)
    best = sum(body.view.health_max + body.view.shield_max for body in bodies)
    return TeamReport(
        agent=agent,
        name=name,
        minimap=bodies[0].view.minimap,
        units=dict(sorted(Counter(body.name for body in bodies).items())),
        health=round(now / best, 2) if best else 1.0,
    )


def warp_gates(scene: Scene) -> WarpGates | None:
    """How many WarpGates there are, and how many of them could warp in now; None without any."""
    gates = [b for b in scene.bodies.values() if b.is_own and b.name == "WarpGate" and b.view.build_progress >= 1]
    if not gates:
        return None
    able = scene.snapshot.abilities
    warps = {number for number, facts in abilities().items() if facts.does == "warp_in"}
    ready = None if able is None else sum(not warps.isdisjoint(able.get(gate.tag, ())) for gate in gates)
    return WarpGates(count=len(gates), ready=ready)


def _middle(scene: Scene, bodies: Sequence[Body]) -> Point:
    x, y = (sum(values) / len(bodies) for values in ([b.x for b in bodies], [b.y for b in bodies]))
    return rounded(scene.world.minimap(x, y), scene.world.minimap_size)
