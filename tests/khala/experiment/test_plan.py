"""From the file of an experiment to its matches: what a grid holds, what a match is known by, what is refused."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.config import load_task
from khala_protocol.configfile import loads
from khala_protocol.errors import ConfigError
from khala_protocol.trust import trust_files
from khala_sc2.experiment.plan import SWAPPED, PlannedMatch, cells, check_playable, plan, task_of
from khala_sc2.experiment.spec import Experiment, Settings

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

PLAYERS = [{"name": "strong", "model": "skilled"}, {"name": "weak", "model": "focus-fire"}]


def experiment(**fields: Any) -> Experiment:
    given = {"name": "e", "factors": {"task": ["2s3z_pair", "3s5z"], "player": PLAYERS}, "seeds": 2}
    return Experiment.model_validate(given | fields)


def cells_of(found: Experiment) -> list[Mapping[str, str]]:
    return [cell.names for cell in cells(found)]


def test_a_grid_has_every_combination_and_plays_every_cell_before_the_next_seed() -> None:
    matches = plan(experiment())
    assert [(match.cell["task"], match.cell["player"], match.seed) for match in matches] == [
        (task, player, seed) for seed in (1, 2) for task in ("2s3z_pair", "3s5z") for player in ("strong", "weak")
    ]
    assert len({match.key for match in matches}) == 8


def test_cells_are_left_out_and_added() -> None:
    found = experiment(
        exclude=[{"task": "3s5z", "player": "weak"}],
        include=[{"task": "3s5z", "player": {"name": "nobody", "model": "silent"}}],
    )
    assert [tuple(cell.values()) for cell in cells_of(found)] == [
        ("2s3z_pair", "strong"), ("2s3z_pair", "weak"), ("3s5z", "strong"), ("3s5z", "nobody"),
    ]  # fmt: skip


def test_a_match_is_known_by_what_it_plays_and_by_nothing_else() -> None:
    def keys(**fields: Any) -> list[str]:
        return [match.key for match in plan(experiment(seeds=[7], **fields))]

    same = keys(name="other", budget={"usd": 3}, description="words", retries=0)
    assert same == keys()
    for changed in ({"fixed": {"max_steps": 5}}, {"fixed": {"clock": "token"}}, {"fixed": {"memory": 2}}):
        assert not set(keys(**changed)) & set(same), changed
    assert set(keys(factors={"task": ["2s3z_pair"], "player": PLAYERS[:1]})) < set(same)


def test_a_form_of_answers_is_a_setting_of_models_and_makes_another_match() -> None:
    models = [{"name": form, "model": "scripted/skilled", "answer": form} for form in ("text", "json")]
    plain = [{"name": "plain", "model": "scripted/skilled"}]
    matches = plan(experiment(factors={"task": ["2s3z_pair"], "model": [*models, *plain]}, seeds=[7]))
    assert [match.minds["blue"].answer for match in matches] == ["text", "json", None]
    assert len({match.key for match in matches}) == 3
    grammar = experiment(fixed={"answer": "grammar"}, factors={"model": ["scripted/skilled"], "task": ["3s5z"]})
    with pytest.raises(ConfigError, match="scripted takes no grammar"):
        check_playable(plan(grammar), None)


def test_two_names_of_the_same_settings_are_one_match() -> None:
    twice = [{"name": "a", "model": "silent"}, {"name": "b", "model": "silent"}]
    assert len(plan(experiment(factors={"task": ["2s3z_pair"], "player": twice}, seeds=1))) == 1


def test_repetitions_are_matches_of_their_own() -> None:
    matches = plan(experiment(repetitions=3, seeds=1))
    assert len({match.key for match in matches}) == len(matches) == 12
    assert [match.repetition for match in matches[::4]] == [0, 1, 2]


def test_sides_are_swapped() -> None:
    found = experiment(
        factors={"task": ["duel_3m"]}, fixed={"sides": {"blue": "skilled", "red": "silent"}}, swap_sides=True, seeds=1
    )
    assert [
        (match.cell[SWAPPED], {side: mind.policy for side, mind in match.minds.items()}) for match in plan(found)
    ] == [("no", {"blue": "skilled", "red": "silent"}), ("yes", {"blue": "silent", "red": "skilled"})]


def test_settings_reach_the_task() -> None:
    task = task_of(
        Settings(
            task="simple64_eceb", clock="token", level="hard", against="terran", max_steps=9, fields={"max_actions": 2}
        )
    )
    assert (task.clock.rule, task.max_steps, task.max_actions) == ("token", 9, 2)
    assert (task.map_spec.difficulty, task.map_spec.opponent) == ("hard", "terran")


def test_models_may_rethink_and_those_that_may_not_are_the_matches_that_they_were() -> None:
    def match(**fields: Any) -> PlannedMatch:
        return plan(experiment(seeds=[7], fixed={"task": "2s3z"} | fields, factors={"player": PLAYERS[:1]}))[0]

    plain, none, one = match(), match(rethink=0), match(rethink=1)
    assert one.minds["blue"].rethink == 1
    assert plain.key == none.key != one.key


def test_an_agent_may_have_a_model_of_its_own() -> None:
    found = experiment(fixed={"model": "silent", "agents": {"Zealots": "skilled"}}, factors={"task": ["2s3z_pair"]})
    (match, *_) = plan(found)
    groups = match.minds["blue"].groups([agent.name for agent in match.config.task.agents])
    assert {mind.policy: names for mind, names in groups} == {"silent": ["Stalkers"], "skilled": ["Zealots"]}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("factors: {tsk: [2s3z]}", "there is no setting 'tsk': did you mean task?"),
        ("factors: {task: [2s3z, 2s3z]}", "the factor task has the value 2s3z twice"),
        ("factors: {task: []}", "the factor task has no values"),
        ("factors: {task: 2s3z}", "the factor task needs a list of values"),
        ("factors: {clock: [frozen]}", "no task is named: give the factor task, or fixed.task"),
        ("factors: {task: [2s3z]}, seeds: 0", "give a number from 1 to"),
        ("factors: {task: [2s3z]}, seeds: 9-3", "write it as 1-20"),
        ("factors: {task: [2s3z]}, exclude: [{player: a}]", "names the factor 'player'; the factors are task"),
        ("factors: {task: [2s3z]}, exclude: [{task: 3m}]", "exclude names task '3m'; its values are 2s3z"),
        ("factors: {task: [2s3z]}, include: [{model: silent}]", "needs a value for each of task, and no other"),
        ("factors: {task: [2s3z]}, fixed: {clok: frozen}", "no such field, did you mean 'clock'?"),
    ],
)
def test_a_wrong_file_is_refused_with_what_is_wrong(text: str, says: str) -> None:
    with pytest.raises(ConfigError) as refused:
        loads(f"{{name: e, {text}}}", Experiment, source="e.yaml")
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"factors": {"task": ["2s3z_pare"]}}, "task 2s3z_pare: there is no task '2s3z_pare': did you mean"),
        ({"factors": {"task": ["2s3z"], "model": ["opnai"]}}, "model opnai: there is no model file 'opnai'"),
        ({"factors": {"task": ["2s3z"]}, "fixed": {"agents": {"Nobody": "silent"}}}, "there is no agent 'Nobody'"),
        ({"factors": {"task": ["2s3z"]}, "fixed": {"sides": {"green": "silent"}}}, "the task has no side green"),
        ({"factors": {"task": ["2s3z"]}, "swap_sides": True}, "swap_sides needs the models of two sides"),
        ({"factors": {"task": ["2s3z"]}, "seeds": "1-10000", "repetitions": 1000}, "the grid has 10000000 matches"),
    ],
)
def test_a_cell_that_cannot_be_played_is_refused_before_anything_is(fields: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError) as refused:
        plan(experiment(**fields))
    assert says in str(refused.value)


# --- before anything is played --------------------------------------------------------------------------


def of_models(*names: str, **fields: Any) -> list[PlannedMatch]:
    return plan(experiment(factors={"task": ["2s3z_pair"], "model": list(names)}, seeds=1, **fields))


def test_who_looks_at_an_experiment_needs_no_key_and_who_plays_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    matches = of_models("openai")
    with pytest.raises(ConfigError, match="model openai: no key: set the environment variable OPENAI_API_KEY"):
        check_playable(matches, None)


def test_a_budget_is_refused_before_the_first_match_where_a_price_is_unknown() -> None:
    matches = of_models("scripted", "vllm")
    check_playable(matches, None)
    with pytest.raises(ConfigError, match=r"model vllm: a budget needs the price of Qwen/Qwen2\.5-7B-Instruct at 127"):
        check_playable(matches, 1.0)


def test_a_key_goes_to_no_address_that_an_experiment_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-0123456789")
    matches = of_models("openai", fixed={"base_url": "http://127.0.0.1:9/thief/v1"})
    with pytest.raises(ConfigError, match=r"this sends the key in OPENAI_API_KEY to 127\.0\.0\.1: if you trust"):
        check_playable(matches, None)
    trust_files(trusted=True)
    check_playable(matches, None)
    monkeypatch.setenv("KHALA_TRUST", "")
    check_playable(of_models("openai"), None)


@pytest.mark.parametrize("task", ["2s3z_pair", "duel_3m"])
def test_code_that_an_experiment_names_is_looked_at_and_not_run(
    task: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "foreign_code.py").write_text("raise AssertionError('it ran')\n")
    monkeypatch.chdir(tmp_path)
    loaded: dict[str, Any] = load_task(task).model_dump(mode="json", exclude_unset=True)
    for side in (side for side in (loaded, *loaded.get("sides", ())) if side.get("agents")):
        side["agents"] = [agent | {"sections": ["foreign_code:mine"]} for agent in side["agents"]]
    fields = {name: loaded[name] for name in ("agents", "sides") if loaded.get(name)}
    found = experiment(factors={"task": [task]}, fixed={"model": "foreign_code:decide", "fields": fields}, seeds=1)
    matches = plan(found)
    with pytest.raises(ConfigError, match=f"task {task}: this names the code 'foreign_code'"):
        check_playable(matches, None)
