"""The pages of what is played: tasks, actions, units and maps. Out of the data of the bridge and the simulator."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from bridge.catalog import catalogue
from bridge.data import table as data_table
from bridge.knowledge import RACES, UnitType
from bridge.maps import known_maps
from docs.pages.markdown import code, codes, head, join, table
from orchestrator.config import load_task, task_files
from protocol.messages import LOOPS_PER_S
from simulator.maps import MapError, load_map
from simulator.scenario import Create

if TYPE_CHECKING:
    from bridge.catalog import Action
    from bridge.knowledge import Weapon
    from bridge.maps import MapSpec
    from bridge.task import AgentConfig, TaskConfig
    from simulator.scenario import Scenario

AGENTS, OPPONENT = 1, 2
"""Player numbers on the shipped maps."""


def tasks() -> str:
    """Every shipped task with its agents."""
    found = [load_task(str(path)) for path in task_files()]
    overview = [
        (f"[`{task.name}`](#{task.name.lower()})", ", ".join(agent.name for agent in task.agents), task.description)
        for task in found
    ]
    return join(
        head("Tasks", "`configs/tasks`"),
        "What `khala run` and `khala host` take by name. To make one: [write a task](../how-to/write-a-task.md).",
        table(("task", "agents", "about"), overview),
        *(_task(task) for task in found),
    )


def actions() -> str:
    """The catalogue of text actions."""
    rows = [
        (code(action.form), action.about, _who(action), _target(action), _needs(action), *_functions(action))
        for action in catalogue().values()
    ]
    return join(
        head("Actions", "`bridge/data/actions.yaml`"),
        "What an agent may say between `<` and `>`. A task lists the ones that each of its unit types has. How calls "
        "are read: [the text language](text-language.md).",
        table(
            ("action", "meaning", "who", "target", "needs", "raw function", "screen function", "queued"),
            rows,
        ),
        "* `tag` is a unit's tag as the observation gives it, `screen` a point `[x, y]` of the team's screen, "
        "`minimap` a point of the whole map.\n"
        "* *Raw* and *screen function* are PySC2's, for the two executors.\n"
        "* *Queued* ones wait for the orders that the unit was given earlier in the same reply.",
    )


def units() -> str:
    """What agents are told of unit types."""
    return join(
        head("Units", "`bridge/data/knowledge`"),
        "What an observation tells of unit types, in the version 4.10 of the game and without upgrades. Speed in world "
        "units a second, weapon range in world units from edge to edge, costs in minerals / vespene.",
        *(_race(race) for race in RACES),
    )


def maps() -> str:
    """Every known map, and what stands on it in the simulator."""
    rows = [_map_row(spec) for spec in known_maps().values()]
    return join(
        head("Maps", "`bridge/data/maps.yaml` and `simulator/data/maps`"),
        "Files are below the directory `Maps` of the install. What stands on a map, and when it ends, is the map's own "
        "affair; the last columns are what the simulator's maps hold.",
        table(("map", "file", "race", "against", "limit", "cells", "agents' units", "enemy units"), rows),
    )


def _task(task: TaskConfig) -> str:
    wait = "as long as it takes" if task.clock.max_wait_s is None else f"at most {task.clock.max_wait_s:g} s"
    clock = f"clock {code(task.clock.rule)}: {task.clock.step_loops} game loops a step, waits {wait}"
    facts = [
        f"* Map [{code(task.map)}](maps.md), executor {code(task.executor)}, {clock}.",
        f"* At most {task.max_actions} actions per team and reply.",
    ]
    if len(task.agents) > 1 and task.communication:
        channels = f", and on {codes(task.channels)}" if task.channels else ""
        facts.append(f"* The agents can write to each other{channels}.")
    rows = [row for agent in task.agents for row in _teams(agent)]
    return join(
        f"## {task.name}",
        task.description,
        task.task,
        "\n".join(facts),
        table(("agent", "team", "units", "actions"), rows),
    )


def _teams(agent: AgentConfig) -> list[tuple[str, str, str, str]]:
    return [
        (
            agent.name,
            code(team.name),
            ", ".join(team.unit_types),
            codes(dict.fromkeys(name for unit in team.unit_types for name in agent.actions[unit])),
        )
        for team in agent.teams
    ]


def _who(action: Action) -> str:
    subject = "one unit of the team" if action.subject == "unit" else "the team"
    return f"{subject}, {', '.join(action.units)} only" if action.units else subject


def _target(action: Action) -> str:
    return {"enemy": "an enemy", "own": "an own unit", None: ""}[action.target]


def _needs(action: Action) -> str:
    weapon = "a weapon" if action.needs.weapon else ""
    return f"upgrade {action.needs.upgrade}" if action.needs.upgrade else weapon


def _functions(action: Action) -> tuple[str, str, str]:
    return (
        code(action.raw) if action.raw else "",
        code(action.screen) if action.screen else "",
        "yes" if action.queue else "",
    )


def _race(race: str) -> str:
    known = data_table(f"knowledge/{race}.yaml", UnitType)
    numbers = [_numbers(name, unit) for name, unit in known.items()]
    words = [
        (name, unit.about, "; ".join(f"{a}: {b}" for a, b in unit.abilities.items())) for name, unit in known.items()
    ]
    header = (
        "type",
        "id",
        "health",
        "shield",
        "energy",
        "armor",
        "speed",
        "sight",
        "supply",
        "cost",
        "attributes",
        "weapons",
    )
    return join(f"## {race.capitalize()}", table(header, numbers), table(("type", "about", "abilities"), words))


def _numbers(name: str, unit: UnitType) -> tuple[object, ...]:
    attributes = [*unit.attributes, *(["flying"] if unit.flying else [])]
    return (
        name,
        unit.id,
        *(_number(value) for value in (unit.health, unit.shield, unit.energy, unit.armor, unit.speed, unit.sight)),
        _number(unit.supply),
        f"{unit.minerals:g} / {unit.vespene:g}" if unit.value else "",
        ", ".join(attributes),
        "; ".join(_weapon(weapon) for weapon in unit.weapons),
    )


def _number(value: float) -> str:
    return f"{value:g}" if value else ""


def _weapon(weapon: Weapon) -> str:
    attacks = f" x {weapon.attacks}" if weapon.attacks > 1 else ""
    bonus = "".join(f", +{amount:g} against {attribute}" for attribute, amount in weapon.bonus.items())
    return f"{weapon.targets}, range {weapon.range:g}: {weapon.damage:g}{attacks} every {weapon.period_s:g} s{bonus}"


def _map_row(spec: MapSpec) -> tuple[object, ...]:
    limit = f"{spec.limit_loops} loops, {spec.limit_loops / LOOPS_PER_S:.0f} s" if spec.limit_loops else ""
    row = (code(spec.name), code(spec.file), spec.race, f"{spec.opponent}, {spec.difficulty}", limit)
    try:
        shipped = load_map(spec.file.removesuffix(".SC2Map"))
    except MapError:
        return (*row, "not in the simulator", "", "")
    width, height = shipped.terrain.size
    return (*row, f"{width} x {height}", *(_army(shipped.scenario, player) for player in (AGENTS, OPPONENT)))


def _army(scenario: Scenario, player: int) -> str:
    """What the map's script makes for a player when the game starts."""
    begun = (action for trigger in scenario.triggers if "start" in trigger.when for action in trigger.do)
    made: Counter[str] = Counter()
    for action in begun:
        if isinstance(action, Create) and action.create.player == player:
            made[action.create.unit] += action.create.count
    return ", ".join(f"{count} {unit}" for unit, count in made.items())
