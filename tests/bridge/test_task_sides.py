"""Tasks of two sides: what each side gets, and what is wrong with two that do not fit."""

from __future__ import annotations

import pytest

from khala_bridge.task.config import TaskConfig
from khala_protocol.configfile import loads
from khala_protocol.errors import ConfigError

AGENTS = """\
agents:
  - name: Lead
    role: You lead.
    teams: [{name: A, unit_types: [Stalker], control_group: 1}]
    actions: {Stalker: [Attack_Unit]}
"""
MIRROR = """\
name: mirror
map: Simple64
task: Win.
sides: [{side: blue}, {side: red, race: zerg, task: Survive., max_actions: 7}]
"""
OWN = """\
name: own
map: Simple64
sides:
  - {side: blue, task: Attack., agents: &agents [{name: A, role: r, kind: commander}]}
  - {side: red, task: Defend., agents: *agents}
"""


def read(text: str) -> TaskConfig:
    return loads(text, TaskConfig, source="t.yaml")


def test_a_task_without_sides_is_its_own_only_side() -> None:
    task = read(MIRROR.partition("sides")[0] + AGENTS)
    assert task.per_side() == (task,)


def test_a_side_has_what_both_have_and_what_is_its_own() -> None:
    blue, red = read(MIRROR + AGENTS).per_side()
    assert (blue.side, blue.task, blue.max_actions) == ("blue", "Win.", 3)
    assert (red.side, red.task, red.max_actions) == ("red", "Survive.", 7)
    assert blue.agents == red.agents
    assert blue.sides == red.sides == ()


def test_each_side_is_the_opponent_of_the_other() -> None:
    task = read(MIRROR + AGENTS)
    assert [(spec.race, spec.opponent) for spec in (task.map_spec, *(side.map_spec for side in task.per_side()))] == [
        ("protoss", "zerg"),
        ("protoss", "zerg"),
        ("zerg", "protoss"),
    ]


def test_nothing_is_needed_for_both_where_each_side_has_its_own() -> None:
    task = read(OWN)
    assert [(side.side, side.task, side.agents[0].name) for side in task.per_side()] == [
        ("blue", "Attack.", "A"),
        ("red", "Defend.", "A"),
    ]


@pytest.mark.parametrize("text", [MIRROR + AGENTS, OWN])
def test_a_task_of_two_sides_survives_the_run_card(text: str) -> None:
    task = read(text)
    again = TaskConfig.model_validate_json(task.model_dump_json())
    assert again == task
    assert again.per_side() == task.per_side()


def test_the_run_card_lists_the_agents_of_both_sides() -> None:
    assert [(card.side, card.name) for card in read(MIRROR + AGENTS).cards()] == [("blue", "Lead"), ("red", "Lead")]


@pytest.mark.parametrize(
    ("old", "new", "line", "text"),
    [
        ("{side: blue}, ", "", 4, "there are 1 sides: give two"),
        ("side: red", "side: blue", 4, "there are two of side blue"),
        ("side: red", "side: a red one", 4, "cannot stand in a key"),
        ("task: Win.\n", "", 1, "is required and not given"),
        ("agents:", "channels:", 1, "is required and not given"),
        ("task: Survive.", "agents: []", 4, "at least one is needed"),
        ("name: mirror", "name: mirror\nopponent: {race: zerg}", 1, "a task of two sides has no opponent"),
        ("name: mirror", "name: mirror\nside: green", 1, "a task of two sides has no side of its own"),
        ("Simple64", "2s3z", 1, "the map 2s3z has no place for a second side of agents"),
    ],
)
def test_sides_that_do_not_fit_are_named_with_their_line(old: str, new: str, line: int, text: str) -> None:
    assert old in MIRROR + AGENTS
    with pytest.raises(ConfigError) as error:
        read((MIRROR + AGENTS).replace(old, new, 1))
    assert text in str(error.value)
    assert error.value.line == line


def test_the_race_is_that_of_the_units_which_a_map_places() -> None:
    with pytest.raises(ConfigError, match="the units of the map 2s3z are protoss: the race cannot be zerg"):
        read("name: wrong\nmap: 2s3z\nrace: zerg\ntask: Win.\n" + AGENTS)
