"""One case for each text action: its stage, and the words that a model could say there."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

import pytest

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.frames import WorldPoint
from khala_bridge.knowledge import knowledge
from khala_bridge.names import order_name
from khala_bridge.state import Alliance
from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig
from khala_simulator.abilities.casting import is_modelled
from khala_simulator.api.abilities import UnitCommand, judge
from khala_simulator.tables.catalog import load_catalog

from .preparations import BY_RULE, prepare_for

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from _pytest.mark import ParameterSet

    from khala_bridge.catalogue.action import Action
    from khala_bridge.observe.observation import SideObservation, TeamObservation
    from khala_bridge.state import Snapshot
    from khala_simulator.tables.abilities import Ability

    from .preparations import Preparation
    from .stage import Stage

AGENT = "Agent"
ANYBODY = ("Stalker",)
"""Type that gets the actions of every type."""
SUCCESS = 1
CASTERS = {
    "Cancel": "VoidRay",
    "Cancel_Last": "Nexus",
    "Rally_Units": "Barracks",
    "Scan_Move": "Medivac",
}
"""Type for actions that many types have and the first of them does not fit; by the stem of the function."""
BASE_PLACE = (46.0, 46.0)
"""Beside resources where nobody has a base."""
NEARBY = ((0.0, 0.0), (0.1, 0.1), (-0.1, -0.1))
"""A click may be off by half a pixel; structures on a grid must then stand on the same cells."""
TOWN_HALLS = frozenset({"Nexus", "CommandCenter", "Hatchery"})


class Case(NamedTuple):
    """A text action, with the type that gets it, its place and its preparation."""

    action: Action
    caster: str
    prepare: Preparation | None
    race: str
    place: tuple[float, float] | None = None

    @property
    def stage(self) -> tuple[object, ...]:
        """The parameters of the stage: cases with the same ones can share it."""
        return self.caster, self.prepare, self.race, self.place


@functools.cache
def cases() -> dict[str, Case]:
    """Return the cases by the name of the action, those of one stage side by side."""
    found = [case_of(action) for action in catalogue().values()]
    found.sort(key=lambda case: (case.caster, case.race, case.place or (), getattr(case.prepare, "__qualname__", "")))
    return {case.action.name: case for case in found}


def by_caster(chosen: Callable[[str], bool], first: Callable[[str], object]) -> list[ParameterSet]:
    """Return cases in lists by caster, for tests with subtests: the first of each kind now, all others in long tests.

    Args:
        chosen: whether the action of this name may stand for others.
        first: returns its kind.
    """
    now: dict[str, list[Case]] = {}
    later: dict[str, list[Case]] = {}
    shown: set[object] = set()
    for name, case in cases().items():
        stands = chosen(name) and first(name) not in shown
        shown |= {first(name)} if stands else set()
        (now if stands else later).setdefault(case.caster, []).append(case)
    others = [
        pytest.param(group, id=f"{caster}, the others", marks=pytest.mark.slow) for caster, group in later.items()
    ]
    return [*(pytest.param(group, id=caster) for caster, group in now.items()), *others]


def case_of(action: Action) -> Case:
    """Return the case of an action, for the first of its types that has the ability on the simulator."""
    race = action.race or "protoss"
    place = BASE_PLACE if action.rule in {"build_near", "lock_base"} and action.produces in TOWN_HALLS else None
    place = BASE_PLACE if action.rule == "lock_base" else place
    usual = CASTERS.get(action.pysc2.stem) if action.pysc2 else None
    units = action.units or (*ANYBODY, *knowledge())
    if usual and (usual in units or not action.units):
        units = (usual,)
    for unit in units:
        if ability := _ability(action, unit):
            prepare = BY_RULE.get(action.rule or "") or prepare_for(unit, ability)
            return Case(action, unit, prepare, race, place)
    return Case(action, units[0], BY_RULE.get(action.rule or ""), race, place)


def _ability(action: Action, unit: str) -> Ability | None:
    """Return the ability of a type of unit that an action ends in, if the simulator has a rule for it."""
    catalog = load_catalog()
    known = knowledge()[unit].id
    if action.pysc2 is None or known not in catalog.row_of_id:
        return None
    card = catalog.abilities_of(catalog.unit(known).row)
    wanted = action.pysc2.ability_id
    return next((a for a in card if wanted in {a.id, a.general} and is_modelled(a)), None)


def task_of(case: Case) -> TaskConfig:
    """Return a task of one agent whose units have this one action."""
    name = case.action.name
    if case.action.subject == "side":
        teams = (TeamConfig(name="Side", kind="side", actions=(name,)),)
        agent = AgentConfig(name=AGENT, role="", kind="developer", admits="any", teams=teams)
    else:
        kind = "group" if case.action.subject == "two_units" or name.endswith("Morph_Archon") else "select"
        teams = (TeamConfig(name="Team", unit_types=(case.caster,), kind=kind),)
        agent = AgentConfig(name=AGENT, role="", admits="any", teams=teams, actions={case.caster: (name,)})
    return TaskConfig(name="effects", map="Simple64", task="", agents=(agent,))


# --- words ------------------------------------------------------------------------------------------------------------


def replies(case: Case, stage: Stage, observation: SideObservation) -> Iterator[str]:
    """Yield what a model could say so that the action is done, the most promising first."""
    teams = (t for t in observation.agents[AGENT].teams if not t.tags or stage.caster in t.tags)
    team = next(teams, None)
    if team is None:
        return
    named = [hex(stage.caster)]
    if case.action.subject == "two_units":
        named.append(hex(next(tag for tag in team.tags if tag != stage.caster)))
    named = named[: case.action.actor_count]
    for target in _targets(case.action, stage, team, observation):
        yield f"Actions:\n    Team {team.name}:\n        <{case.action.name}({', '.join([*named, *target])})>"


def _targets(action: Action, stage: Stage, team: TeamObservation, observation: SideObservation) -> Iterator[list[str]]:
    match action.target_kind:
        case None:
            yield []
        case "tag":
            yield from ([hex(tag)] for tag in _tags(action, stage, observation.snapshot))
        case "screen":
            assert team.camera is not None
            for point in _points(action, stage):
                x, y = team.camera.screen(*point)
                if 0 <= x <= 24 and 0 <= y <= 24:
                    yield [f"[{x:g}, {y:g}]"]
        case "minimap":
            for point in _points(action, stage):
                x, y = observation.map.minimap(*point)
                yield [f"[{x:g}, {y:g}]"]


def _tags(action: Action, stage: Stage, snapshot: Snapshot) -> list[int]:
    """Return the units around the caster: first those that the simulator accepts as targets, then the others."""
    here = snapshot.units[stage.caster].pos
    whose = {"enemy": (Alliance.ENEMY,), "own": (Alliance.OWN,)}.get(action.target or "", tuple(Alliance))
    near = [
        unit
        for unit in snapshot.units.values()
        if unit.alliance in whose
        and (unit.tag != stage.caster or action.subject == "side")
        and max(abs(unit.pos.x - here.x), abs(unit.pos.y - here.y)) < 11.5
    ]
    near.sort(key=lambda u: math.dist((u.pos.x, u.pos.y), (here.x, here.y)))
    return sorted((unit.tag for unit in near), key=lambda tag: not _may(action, stage, target=tag))


def _points(action: Action, stage: Stage) -> Iterator[WorldPoint]:
    """Yield the places around the caster that the simulator accepts as targets, in steps of half a unit."""
    x, y = stage.world.pos[stage.world.slot_of(stage.caster)].tolist()
    steps = range(-22, 23)
    points = [WorldPoint(math.floor(x) + dx / 2, math.floor(y) + dy / 2) for dx in steps for dy in steps]
    points.sort(key=lambda point: abs(math.dist(point, (x, y)) - 4.5))
    if action.rule == "build_at":
        yield from _geysers(stage)
    for point in points:
        if all(_may(action, stage, point=WorldPoint(point.x + dx, point.y + dy)) for dx, dy in NEARBY):
            yield point


def _geysers(stage: Stage) -> Iterator[WorldPoint]:
    world = stage.world
    for slot in world.live.tolist():
        if world.unit_type(slot).name == "VespeneGeyser":
            yield WorldPoint(*world.pos[slot].tolist())


def _may(action: Action, stage: Stage, *, target: int = 0, point: WorldPoint | None = None) -> bool:
    if action.pysc2 is None:
        return True
    command = UnitCommand(action.pysc2.ability_id, (stage.caster,), target=target, point=point)
    return judge(stage.world, 1, command).result == SUCCESS


# --- effects ----------------------------------------------------------------------------------------------------------


def its_own(words: frozenset[str], action: Action) -> frozenset[str]:
    """Return the words about this action: its order and its effects, not the walks of units meanwhile."""
    own = order_name(action.pysc2.ability_id) if action.pysc2 else ""
    if own == "Smart":  # becomes whatever a right click would
        return words
    return frozenset(
        word
        for word in words
        if not word.endswith(" moved") and (" order " not in word or word.endswith(f" order {own}"))
    )
