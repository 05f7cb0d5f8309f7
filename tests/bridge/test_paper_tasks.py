"""The shipped tasks of the paper: the agents of the 33 maps and the full games, and which of them may talk."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import pytest

from khala_bridge.catalogue.catalogue import catalogue, chosen
from khala_bridge.knowledge import knowledge
from khala_bridge.knowledge.forms import form_of, forms_of
from khala_bridge.task.maps import known_maps
from khala_orchestrator.config import load_task

if TYPE_CHECKING:
    from khala_bridge.task.config import TaskConfig

CASTS = {  # of each task: agents, and the types of units that they lead, without those of later levels of a game
    1: {"CombatGroup7": {"Adept"}},
    2: {"CombatGroup8": {"Phoenix"}},
    3: {"CombatGroup1": {"Stalker"}},
    4: {"CombatGroup1": {"Stalker"}},
    5: {
        "Commander": set(),
        "CombatGroup1": {"Stalker"},
        "CombatGroup2": {"Colossus"},
        "CombatGroup5": {"Disruptor"},
        "CombatGroup6": {"Sentry"},
    },
    6: {
        "Commander": set(),
        "CombatGroup1": {"Stalker"},
        "CombatGroup2": {"Archon"},
        "CombatGroup5": {"HighTemplar"},
        "CombatGroup6": {"Sentry"},
    },
    7: {
        "Commander": set(),
        "CombatGroup1": {"Stalker"},
        "CombatGroup3": {"VoidRay", "Carrier", "Tempest"},
        "CombatGroup6": {"Mothership"},
    },
    8: {
        "Commander": set(),
        "Developer": set(),
        "Airborne": {"Zealot"},
        "CombatGroup0": {"Zealot"},
        "CombatGroup1": {"Stalker"},
        "CombatGroup9": {"WarpPrism", "WarpPrismPhasing"},
    },
}
TASKS = [f"pvz_task{number}_level{level}" for number, level in product(CASTS, (1, 2, 3))]
GROUPS = [f"CombatGroup{number}" for number in range(10)]
MODES = {
    "simple64_eceb": ["Commander", "Developer"],
    "simple64_sceb": ["Commander", "Developer", *GROUPS],
    "simple64_ecsb": ["Commander", "Developer", "Builder"],
}
"""The three modes of the paper's full games, and their agents."""
RACES = {"protoss": "", "terran": "_terran", "zerg": "_zerg"}
"""What follows the mode in the name of a task."""
FULL_GAMES = {f"{mode}{end}": (race, agents) for mode, agents in MODES.items() for race, end in RACES.items()}
WORKERS = {"Probe", "SCV", "Drone"}
STRANGERS = [("commander", "builder"), ("developer", "combat_group"), ("builder", "combat_group")]
"""Kinds of agents that do not write to each other in the paper's later code."""


@pytest.mark.parametrize("name", TASKS)
def test_a_task_of_llm_pysc2_has_the_agents_of_the_paper(name: str) -> None:
    task = load_task(name)
    assert (task.name, task.map, task.clock.rule) == (name, name, "frozen")
    led = {agent.name: {kind for team in agent.teams for kind in team.unit_types} for agent in task.agents}
    cast = CASTS[int(name[8])]
    assert list(led) == list(cast)
    assert all(types <= led[agent] for agent, types in cast.items())


@pytest.mark.parametrize("name", TASKS)
def test_everything_that_the_map_gives_has_an_agent(name: str) -> None:
    listed = {kind for agent in load_task(name).agents for team in agent.teams for kind in team.unit_types}
    assert set(known_maps()[name].units) <= listed


@pytest.mark.parametrize("name", TASKS)
def test_casters_may_use_their_skills_one_by_one(name: str) -> None:
    task = load_task(name)
    said = {action.name for agent in task.agents for action in agent.catalogue()}
    single = {
        "Stalker": "Select_Unit_Blink_Screen",
        "HighTemplar": "Select_Unit_Ability_PsiStorm_Screen",
        "Disruptor": "Select_Unit_Ability_PurificationNova_Attack",
        "Sentry": "Select_Unit_Ability_ForceField_Screen",
        "Phoenix": "Select_Phoenix_Ability_GravitonBeam_Unit",
        "Adept": "Select_Unit_Ability_AdeptPhaseShift_Minimap",
    }
    listed = {kind for agent in task.agents for team in agent.teams for kind in team.unit_types}
    assert {action for kind, action in single.items() if kind in listed} <= said


@pytest.mark.parametrize(("name", "race", "agents"), [(name, *given) for name, given in FULL_GAMES.items()])
def test_a_full_game_has_its_race_and_its_agents(name: str, race: str, agents: list[str]) -> None:
    task = load_task(name)
    assert (task.map, task.map_spec.race, [agent.name for agent in task.agents]) == ("Simple64", race, agents)
    orders = {action.name for agent in task.agents for action in agent.catalogue()}
    army = {"protoss": "Train_Stalker", "terran": "Train_Marine", "zerg": "Train_Roach"}
    assert army[race] in orders
    assert not (set(army.values()) - {army[race]}) & orders


def teams_of(task: TaskConfig, kind: str | None) -> list[str]:
    """Return the teams that list a type; of a form that none lists, those of the type."""
    found = [f"{agent.name}.{team.name}" for agent in task.agents for team in agent.teams if kind in team.unit_types]
    return found or (teams_of(task, form_of(kind)) if kind else [])


@pytest.mark.parametrize("end", RACES.values(), ids=RACES)
def test_every_unit_that_can_be_trained_is_in_exactly_one_team(end: str) -> None:
    task = load_task(f"simple64_sceb{end}")
    made = {action.produces for action in task.agent("Developer").catalogue()} | {"Archon", "Baneling"}
    trained = {
        k for k in made if k in knowledge() and knowledge()[k].race == task.race and not knowledge()[k].structure
    }
    army = {form for kind in trained - {*WORKERS, "Nuke"} for form in (kind, *forms_of(kind))}
    assert len(army) >= 19
    assert {kind: len(teams_of(task, kind)) for kind in army} == dict.fromkeys(army, 1)
    assert army <= {kind for agent in task.agents for kind in agent.actions}


@pytest.mark.parametrize("end", RACES.values(), ids=RACES)
def test_units_of_standard_control_have_every_skill_of_their_type(end: str) -> None:
    for agent in load_task(f"simple64_sceb{end}").agents:
        for kind, names in agent.actions.items():
            assert set(chosen(["group:skill"], kind)) <= {*names, "Morph_SurveillanceMode", "Morph_ObserverMode"}, kind


@pytest.mark.parametrize("end", RACES.values(), ids=RACES)
def test_units_with_skills_of_their_own_are_explained(end: str) -> None:
    everywhere = set(chosen(["group:skill"], "Zergling")) | {"BurrowUp"}
    for agent in load_task(f"simple64_sceb{end}").agents:
        for kind, names in agent.actions.items():
            own = {name for name in names if catalogue()[name].group == "skill"} - everywhere
            assert not own or (knowledge()[kind].abilities and knowledge()[kind].uses), kind


@pytest.mark.parametrize("end", RACES.values(), ids=RACES)
def test_a_builder_has_every_structure_that_a_worker_of_its_race_builds(end: str) -> None:
    builder = load_task(f"simple64_ecsb{end}").agent("Builder")
    (worker,) = {kind for team in builder.teams for kind in team.unit_types}
    assert worker in WORKERS
    assert set(chosen(["group:build"], worker)) <= set(builder.actions[worker])


@pytest.mark.parametrize("name", ["pvz_task8_level1", *FULL_GAMES])
def test_only_those_write_to_each_other_who_do_in_the_paper(name: str) -> None:
    task = load_task(name)
    pairs = {(agent.kind, other.kind) for agent in task.agents for other in task.correspondents(agent)}
    assert pairs
    assert not pairs & {*STRANGERS, *((b, a) for a, b in STRANGERS)}


def test_levels_share_their_cast_with_the_first_one() -> None:
    first, second = load_task("pvz_task6_level1"), load_task("pvz_task6_level2")
    assert first.agents == second.agents
    assert first.description != second.description
