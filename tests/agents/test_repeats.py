"""What a prompt's observation does not repeat of its system message."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_agents.prompt import Prompt, system_text
from khala_agents.repeats import PromptRepeats, say_again
from khala_agents.scripted.reading import read
from khala_orchestrator.config import load_task
from khala_orchestrator.match.cards import briefing as brief
from khala_protocol.messages import Contact, TeamSpec

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.messages import Briefing

STALKER = "Stalker: A walker.\nhealth 80\nBlink: Jumps; needs Blink."
OBSERVATION = """\
Unit knowledge
    Stalker: A walker.
        health 80
        beaten by Zergling
        Blink: Jumps.
    Zergling: Fast.
        health 35

Game
    Time: 0:01.0

Task
    Win.
    Team Stalker-1: Hold the ramp.
    Team Stalker-1: Go to [3, 4].

Communication
    You can write to: Zealots

Answer
    Now answer in the parts "Analysis:" and "Actions:".
"""


@pytest.fixture
def told(briefing: Callable[..., Briefing]) -> Briefing:
    return briefing(
        task="Win.",
        teams=(TeamSpec(name="Stalker-1", unit_types=("Stalker",), task="Hold the ramp."),),
        correspondents=(Contact(name="Zealots", role="They fight."),),
        channels=("Army",),
        knowledge=(STALKER,),
    )


def test_what_the_system_message_says_is_left_out_and_what_is_new_stays(told: Briefing) -> None:
    assert PromptRepeats(told).without(OBSERVATION) == (
        "Unit knowledge\n    Stalker now: beaten by Zergling; Blink: Jumps.\n    Zergling: Fast.\n        health 35\n\n"
        "Game\n    Time: 0:01.0\n\n"
        "Task\n    Team Stalker-1: Go to [3, 4].\n\n"
        'Answer\n    Now answer in the parts "Analysis:" and "Actions:".\n'
    )


@pytest.mark.parametrize("form", ["json", "tools"])
def test_answers_of_another_form_are_not_asked_for_in_parts(told: Briefing, form: str) -> None:
    seen = Prompt(told, form).messages(OBSERVATION)[-1].content  # type: ignore[arg-type]  # a form by its name
    assert "Now answer in" not in seen


def test_observations_of_earlier_steps_do_not_repeat_it_either(told: Briefing) -> None:
    head = Prompt(told).messages("")[1:-1]
    recalled = Prompt(told).messages(OBSERVATION, (head[0].model_copy(update={"content": OBSERVATION}), head[1]))[3:5]
    assert [message.role for message in recalled] == ["user", "assistant"]
    assert "Communication" not in recalled[0].content


def test_the_system_message_knows_the_types_of_the_agents_own_units() -> None:
    task = load_task("2s3z")
    text = system_text(brief(task, task.agents[0], "run", 0))
    assert "\n# Your units\n- Zealot: Sturdy melee fighter" in text
    assert "\n  hits ground and air, range 6, damage 10" in text


def test_a_player_behind_an_endpoint_is_told_the_task_and_its_contacts(told: Briefing) -> None:
    system, *_, seen = Prompt(told).messages(OBSERVATION)
    situation = read(say_again(system.content, f"{seen.content}\n\nTeam Stalker-1\n    Minimap position: [1, 2]\n"))
    assert situation.task == "Win."
    assert situation.correspondents == ["Zealots"]
    assert situation.teams["Stalker-1"].task == "Hold the ramp. Go to [3, 4]."
