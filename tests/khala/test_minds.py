"""Which model or policy each side of a local match has, and what it may spend."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
import typer

from khala_agents.llm.money import MoneyLedger, SharedBudget
from khala_agents.llm_policy import LLMPolicy
from khala_orchestrator.config import MatchConfig, load_task
from khala_orchestrator.roster import Seat
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import AgentReport, Casualties, ModelCall, Report, Result, Usage
from khala_protocol.recording import Recorder, Recording
from khala_sc2.commands.host import reasons_not_valid, until_interrupted, win_rates, without_orders
from khala_sc2.commands.run_options import MindOptions
from khala_sc2.playing.local import _shares_of, spent_before
from khala_sc2.playing.minds import Minds, minds_of, named_sides
from khala_sc2.playing.spending import spent_usd

if TYPE_CHECKING:
    from pathlib import Path

COMMON = Minds(model="deepseek", model_name="chat", base_url="http://x/v1", fallback="silent", budget_usd=3.0)


@pytest.mark.parametrize(
    ("text", "model", "name", "policy"),
    [
        ("openai", "openai", None, None),
        ("scripted/focus-fire", "scripted", "focus-fire", None),
        ("vllm/org/llama:8b", "vllm", "org/llama:8b", None),
        ("models/mine.yaml", "models/mine.yaml", None, None),
        ("my_agent:decide", "deepseek", "chat", "my_agent:decide"),
        ("skilled", "deepseek", "chat", "skilled"),
        ("silent", "deepseek", "chat", "silent"),
    ],
)
def test_a_side_is_given_a_model_its_name_or_a_policy(text: str, model: str, name: str | None, policy: str) -> None:
    mind = COMMON.with_name(text)
    assert (mind.model, mind.model_name, mind.policy) == (model, name, policy)
    assert mind.base_url is None  # it is that of --model
    assert mind.fallback == "silent"


def test_a_form_of_answers_and_a_provider_with_its_model_reach_the_agents() -> None:
    minds = Minds(model="scripted/focus-fire", answer="json")
    assert minds.needs_endpoint
    assert minds.options("http://x/v1") == [
        "--model", "scripted/focus-fire", "--base-url", "http://x/v1", "--answer", "json",
    ]  # fmt: skip
    (policy,) = minds.policies(["A"], "http://x/v1", SharedBudget(None)).values()
    assert isinstance(policy, LLMPolicy)
    assert (policy.client.model, policy.answer.form) == ("focus-fire", "json")
    with pytest.raises(ConfigError, match="scripted takes no grammar"):
        Minds(answer="grammar").check()


def test_a_policy_of_all_is_not_the_one_of_a_side_with_a_model() -> None:
    minds = minds_of(["blue", "red"], Minds(policy="skilled"), {"red": "openai"})
    assert (minds["blue"].policy, minds["red"].policy) == ("skilled", None)
    assert minds["red"].options(None) == ["--model", "openai"]
    assert replace(minds["red"], rethink=2).options(None) == ["--model", "openai", "--rethink", "2"]


def test_both_sides_may_spend_the_same() -> None:
    minds = minds_of(["blue", "red"], COMMON, {"red": "openai"})
    assert [mind.budget_usd for mind in minds.values()] == [1.5, 1.5]
    groups = [(side, mind, ["A", "B", "C"]) for side, mind in minds.items()]
    shares = [share for share in _shares_of(groups, [], None) if share.side == "red"]
    assert [(share.process, share.names, share.budget_usd) for share in shares] == [
        ("agents-red-0", ["A", "B", "C"], 1.5),
    ]
    assert minds_of(["blue"], COMMON, {})["blue"].budget_usd == 3.0


def test_a_side_that_asks_no_model_gets_no_part_of_the_budget() -> None:
    minds = minds_of(["blue", "red"], replace(COMMON, budget_usd=3.0), {"red": "skilled"})
    assert minds["blue"].budget_usd == 3.0
    mixed = minds_of(["blue", "red"], Minds(policy="silent", agents={"B": "openai"}, budget_usd=3.0), {"red": "openai"})
    assert {side: mind.budget_usd for side, mind in mixed.items()} == {"blue": 1.5, "red": 1.5}


def test_an_agent_may_have_a_model_of_its_own_and_a_process_for_it() -> None:
    mixed = Minds(policy="silent", agents={"B": "scripted/skilled", "D": "scripted/skilled"})
    shares = list(_shares_of([("blue", *group) for group in mixed.groups(["A", "B", "C", "D"])], [], "http://here"))
    assert [share.names for share in shares] == [["A"], ["C"], ["B", "D"]]
    assert [share.options[1] for share in shares] == ["silent", "silent", "scripted"]
    with pytest.raises(ConfigError, match="there is no agent 'E': the agents are A, B"):
        Minds(agents={"E": "openai"}).groups(["A", "B"])


@pytest.mark.parametrize(
    ("mind", "agents", "sizes"),
    [
        (Minds(), 1, [1]),
        (Minds(model="openai"), 16, [16]),
        (Minds(model="openai"), 17, [9, 8]),
        (Minds(), 128, [32, 32, 32, 32]),
        (Minds(policy="mine:decide"), 3, [1, 1, 1]),
        (Minds(policy="skilled"), 6, [2, 2, 1, 1]),
    ],
)
def test_agents_that_wait_for_a_model_share_a_process_and_code_of_the_user_does_not(
    mind: Minds, agents: int, sizes: list[int]
) -> None:
    names = [f"A{number}" for number in range(agents)]
    assert [len(share.names) for share in _shares_of([("blue", mind, names)], [], None)] == sizes


def test_what_was_paid_in_a_recording_is_the_larger_sum_of_calls_and_of_reports(tmp_path: Path) -> None:
    def call(agent: str, usd: float | None) -> ModelCall:
        return ModelCall(
            run="r", agent=agent, side="blue", episode=0, step=0, attempt=1, model="m", endpoint="e", prompt=(),
            completion=None, status="timeout", started_s=0, latency_s=0, usage=Usage(cost_usd=usd),
        )  # fmt: skip

    agents = tuple(
        AgentReport(agent=name, side="blue", status="ok", usage=Usage(cost_usd=usd))
        for name, usd in {"Late": 0.25, "LeftOut": 0.5, "Free": None}.items()
    )
    report = Report(run="r", side="blue", episode=0, step=0, game_loop=0, score=0, agents=agents)
    with Recorder(tmp_path / "r.mcap") as recorder:
        for one in (call("Late", 0.25), call("Late", 0.125), call("LeftOut", None)):
            recorder.write(agent_key("r", "blue", one.agent, Topic.EXCHANGE), encode(one))
        recorder.write(run_key("r", Topic.REPORT), encode(report))
    assert spent_usd(Recording.open(tmp_path / "r.mcap")) == {
        Seat("blue", "Late"): 0.375,
        Seat("blue", "LeftOut"): 0.5,
        Seat("blue", "Free"): 0.0,
    }


def test_a_resumed_match_says_what_was_spent_and_what_is_left_for_each_side() -> None:
    ledger = MoneyLedger()
    assert spent_before(ledger, {"blue": Minds(budget_usd=2.0)}) == ""
    ledger.pay("blue", 1.25)
    ledger.pay("red", 2.0)
    rich = Minds(policy="silent", budget_usd=2.0)
    assert spent_before(ledger, {"blue": rich, "red": rich}) == (
        "3.2500 USD were spent before, 0.7500 of the budget are left; nothing for side red, so that its models are not "
        "asked"
    )
    assert "--budget-usd does" in spent_before(ledger, {"blue": Minds(policy="silent")})


def test_all_processes_of_a_side_share_its_budget() -> None:
    rich = Minds(policy="silent", budget_usd=2.0)
    shares = list(_shares_of([("blue", rich, ["A", "B", "C"])], ["--ledger", "match.ledger"], None))
    assert [share.arguments[-2:] for share in shares] == [["--budget-usd", "2.0"]] * 3
    (free,) = _shares_of([("blue", Minds(policy="silent"), ["A"])], [], None)
    assert "--budget-usd" not in free.arguments


def test_a_side_and_its_model_stand_around_an_equals_sign() -> None:
    assert named_sides(["red=openai", "green=a=b"]) == {"red": "openai", "green": "a=b"}
    for wrong in ("red", "=openai", "red="):
        with pytest.raises(ConfigError, match="write red=openai"):
            named_sides([wrong])


def result(side: str, invalid_because: str = "") -> Result:
    return Result(
        run="r", side=side, episode=0, outcome="draw", cause="time limit", valid=not invalid_because,
        invalid_because=invalid_because, steps=1, env_steps=1, game_loop=1, game_s=0.1, wall_s=0.1,
        killed=Casualties(), lost=Casualties(), kd=None,
    )  # fmt: skip


def test_a_match_that_is_not_valid_says_so_without_markup(capsys: pytest.CaptureFixture[str]) -> None:
    async def play() -> list[Result]:
        return [result("blue", "the [red] side left")]

    match = MatchConfig(task=load_task("2s3z"), run="r")
    with pytest.raises(typer.Exit) as ended:
        until_interrupted(match, as_json=False, play=lambda _: play())
    assert ended.value.exit_code == 3
    assert capsys.readouterr().err.endswith("\nnot valid: the [red] side left\n")


def test_agents_none_of_whose_orders_was_carried_out_are_named() -> None:
    asked = {"statuses": {"A": {"ok": 3}, "B": {"ok": 3}}}
    first, second = result("blue").but(**asked, accepted_of={"A": 1}), result("blue").but(**asked)
    assert without_orders([first, second]) == ["B"]
    assert without_orders([first, second.but(side="red")]) == ["blue/B", "red/A", "red/B"]
    assert without_orders([second.but(outcome="aborted")]) == []
    assert without_orders([second], talkers={("blue", "B")}) == ["A"]


def test_several_episodes_end_with_the_rate_of_wins() -> None:
    won, drawn, not_valid = result("blue").but(outcome="win"), result("blue"), result("blue", "x")
    assert list(win_rates([won])) == []
    assert list(win_rates([won, drawn, won])) == ["won 2 of 3 episodes (67 %)"]
    assert list(win_rates([won, not_valid])) == ["won 1 of 1 episodes (100 %), 1 not valid"]
    assert list(win_rates([not_valid, not_valid])) == ["won 0 of 0 episodes, 2 not valid"]
    red = [won.but(side="red")] * 2
    assert list(win_rates([drawn, drawn, *red])) == [
        "blue: won 0 of 2 episodes (0 %)",
        "red: won 2 of 2 episodes (100 %)",
    ]


def test_a_match_without_any_order_says_so_in_its_last_line(capsys: pytest.CaptureFixture[str]) -> None:
    async def play() -> list[Result]:
        return [result("blue").but(statuses={"Stalkers": {"ok": 3}})]

    until_interrupted(MatchConfig(task=load_task("2s3z_pair"), run="r"), as_json=False, play=lambda _: play())
    assert capsys.readouterr().err.endswith("\nno order of Stalkers was carried out\n")


def test_why_a_match_is_not_valid_is_said_once_and_of_which_side() -> None:
    assert list(reasons_not_valid([result("blue", "x"), result("red", "x"), result("red", "x")])) == ["x"]
    assert list(reasons_not_valid([result("blue"), result("red", "x"), result("red", "x")])) == ["red: x"]
    assert list(reasons_not_valid([result("blue", "x")])) == ["x"]
    assert list(reasons_not_valid([result("blue"), result("red")])) == []


def test_a_file_says_how_single_agents_decide(tmp_path: Path) -> None:
    file = tmp_path / "agents.yaml"
    file.write_text("agents:\n  Stalkers: {policy: silent}\nbudget_usd: 2\n", encoding="utf-8")
    minds = Minds(**MindOptions(agents=file).of_all())
    assert [(mind.policy, mind.model, names) for mind, names in minds.groups(["Stalkers", "Zealots"])] == [
        ("silent", "scripted", ["Stalkers"]), (None, "scripted", ["Zealots"]),
    ]  # fmt: skip
    assert minds.budget_usd == 2
    assert MindOptions(agents=file, budget_usd=1).of_all()["budget_usd"] == 1


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("{model: scripted, memory: 1}", "A: here --memory holds for all agents: give it as an option"),
        ("{policy: 'my_agent:decide'}", "say --trust"),
    ],
)
def test_a_file_of_agents_that_a_match_cannot_follow_is_refused(spec: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "agents.yaml"
    file.write_text(f"agents:\n  A: {spec}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=words):
        MindOptions(agents=file).of_all()
