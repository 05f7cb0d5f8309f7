"""The task of a map without a task file: one commander for all of its units.

So every map is a task. It is made from the map's entry in `bridge/khala_bridge/data/maps.yaml`: what to do there,
which types of units there are, and which upgrades the map grants. A file in `configs/tasks` with the map's name
comes first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.knowledge import facts_of, is_worker
from khala_bridge.rules import sure
from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig
from khala_protocol.messages import Clock

if TYPE_CHECKING:
    from khala_bridge.catalogue.action import Action
    from khala_bridge.task.maps import MapSpec

AGENT = "Commander"
BASE = "Base"
GROUPS = ("basic", "orders", "skill", "macro", "build")
"""Groups of actions that units have; the generated actions would fill a prompt and add nothing."""
SIDE_GROUPS = ("easy-build", "train", "research", "easy-warp", "chrono", "macro", "easy-control")
STEP_LOOPS = 11
"""Half a second of the game between two decisions, as in the other tasks."""


def standard_task(spec: MapSpec) -> TaskConfig:
    """Return the standard task of a map."""
    return TaskConfig(
        name=spec.name,
        description=spec.goal,
        map=spec.name,
        task=spec.goal,
        clock=Clock(step_loops=STEP_LOOPS),
        agents=(_commander(spec),),
    )


def _commander(spec: MapSpec) -> AgentConfig:
    return AgentConfig(
        name=AGENT,
        role="You command the units of your side.",
        admits="any",
        teams=(*(TeamConfig(name=unit, unit_types=(unit,)) for unit in spec.units), *_base(spec)),
        actions={unit: tuple(a.name for a in catalogue().values() if _usable(a, unit, spec)) for unit in spec.units},
    )


def _base(spec: MapSpec) -> tuple[TeamConfig, ...]:
    """Return the team without units that trains and builds, if there are workers."""
    if not _has_workers(spec):
        return ()
    known = {action.group for action in catalogue().values() if action.race in (spec.race, None)}
    groups = tuple(f"group:{name}/{spec.race}" for name in SIDE_GROUPS if name in known)
    return (TeamConfig(name=BASE, kind="side", actions=groups),)


def _has_workers(spec: MapSpec) -> bool:
    """Return True if there is an economy, so that missing structures and upgrades can be built and researched."""
    return any(map(is_worker, spec.units))


def _usable(action: Action, unit: str, spec: MapSpec) -> bool:
    """Return True if units of a type get the action on this map."""
    return (
        action.group in GROUPS
        and action.subject != "side"
        and action.fits(unit)
        and (_has_workers(spec) or sure(facts_of(spec.data), action.pysc2, unit, spec.upgrades) is None)
    )
