"""Task files by name and by path, what the command line changes, and what is said of mistakes."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import ValidationError

from khala_bridge.task.config import TaskConfig
from khala_bridge.task.maps import known_maps
from khala_orchestrator.config import MatchConfig, all_tasks, change, load_task, new_run_name, task_files
from khala_protocol.errors import ConfigError, WrongKey
from khala_protocol.keys import check_name
from khala_protocol.messages import MemoryRule

if TYPE_CHECKING:
    from pathlib import Path

NAMES = "use 1 to 64 letters, digits, '_', '.' or '-', beginning with a letter or a digit"

GOOD = """\
name: mine
map: 2s3z
task: Win.
agents:
  - name: All
    role: You command all.
    teams: [{name: Zealot-1, unit_types: [Zealot]}]
    actions: {Zealot: [Attack_Unit]}
"""


# --- files ----------------------------------------------------------------------------------------------


def test_a_task_is_found_by_its_name_by_its_path_and_by_its_map(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(GOOD)
    (tmp_path / "mine.yml").write_text(GOOD)
    without_file = next(name for name in known_maps() if name not in {path.stem for path in task_files()})
    assert load_task("2s3z_pair").name == "2s3z_pair"
    assert load_task(str(tmp_path / "mine.yaml")) == load_task(str(tmp_path / "mine.yml"))
    assert load_task(str(tmp_path / "mine.yaml")).agents[0].role == "You command all."
    assert load_task(without_file).map_spec.name == without_file


def test_every_task_is_listed_once_and_found_by_its_name() -> None:
    tasks = {task.name: task for task in all_tasks()}
    assert len(tasks) == len(list(all_tasks()))
    assert set(tasks) >= {*known_maps(), *(path.stem for path in task_files())}
    assert all(load_task(name) == task for name, task in list(tasks.items())[::40])


def test_a_name_that_no_task_has_is_answered_with_those_like_it(subtests: pytest.Subtests) -> None:
    rest = "`khala tasks` lists all; a path to a .yaml file works too"
    for name, said in (
        ("2s3z_pare", f"there is no task '2s3z_pare': did you mean 2s3z_pair, 2s3z? {rest}"),
        ("chess", f"there is no task 'chess': {rest}"),
    ):
        with subtests.test(name), pytest.raises(ConfigError) as raised:
            load_task(name)
        assert str(raised.value) == said


def test_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(ConfigError) as raised:
        load_task("missing.yaml")
    assert str(raised.value) == "missing.yaml: there is no such file"


def test_a_mistake_in_a_task_file_is_named_with_its_line_and_field(tmp_path: Path, subtests: pytest.Subtests) -> None:
    path = tmp_path / "mine.yaml"
    for old, new, said in (
        ("map: 2s3z", "map: 2s3", "2 (map): there is no map '2s3', did you mean '2s3z'?"),
        ("map: 2s3z\n", "", "1: give either map or own_map"),
        ("task: Win.\n", "", "1 (task): is required and not given"),
        ("task: Win.", "task: Win.\nmax_step: 3", "4 (max_step): no such field, did you mean 'max_steps'?"),
        ("task: Win.", "task: Win.\nmax_steps: 0", "4 (max_steps): input should be greater than or equal to 1, not 0"),
        ("task: Win.", "task: Win.\nexecutor: mouse", "4 (executor): 'mouse' is none of 'raw' or 'screen'"),
        (
            "task: Win.",
            "task: Win.\nclock: {rule: warp}",
            "4 (clock.rule): 'warp' is none of 'frozen', 'budget', 'token' or 'realtime'",
        ),
        (
            "[Attack_Unit]",
            "[Atack_Unit]",
            "8 (agents.0.actions.Zealot.0): there is no action 'Atack_Unit', did you mean 'Attack_Unit'?",
        ),
        (
            "{Zealot: [Attack_Unit]}",
            "{}",
            "5 (agents.0): team Zealot-1 has units of type Zealot, for which no actions are listed",
        ),
        (
            "name: All",
            "name: All of us",
            f"5 (agents.0.name): name 'All of us' cannot stand in a key: {NAMES}",
        ),
        ("name: mine", "name: [", "3: this is not YAML: did not find expected ',' or ']'"),
    ):
        assert old in GOOD
        with subtests.test(new or f"without {old.strip()}"):
            path.write_text(GOOD.replace(old, new))
            with pytest.raises(ConfigError) as raised:
                load_task(str(path))
            assert str(raised.value) == f"{path}:{said}"


# --- the command line -------------------------------------------------------------------------------------


def test_what_is_given_takes_the_place_of_what_the_file_says() -> None:
    task = load_task("2s3z_pair")
    found = change(task, max_wait_s=2.5, step_loops=4, max_steps=9, side="red", executor="screen")
    assert (found.clock.max_wait_s, found.clock.step_loops, found.clock.rule) == (2.5, 4, "frozen")
    assert (found.max_steps, found.side, found.executor) == (9, "red", "screen")
    assert found.agents == task.agents


def test_images_are_those_of_the_agents_of_every_side() -> None:
    fields = load_task("duel_3m").model_dump()
    own = [fields["agents"][0] | {"name": "General"}]
    task = TaskConfig.model_validate(fields | {"sides": [{"side": "blue"}, {"side": "red", "agents": own}]})
    found = [
        [(agent.name, len(agent.images)) for agent in side.agents] for side in change(task, images="screen").per_side()
    ]
    assert found == [[("Captain", 1)], [("General", 1)]]


def test_memory_is_changed_where_it_is_said_and_else_stays() -> None:
    task = load_task("2s3z_pair")
    rules = [MemoryRule(notes=4), None]
    pair = zip(task.agents, rules, strict=True)
    agents = tuple(agent.model_copy(update={"memory": rule}) for agent, rule in pair)
    task = task.model_copy(update={"agents": agents, "memory": MemoryRule(steps=1, messages_s=60)})
    changed = change(task, memory="steps=3, summary=10")
    assert [changed.memory_of(agent) for agent in changed.agents] == [
        MemoryRule(steps=3, summary=10, notes=4),
        MemoryRule(steps=3, summary=10, messages_s=60),
    ]


def test_none_changes_nothing() -> None:
    task = load_task("2s3z_pair")
    assert change(task) == change(task, max_wait_s=None, step_loops=None, max_steps=None, images=None) == task


def test_a_value_that_does_not_fit_is_said_to_come_from_the_command_line(subtests: pytest.Subtests) -> None:
    rows: list[tuple[dict[str, Any], str]] = [
        ({"step_loops": 0}, "clock.step_loops: Input should be greater than or equal to 1"),
        ({"max_steps": 0}, "max_steps: Input should be greater than or equal to 1"),
        ({"executor": "mouse"}, "executor: Input should be 'raw' or 'screen'"),
        ({"map": "2s3"}, "map: there is no map '2s3', did you mean '2s3z'?"),
        ({"colour": 2}, "colour: Extra inputs are not permitted"),
    ]
    for changes, said in rows:
        with subtests.test(**changes), pytest.raises(ConfigError) as raised:
            change(load_task("2s3z_pair"), **changes)
        assert str(raised.value) == f"command line: {said}"


# --- a run ------------------------------------------------------------------------------------------------


def test_a_match_is_one_episode_that_waits_a_minute_and_records_nothing_if_nothing_is_said() -> None:
    match = MatchConfig(task=load_task("2s3z_pair"), run="r")
    assert (match.seed, match.episodes, match.assemble_s, match.record) == (1, 1, 60.0, None)


def test_a_match_that_cannot_be_played_is_refused(subtests: pytest.Subtests) -> None:
    for field, value in (("episodes", 0), ("seed", -1), ("seed", 2**31), ("assemble_s", 0.0)):
        with subtests.test(field, value=value), pytest.raises(ValidationError) as raised:
            MatchConfig.model_validate({"task": load_task("2s3z_pair"), "run": "r", field: value})
        assert [error["loc"] for error in raised.value.errors()] == [(field,)]


def test_a_run_is_named_after_its_task_and_the_time_and_no_other_is_named_so() -> None:
    before = datetime.now(UTC).replace(microsecond=0)
    names = {new_run_name("2s3z") for _ in range(20)}
    found = re.fullmatch(r"2s3z-(\d{8}-\d{6})-[0-9a-f]{4}", names.pop())
    assert found is not None
    assert before <= datetime.strptime(found[1], "%Y%m%d-%H%M%S").replace(tzinfo=UTC) <= datetime.now(UTC)
    assert len(names) > 10


def test_the_name_of_a_run_can_stand_in_a_key(subtests: pytest.Subtests) -> None:
    name = new_run_name("x" * 200)
    assert check_name(name) == name
    assert name.startswith(f"{'x' * 40}-")
    with pytest.raises(WrongKey, match="run 'a b-"):
        new_run_name("a b")


def test_a_file_anywhere_extends_a_shipped_task_by_its_name(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: pvz_task4_level2\nname: mine\n", encoding="utf-8")
    assert load_task(str(mine)) == load_task("pvz_task4_level2").model_copy(update={"name": "mine"})
    beside = "extends: 3s5z\nname: other\n"
    (tmp_path / "pvz_task4_level2.yaml").write_text(beside, encoding="utf-8")
    assert load_task(str(mine)).map == "3s5z"


def test_a_level_is_the_difficulty_of_the_computer_by_its_number() -> None:
    task = load_task("simple64_eceb")
    changed = change(task, level=5)
    assert changed.opponent == task.opponent.model_copy(update={"difficulty": "hard"})
    assert change(task, level=10, opponent="computer").opponent.difficulty == "cheat_insane"
    for refused in ({"opponent": "guest"}, {"opponent": "nobody"}):
        with pytest.raises(ConfigError, match="opponent"):
            change(task, level=5, **refused)
