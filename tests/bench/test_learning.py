"""A course that was killed loses no line, and what it learns from is as short and as fair as it says."""

from __future__ import annotations

import importlib
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from bench.learning.battles import Answer, Answered, Boards, PlayedBattle, Scripted, enemies_alone, shortest
from bench.learning.journal import Journal, read_answered, summary, write_answered
from bench.paths import ROOT
from khala_orchestrator.config import load_task
from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from pathlib import Path

PROMPT = (ChatMessage(role="user", content="U"),)


def test_the_shortest_form_of_a_reply_is_its_calls() -> None:
    reply = (
        "Analysis: <Stop()> would be wrong.\nActions:\n    Team Marine:\n"
        "        <Select_Unit_Move_Screen(0x100040000, [4.5, 12.0])>\n        <Attack_Unit(0x100180000)>\n"
    )
    assert shortest(reply) == "<Select_Unit_Move_Screen(0x100040000, [4.5, 12.0])>\n<Attack_Unit(0x100180000)>"
    assert shortest("Analysis: I watch.\nActions:\n") == ""


def test_a_line_that_was_not_written_to_its_end_is_left_out_and_the_next_one_stands_alone(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "new")
    journal.add("tests", {"seed": 1})
    with (tmp_path / "new" / "tests.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"seed": 2, "wo')
    journal = Journal(tmp_path / "new")
    journal.add("tests", {"seed": 3})
    assert journal.lines("tests") == [{"seed": 1}, {"seed": 3}]


def test_an_example_is_read_as_it_was_written(tmp_path: Path) -> None:
    prompt = (ChatMessage(role="system", content="S"), ChatMessage(role="user", content="U"))
    answered = Answered(prompt, Answer("<Stop()>", (5, 2)))
    journal = Journal(tmp_path)
    journal.add("examples", write_answered(answered))
    assert [read_answered(line) for line in journal.lines("examples")] == [answered]


def test_the_model_reads_the_enemies_of_an_observation() -> None:
    text = (
        "Team Marine\n    Your units:\n        Marine | tag 0x100040000 | screen [12, 12] | health 15/45\n"
        "    Enemy units:\n        Marine | tag 0x100100000 | screen [17.6, 12] | distance 5.7 | health 27/45\n"
        "    Since the last observation:\n        own Marine was hit: 0x100040000 -30\n"
    )
    assert enemies_alone(text) == "Enemy units:\n0x100100000 | health 27/45"


def test_a_step_that_is_done_again_after_a_kill_counts_once(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    for step, loss in ((0, 3.0), (1, 2.0), (1, 2.5)):
        journal.add("steps", {"stage": "taught", "step": step, "loss": loss})
    assert [line["loss"] for line in journal.steps()] == [3.0, 2.5]


def test_results_are_counted_by_player(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    for player, won in (("silent", False), ("taught 6", True), ("taught 6", False)):
        journal.add("tests", {"player": player, "won": won, "reward": float(won), "answers": 4, "obeyed": 2 * won})
    silent, taught = summary(journal)
    assert (silent["player"], silent["won"], silent["battles"]) == ("silent", 0.0, 1)
    assert (taught["won"], taught["reward"], taught["obeyed"]) == (0.5, 0.5, 0.25)
    assert taught["low"] < 0.5 < taught["high"]


@pytest.fixture
def weigh() -> Any:
    """Return the function, with a model whose prompts have one token; it needs the group `learning`."""
    pytest.importorskip("peft")
    learns: Any = importlib.import_module("bench.learning.learns")
    return partial(learns.weigh, SimpleNamespace(tokens=lambda prompt: [len(prompt)]))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_decision_of_a_group_weighs_as_much_as_the_battles_that_took_it_were_better_than_the_others(
    weigh: Any,
) -> None:
    alike = Answered(PROMPT, Answer("a", (4, 2)))
    better = PlayedBattle(7, [alike] + [Answered(PROMPT, Answer("b", (5, 2)))] * 2, reward=0.5)
    worse = PlayedBattle(7, [alike, Answered(PROMPT, Answer("c", (6, 2))), Answered(PROMPT, Answer(""))], reward=-0.5)
    rows = weigh([[better, worse]])
    assert [(row.answer[0], row.weight) for row in rows] == [(5, 2.0), (6, -1.0)]
    assert [row.weight for row in weigh([[better, worse]] * 2)] == [4.0, -2.0]
    assert weigh([[worse, worse]]) == []


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_an_answer_that_was_refused_weighs_less_than_one_that_was_carried_out(weigh: Any) -> None:
    obeyed = PlayedBattle(7, [Answered(PROMPT, Answer("a", (4, 2)))])
    refused = PlayedBattle(7, [Answered(PROMPT, Answer("b", (5, 2)), obeyed=False)])
    rows = weigh([[obeyed, refused]])
    assert [(row.answer[0], row.weight) for row in rows] == [(4, 0.5), (5, -0.5)]


@pytest.mark.slow
@pytest.mark.game
def test_the_teacher_wins_with_the_shortest_answers_and_a_silent_player_does_not() -> None:
    task = load_task(str(ROOT / "bench" / "learning" / "learns_3m.yaml"))
    with Boards(task, 1) as boards:
        (won,) = boards.play(Scripted("skilled"), [2])
        (lost,) = boards.play(Scripted("silent"), [2])
    assert (won.won, won.obeyed) == (True, len(won.answered))
    assert (lost.won, lost.obeyed) == (False, 0)
    assert {len(answered.prompt) for answered in won.answered} == {2}
