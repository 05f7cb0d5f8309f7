"""Views of a whole side, for agents that lead or build it: its units, production, knowledge of the enemy, and alerts.

Functions of a scene (`khala_bridge.observe.scene`), of the memory of the episode (`khala_bridge.observe.chronicle`) and
of what has changed (`khala_bridge.observe.changes`); each makes one part of a `View`. The sections of an agent's text
decide which parts the agent gets.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from khala_bridge.knowledge import is_structure
from khala_bridge.observe.body import to_tenth
from khala_bridge.observe.chronicle import COUNTED_ANYWAY, PASSING
from khala_protocol.messages import Alert, Counts, Production, TeamReport, TypeCount, WarpGates

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from khala_bridge.knowledge import MapFacts
    from khala_bridge.observe.body import Body
    from khala_bridge.observe.changes import Changes
    from khala_bridge.observe.chronicle import Chronicle
    from khala_bridge.observe.scene import SideScene
    from khala_bridge.state.teams import Team
    from khala_protocol.messages import Point, UnitView

SAME_PLACE = 10.0
"""World units within which losses are one alert; about half a screen."""
WARNINGS = frozenset({"NuclearLaunchDetected", "NydusWormDetected", "MineralsExhausted", "VespeneExhausted"})
"""Texts of those alerts of the game that no other part shows."""


def counts(scene: SideScene, chronicle: Chronicle) -> Counts:
    """Return the numbers of the side's units, of its production, and of the enemies that it has seen."""
    left_out = PASSING - COUNTED_ANYWAY
    own = [body.view for body in scene.bodies.values() if body.is_own and body.name not in left_out]
    by_type: dict[str, list[UnitView]] = {}
    for view in own:
        by_type.setdefault(view.type, []).append(view)
    counted = [_type_count(name, by_type[name], scene.snapshot.facts) for name in sorted(by_type)]
    return Counts(
        units=tuple(count for count in counted if not is_structure(count.type)),
        structures=tuple(count for count in counted if is_structure(count.type)),
        production=tuple(_production(body.view for body in scene.bodies.values() if body.is_own)),
        planned=scene.planned,
        enemies=chronicle.enemies(scene.world),
    )


def _type_count(name: str, views: Sequence[UnitView], facts: MapFacts) -> TypeCount:
    ready = [view for view in views if view.build_progress >= 1]
    under_way = sorted((view.build_progress for view in views if view.build_progress < 1), reverse=True)
    idle = sum(not view.orders for view in ready) if works(name, facts) else None
    return TypeCount(type=name, ready=len(ready), idle=idle, under_way=tuple(under_way))


def works(name: str, facts: MapFacts) -> bool:
    """Return True if units of a type should be busy: workers, and structures that produce or research."""
    known = facts.units.get(name)
    if known is None:
        return False
    can = (facts.abilities[number].does for number in known.ability_ids if number in facts.abilities)
    return known.worker or (known.structure and any(does in ("train", "research") for does in can))


def _production(own: Iterable[UnitView]) -> Iterator[Production]:
    """Yield the products of training, research and morphs, by the names of the orders."""
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


def alerts(scene: SideScene, changes: Changes) -> tuple[Alert, ...]:
    """Return alerts where own units lost health or died, in the order of their tags."""
    lost = changes.events.changes
    hurt = [body for body in scene.bodies.values() if body.is_own and lost.get(body.view.tag, 0) < 0]
    groups: list[list[Body]] = []
    for body in (*hurt, *changes.fallen.values()):
        near = next((g for g in groups if math.dist((g[0].x, g[0].y), (body.x, body.y)) <= SAME_PLACE), None)
        if near is None:
            groups.append([body])
        else:
            near.append(body)
    return tuple(_alert(scene, changes, group) for group in groups)


def _alert(scene: SideScene, changes: Changes, bodies: Sequence[Body]) -> Alert:
    by, gone = changes.events.changes, changes.fallen
    fallen = sum(body.tag in gone for body in bodies)
    lost = sum(-by.get(body.view.tag, 0) for body in bodies if body.tag not in gone)
    return Alert(
        minimap=_middle(scene, bodies),
        units=dict(sorted(Counter(body.name for body in bodies).items())),
        lost=round(lost, 1),
        died=fallen,
    )


def warnings(changes: Changes) -> tuple[str, ...]:
    """Return the game's own warnings, each once."""
    return tuple(dict.fromkeys(alert for alert in changes.alerts if alert in WARNINGS))


def others(scene: SideScene, teams: Mapping[str, Sequence[Team]], agent: str) -> tuple[TeamReport, ...]:
    """Return the teams of all other agents, in the order of the task."""
    foreign = (team for other, its in teams.items() if other != agent for team in its)
    return tuple(_report(t.agent, t.name, [scene.bodies[tag] for tag in t.tags]) for t in foreign if t.tags)


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


def warp_gates(scene: SideScene) -> WarpGates | None:
    """Return the number of WarpGates, and of those that can warp in now; None without WarpGates."""
    gates = [b for b in scene.bodies.values() if b.is_own and b.name == "WarpGate" and b.view.build_progress >= 1]
    if not gates:
        return None
    able = scene.snapshot.abilities
    warps = {number for number, facts in scene.snapshot.facts.abilities.items() if facts.does == "warp_in"}
    ready = None if able is None else sum(not warps.isdisjoint(able.get(gate.tag, ())) for gate in gates)
    return WarpGates(count=len(gates), ready=ready)


def _middle(scene: SideScene, bodies: Sequence[Body]) -> Point:
    x, y = (sum(values) / len(bodies) for values in ([b.x for b in bodies], [b.y for b in bodies]))
    return to_tenth(scene.world.minimap(x, y), scene.world.minimap_size)
