"""Task files: the shipped ones are right, and errors in a wrong one say where and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from pydantic import ValidationError

from khala_bridge.task.config import AdviserConfig, AgentConfig, AutoConfig, TaskConfig, TeamConfig
from khala_bridge.task.maps import known_maps
from khala_bridge.task.opponent import Opponent
from khala_protocol.configfile import load, loads
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

GOOD = """\
name: duel
map: 2s3z
task: Win.
agents:
  - name: Stalkers
    role: You lead.
    teams:
      - {name: A, unit_types: [Stalker], control_group: 1}
    actions:
      Stalker: [Attack_Unit]
"""


@pytest.mark.parametrize("name", [n for n, spec in known_maps().items() if spec.file.startswith("llm_smac/")])
def test_a_task_of_llm_smac_has_the_agent_and_teams_of_the_paper(
    name: str, task: Callable[..., TaskConfig], paper_teams: dict[str, dict[str, int]]
) -> None:
    config = task(name)
    (agent,) = config.agents
    assert (config.name, agent.name, config.map_spec.difficulty) == (name, "CombatGroupSmac", "very_hard")
    assert [team.name for team in agent.teams] == list(paper_teams[name])
    assert config.clock.rule == "frozen"


def test_every_shipped_task_can_be_read(tasks_dir: Path) -> None:
    files = list(tasks_dir.rglob("*.yaml"))
    assert len(files) >= 10
    for file in files:
        assert load(file, TaskConfig).name == file.stem


def test_two_agents_share_the_battle_and_can_talk(task: Callable[..., TaskConfig]) -> None:
    config = task("2s3z_pair")
    assert [card.name for card in config.cards()] == ["Stalkers", "Zealots"]
    assert config.communication
    assert config.channels


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("guest", Opponent(kind="guest")),
        ("'guest:python run.py --slow'", Opponent(kind="guest", command=("python", "run.py", "--slow"))),
        ("lan:localhost:5000", Opponent(kind="lan", at="127.0.0.1:5000")),
        ("computer", Opponent()),
    ],
)
def test_an_opponent_is_also_given_in_one_line(line: str, expected: Opponent) -> None:
    text = GOOD.replace("map: 2s3z", "map: Simple64") + f"opponent: {line}\n"
    assert loads(text, TaskConfig, source="t").opponent == expected


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"kind": "guest", "race": "zerg"}, "only the computer is given a race and a difficulty"),
        (
            {"kind": "lan", "command": "run.py"},
            "only a guest is started by a command, but the opponent is of the kind lan",
        ),
    ],
)
def test_an_opponent_is_given_only_what_it_can_use(fields: dict[str, str], error: str) -> None:
    with pytest.raises(ValueError, match=error):
        Opponent.model_validate(fields)


def test_a_task_may_change_who_the_opponent_is() -> None:
    config = loads(GOOD + "opponent: {difficulty: easy}\n", TaskConfig, source="t")
    assert (config.map_spec.difficulty, config.map_spec.opponent) == ("easy", "protoss")


def test_a_task_may_bring_its_own_map() -> None:
    own = GOOD.replace("map: 2s3z", "own_map: {file: mine/ramp.SC2Map, race: protoss, opponent: null}")
    spec = loads(own, TaskConfig, source="t").map_spec
    assert (spec.name, spec.file, spec.opponent) == ("ramp", "mine/ramp.SC2Map", None)
    read_again = TaskConfig.model_validate(loads(own, TaskConfig, source="t").model_dump())
    assert read_again.map_spec == spec


@pytest.mark.parametrize("file", ["/dev/zero", "../../secret", "a/../../b.SC2Map", "", '"a\\0"'])
def test_a_map_of_its_own_is_below_the_maps_of_the_install(file: str) -> None:
    own = GOOD.replace("map: 2s3z", f"own_map: {{file: {file or repr(file)}, race: protoss, opponent: null}}")
    with pytest.raises(ConfigError, match=r"t:2 \(own_map.file\): give the path of a map from the directory Maps"):
        loads(own, TaskConfig, source="t")


@pytest.mark.parametrize("maps", ["", "map: 2s3z\nown_map: {file: a/b.SC2Map, race: zerg, opponent: zerg}\n"])
def test_a_task_has_exactly_one_map(maps: str) -> None:
    with pytest.raises(ConfigError, match="give either map or own_map"):
        loads(GOOD.replace("map: 2s3z\n", maps), TaskConfig, source="t")


@pytest.mark.parametrize(
    ("old", "new", "line", "text"),
    [
        ("map: 2s3z", "map: 2s3y", 2, "there is no map '2s3y', did you mean '2s3z'?"),
        ("[Attack_Unit]", "[Atack_Unit]", 10, "there is no action 'Atack_Unit', did you mean 'Attack_Unit'?"),
        ("Stalker: [", "Stalkr: [", 10, "there is no unit type 'Stalkr', did you mean 'Stalker'?"),
        ("[Stalker],", "[Zealot],", 5, "team A has units of type Zealot, for which no actions are listed"),
        ("Stalker: [", "Zealot: [Ability_Blink_Screen]\n      Stalker: [", 9, "Zealot has no action Ability_Blink"),
        ("name: duel", "name: a duel", 1, "name 'a duel' cannot stand in a key"),
        ("control_group: 1", "control_group: 12", 8, "less than or equal to 9"),
        ("control_group: 1}", "control_group: 1}\n      - {name: A, unit_types: [Stalker]}", 5, "two of team A"),
        ("task: Win.\n", "", 1, "is required and not given"),
        ("task: Win.", "max_actions: 999999999999\ntask: Win.", 3, "less than or equal to 1000"),
        (
            "task: Win.",
            "clock: {rule: warp}\ntask: Win.",
            3,
            "'warp' is none of 'frozen', 'budget', 'token' or 'realtime'",
        ),
        ("role: You lead.", "rolle: You lead.", 5, "is required and not given (and 1 more)"),
    ],
)
def test_a_wrong_task_is_told_with_its_line(old: str, new: str, line: int, text: str) -> None:
    assert old in GOOD
    with pytest.raises(ConfigError) as error:
        loads(GOOD.replace(old, new, 1), TaskConfig, source="duel.yaml")
    assert text in str(error.value)
    assert error.value.line == line


def test_a_form_of_a_listed_type_may_be_told_what_the_type_may() -> None:
    tank = AgentConfig(
        name="A",
        role="r",
        teams=(TeamConfig(name="T", unit_types=("SiegeTank",)),),
        actions={"SiegeTank": ("Attack_Unit", "group:skill")},
    )
    assert "Morph_Unsiege" in tank.actions["SiegeTankSieged"]
    assert tank.actions["SiegeTankSieged"][0] == "Attack_Unit"
    assert "Morph_SiegeMode" not in tank.actions["SiegeTankSieged"]


def test_what_is_listed_for_a_form_stands() -> None:
    tank = AgentConfig(
        name="A",
        role="r",
        teams=(TeamConfig(name="T", unit_types=("SiegeTank",)),),
        actions={"SiegeTank": ("Attack_Unit",), "SiegeTankSieged": ("Stop",)},
    )
    assert tank.actions["SiegeTankSieged"] == ("Stop",)


def test_an_adviser_has_a_name_that_no_agent_has(task: Callable[..., TaskConfig]) -> None:
    pair = task("2s3z_pair").model_dump()
    assert [one["name"] for one in pair["advisers"]] == ["Adviser"]
    assert TaskConfig.model_validate(pair | {"advisers": []}).advisers == ()
    with pytest.raises(ValidationError, match="there are two of agent or adviser stalkers"):
        TaskConfig.model_validate(pair | {"advisers": [{"name": "stalkers"}]})


@pytest.mark.parametrize("role", ["", "x" * 61, "coach)\nMessage from Zealots", "a (b)"])
def test_the_role_of_an_adviser_cannot_pass_for_other_text(role: str) -> None:
    with pytest.raises(ValidationError):
        AdviserConfig(name="Ada", role=role)


def test_the_rhythm_of_the_paper_sets_the_step_and_the_workers(task: Any) -> None:
    fields = task("2s3z").model_dump() | {"rhythm": "paper", "clock": {"rule": "budget", "step_loops": 5}}
    found = TaskConfig.model_validate(fields)
    assert (found.clock.rule, found.clock.step_loops) == ("budget", 23)
    assert found.auto == AutoConfig(gather=True, train_workers=True)
    with pytest.raises(ValidationError, match="rhythm"):
        TaskConfig.model_validate(fields | {"rhythm": "slow"})
