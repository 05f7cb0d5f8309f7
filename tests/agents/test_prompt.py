"""The text of a prompt. The golden text is behaviour: a change of it changes how agents play."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_agents.memory import NoMemory, Recalled, WholeSteps
from khala_agents.prompt import Prompt, system_text
from khala_protocol.messages import ActionSpec, ChatMessage, Clock, Contact, TeamSpec
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.clock_rule import ClockRule
    from khala_protocol.messages import Briefing, Observation

SYSTEM = """\
# Who you are
You are Stalkers, one of the agents that play a game of StarCraft II.
You command the Stalkers.

# Your task
Defeat all enemy units.

# Your teams
- Stalker-1: Stalker. Hold the ramp.

# Rules
- You command your own teams only.
- Units that the latest observation does not list are out of sight or dead.
- Many weapons on one enemy kill it sooner, and a dead enemy no longer shoots: concentrate fire.
- Fight where you gain more than you lose; pull out units that are about to die for nothing.
- Abilities that help now come before moving and attacking.
- A team carries out at most 2 of your actions a step, one after the other; more are refused.
- Your next observation says which actions were refused, and why.
- The game stands still while you think; 0.36 s of game time pass between two observations. Answer within 10 s, \
or your teams go on as before.

# Actions
- <Attack_Unit(tag)>: attacks an enemy
- <Move_Screen(screen)>
- <Stop()>

# Arguments
- tag: the tag of a unit as the observation gives it, with 0x in front
- screen: a point [x, y] near the team that acts, x and y from 0 to 24 with the team's screen centre at 12; \
x grows to the right, y grows downwards

# Communication
- Zealots: They fight hand to hand
- Channel-1: a channel, heard by all who listen to it
<MessageTo(name, '''text''')> sends a text to one of them; it arrives with their next observation.
<ListenTo(channel)> lets you hear a channel from the next observation on.

# How to answer
Write "Analysis:" and a few sentences on what matters now.
Then write "Actions:", and under it a line "Team <name>:" for each team that shall act, named as observed.
Below it write the actions of that team, each as <Name(arguments)> on a line of its own.
A team that you do not mention goes on with what it is doing.
If you have something to say to others, end with "Communications:" and the messages."""

EXAMPLE_OBSERVATION = """\
This is an example of the form of an answer, not a situation of this game. Suppose that Stalker-1 had units, \
that the enemy units 0xe0001 and 0xe0002 stood before them, and that all actions were possible. \
The tags and points of the example mean nothing later on."""

EXAMPLE_REPLY = """\
Analysis: Two enemies are in reach and the first one is weaker. All fire on it, then on the other.
Actions:
    Team Stalker-1:
        <Attack_Unit(0xe0001)>
        <Move_Screen([14.5, 9])>
Communications:
    <MessageTo(Zealots, '''We fire on 0xe0001 first.''')>"""


@pytest.fixture
def told(briefing: Callable[..., Briefing]) -> Briefing:
    actions = (
        ActionSpec(name="Attack_Unit", args=("tag",), description="attacks an enemy"),
        ActionSpec(name="Move_Screen", args=("screen",)),
        ActionSpec(name="Stop"),
    )
    return briefing(
        teams=(TeamSpec(name="Stalker-1", unit_types=("Stalker",), task="Hold the ramp."),),
        actions=actions,
        correspondents=(Contact(name="Zealots", role="They fight hand to hand."),),
        channels=("Channel-1",),
        max_actions=2,
    )


def test_a_prompt_is_the_system_text_an_example_and_the_observation(told: Briefing) -> None:
    assert Prompt(told).messages("Game\n    Time: 0:07") == (
        ChatMessage(role="system", content=SYSTEM),
        ChatMessage(role="user", content=EXAMPLE_OBSERVATION),
        ChatMessage(role="assistant", content=EXAMPLE_REPLY),
        ChatMessage(role="user", content="Game\n    Time: 0:07"),
    )


def test_the_example_reads_as_a_reply_without_a_fault(told: Briefing) -> None:
    speech = parse(EXAMPLE_REPLY)
    assert speech.faults == ()
    assert [(call.team, call.name) for call in speech.calls] == [
        ("Stalker-1", "Attack_Unit"),
        ("Stalker-1", "Move_Screen"),
    ]
    assert [message.recipient for message in speech.messages] == ["Zealots"]


def test_what_an_agent_does_not_have_is_not_spoken_of(briefing: Callable[..., Briefing]) -> None:
    alone = briefing(correspondents=(), channels=(), task="", actions=(ActionSpec(name="Stop"),))
    text = system_text(alone)
    for absent in ("# Communication", "Communications", "# Your task", "# Arguments", "minimap", "MessageTo"):
        assert absent not in text
    example = Prompt(alone).messages("")[2].content
    assert example.endswith("    Team Stalker-1:\n        <Stop()>")


def test_an_agent_that_can_order_single_units_hears_what_becomes_of_its_orders_to_their_team(
    briefing: Callable[..., Briefing],
) -> None:
    of_team = ActionSpec(name="Move_Screen", args=("screen",))
    of_unit = ActionSpec(name="Select_Unit_Move_Screen", args=("tag", "screen"), actors=1)
    rule = "An action for a single unit takes it out of the actions of its team in the same answer."
    assert rule in system_text(briefing(actions=(of_team, of_unit)))
    assert rule not in system_text(briefing(actions=(of_team,)))


def test_an_agent_without_teams_and_actions_still_has_a_prompt(briefing: Callable[..., Briefing]) -> None:
    example = Prompt(briefing(teams=(), actions=())).messages("")[2].content
    assert parse(example).faults == ()


CLOCKS = [
    ("frozen", "The game stands still while you think"),
    ("budget", "Each decision costs the same game time"),
    ("token", "The more you write, the more game time passes"),
    ("realtime", "The game goes on while you think"),
]


@pytest.mark.parametrize(("rule", "words"), CLOCKS)
def test_the_rule_of_the_clock_is_told(briefing: Callable[..., Briefing], rule: ClockRule, words: str) -> None:
    assert f"- {words}" in system_text(briefing(clock=Clock(rule=rule, max_wait_s=None)))


def test_a_memory_stands_between_the_example_and_the_observation(
    told: Briefing, observation: Callable[..., Observation]
) -> None:
    memory = WholeSteps(2)
    for step in range(3):
        memory.remember(observation(step), f"reply {step}")
    messages = Prompt(told).messages("now", memory.recall(observation(3)).messages)
    assert [message.role for message in messages] == ["system", *["user", "assistant"] * 3, "user"]
    assert [message.content for message in messages[3:]] == ["step 1", "reply 1", "step 2", "reply 2", "now"]
    memory.clear()
    assert memory.recall(observation(4)) == NoMemory().recall(observation(4)) == Recalled()
