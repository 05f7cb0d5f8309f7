"""Tasks as the paper says and as its files play them: what differs, which is played, and what the page says of it."""

from __future__ import annotations

import pytest

from khala_bridge.task.config import TaskConfig
from khala_bridge.task.differences import differences_of, papers_notes
from khala_orchestrator.config import all_tasks, change, load_task
from khala_protocol.errors import ConfigError
from khala_simulator.maps.game_map import map_names

SMAC = ["1c3s5z", "2c_vs_64zg", "2s3z", "2s_vs_1sc", "3s5z", "3s5z_vs_3s6z", "3s_vs_3z", "3s_vs_4z", "3s_vs_5z"]
MAPS = [f"pvz_task{task}_level{level}" for task in (1, 2, 3, 8) for level in (1, 2, 3)] + ["pvz_task4_level2"]
"""Tasks of which the paper's variant has a map of its own."""
B1 = {
    "No_Operation", "Hold_Position", "Move_Screen", "Move_Minimap", "Select_Unit_Move_Screen",
    "Select_Unit_Move_Minimap", "Attack_Unit", "Select_Unit_Attack_Unit",
}  # fmt: skip
UNARMED = {"Observer", "ObserverSurveillanceMode", "Disruptor", "AdeptPhaseShift", "WarpPrism", "WarpPrismPhasing"}


def paper(name: str) -> TaskConfig:
    return change(load_task(name), variant="paper")


# (task, what, the paper, its files, played)
SAID = [
    ("pvz_task1_level1", "won by", "at least seven workers", "no Queen and no Zergling", "variant"),
    ("pvz_task2_level3", "won by", "at least seven workers", "or no Queen left", "variant"),
    ("pvz_task3_level2", "transports", "4 x 2", "3 x 2", "variant"),
    ("pvz_task3_level2", "their load", "Zerglings and Banelings", "four Banelings", "variant"),
    ("pvz_task3_level2", "time", "1 min", "42.9 s", "variant"),
    ("pvz_task3_level2", "Probes to keep", "more than six", "six or more", "variant"),
    ("pvz_task4_level2", "enemy", "15 Roaches, two Ravagers, a Queen", "an Overseer", "variant"),
    ("pvz_task7_level1", "name of a team", "Mothership-1", "Mothership", "paper"),
    ("pvz_task8_level1", "won by", "the army and at least seven workers", "no Hatchery", "variant"),
    ("2s3z", "orders", "table B1", "Move_Screen", "variant"),
    ("simple64_sceb", "orders", "table B1", "Move_Minimap", "variant"),
    ("simple64_sceb", "names of teams", "`Observer-1`, `Mothership-1`, `WarpPrism-1`", "`Observer`", "paper"),
    ("simple64_ecsb", "name of a team", "Builder-Probe-1", "Builder-Probe", "paper"),
    ("simple64_eceb1", "Builder", "Build_X_Near", "no agent has them", "paper"),
]


@pytest.mark.parametrize(("task", "what", "said", "done", "played"), SAID)
def test_the_list_of_tasks_says_where_the_paper_and_its_files_differ(
    task: str, what: str, said: str, done: str, played: str
) -> None:
    row = next(row for row in differences_of(task) if row.what == what)
    assert said in row.paper
    assert done in row.files
    assert row.played == played


def test_levels_that_the_paper_and_its_files_have_alike_are_not_listed() -> None:
    assert "enemy" not in {row.what for row in differences_of("pvz_task4_level3")}
    assert differences_of("simple64_eceb_zerg") == ()


def test_a_task_has_a_variant_where_the_list_says_so_and_nowhere_else() -> None:
    listed = {task.name for task in all_tasks() if any(row.played == "variant" for row in differences_of(task.name))}
    assert {task.name for task in all_tasks() if task.has_variants} == listed == {*MAPS, *SMAC, "simple64_sceb"}
    assert all(notes.differs for notes in papers_notes().values())


def test_every_task_plays_the_files_unless_it_is_asked_for_the_paper() -> None:
    assert {task.variant for task in all_tasks()} == {"files"}
    assert {task.map_spec.file for task in all_tasks() if "_paper" in task.map_spec.file} == set()


@pytest.mark.parametrize("name", MAPS)
def test_the_papers_variant_has_its_own_map_and_its_own_words(name: str) -> None:
    task, files = paper(name), load_task(name)
    assert (task.map_spec.name, task.variant) == (f"{name}_paper", "paper")
    assert task.map_spec.file.removesuffix(".SC2Map") in map_names()
    assert task.map_spec.limit_loops == (1344 if "task3" in name else files.map_spec.limit_loops)
    assert (task.task, task.description) != (files.task, files.description)
    assert change(task, max_steps=3).agents == task.agents
    assert change(task, variant="paper") == task


def test_the_stalkers_hear_of_four_airdrops() -> None:
    (team,) = paper("pvz_task3_level2").agents[0].teams
    assert [stage.until_s for stage in team.stages] == [10, 20, 32, None]
    assert "Zerglings" in team.task
    assert load_task("pvz_task3_level2").agents[0].teams[0].unit_types == team.unit_types


@pytest.mark.parametrize("name", SMAC)
def test_each_unit_of_llm_smac_has_the_orders_of_table_b1_in_the_papers_variant(name: str) -> None:
    (agent,) = paper(name).agents
    assert {kind: set(names) for kind, names in agent.actions.items()} == dict.fromkeys(agent.actions, B1)
    assert B1 - set(load_task(name).agents[0].actions["Stalker" if "2c" not in name else "Colossus"])


def test_units_of_sceb_have_the_orders_of_table_b1_and_their_skills_in_the_papers_variant() -> None:
    actions = {kind: set(names) for agent in paper("simple64_sceb").agents for kind, names in agent.actions.items()}
    attacks = {"Attack_Unit", "Select_Unit_Attack_Unit"}
    assert len(actions) >= 19
    assert {kind for kind, names in actions.items() if attacks - names} == UNARMED
    assert [kind for kind, names in actions.items() if (B1 - attacks) - names] == []
    assert [kind for kind, names in actions.items() if "Attack_Minimap" in names] == []
    assert "Select_Unit_Blink_Screen" in actions["Stalker"]


def test_teams_have_the_names_of_the_paper() -> None:
    assert [team.name for team in load_task("simple64_ecsb").agent("Builder").teams] == ["Builder-Probe-1"]
    for name in ("simple64_eceb", "simple64_sceb", "simple64_ecsb", "simple64_eceb1", "pvz_task8_level1"):
        assert [team.name for team in load_task(name).agent("Developer").teams] == ["Protoss-Buildings"]
    single = {t.name for a in load_task("simple64_sceb").agents for t in a.teams if t.kind == "select"}
    assert single == {"Observer", "Mothership", "WarpPrism"}  # agents read Observer-1, …


def test_the_builder_of_easy_build_1_has_the_near_form_of_every_structure() -> None:
    task = load_task("simple64_eceb1")
    near = {name for name in task.agent("Builder").actions["Probe"] if name.startswith("Build_")}
    assert len(near) == 15
    assert all(name.endswith("_Near") for name in near)
    assert [agent.name for agent in task.agents] == ["Commander", "Developer", "Builder"]
    developer = {action.name for action in task.agent("Developer").catalogue()}
    assert not [name for name in developer if name.startswith("Build_")]


def test_a_task_on_which_they_agree_has_no_variant() -> None:
    with pytest.raises(ConfigError, match="the paper says nothing else of pvz_task5_level1 than its files"):
        paper("pvz_task5_level1")


def test_a_file_of_ones_own_can_be_of_the_papers_variant() -> None:
    teams = [{"name": "T", "unit_types": ["Stalker"]}]
    agents = [{"name": "A", "role": "", "teams": teams, "actions": {"Stalker": ["Stop"]}}]
    fields = {"name": "mine", "map": "pvz_task4_level2", "task": "Win.", "variant": "paper", "agents": agents}
    task = TaskConfig.model_validate(fields | {"paper": {"task": "Win without an Overseer.", "orders": True}})
    assert (task.map_spec.name, task.task) == ("pvz_task4_level2_paper", "Win without an Overseer.")
    assert task.agents[0].actions["Stalker"][0] == "No_Operation"
    with pytest.raises(ValueError, match="tusk"):
        TaskConfig.model_validate(fields | {"paper": {"tusk": "Win."}})
