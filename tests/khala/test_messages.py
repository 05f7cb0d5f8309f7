"""What the scripted player writes is so, and the measurement would find it if it were not."""

from __future__ import annotations

import random

import pytest

from bench.language.messages import GOAL, Transcript, Turn, UnknownMessage, judge, measure
from khala_agents.scripted.reading import read
from khala_agents.scripted.skilled import skilled
from khala_protocol.speech import parse

LEADER = (
    "Game\n    Time: 6:00\n    Supply: 40 of 110 used\n\n"
    "Map\n    Places, numbered by the way from where you began:\n        Base 1 at [16, 18], yours, CommandCenter\n\n"
    "Unit counts\n    Your units: 1 Marine\n\n"
    "Teams of other agents\n    Group\n        Marine-1: 1 Marine at minimap [30, 32], 100% of health\n\n"
    "Task\n    Gather the groups in front of your base.\n\n"
    "Communication\n    You can write to: Group\n"
)
GROUP = (
    "Team Marine-1\n    Minimap position: [30, 32]\n    Screen on the map: x 0 to 24, y 0 to 24\n    Your units:\n"
    "        Marine | tag 0x1 | screen [12, 12] | health 45/45\n\n"
    "Valid actions\n    Team Marine-1: <Move_Minimap(minimap)>\n\n"
    "Messages\n    Message from Commander: '''{order}'''\n\n"
    "Communication\n    You can write to: Commander\n\nAnswer\n    At most 2 actions per team\n"
)


def transcript(*said: str, obeys: bool = True) -> Transcript:
    """Return a game: replies of the commander with a message to a group each, and then the reply of the group."""
    heard = GROUP.format(order=said[-1])
    reply = skilled(heard, random.Random(1)) if obeys else "Actions:\n"
    commander = [Turn(1, read(LEADER), parse(f"Communications:\n<MessageTo(Group, '''{text}''')>")) for text in said]
    return Transcript({"Commander": commander, "Group": [Turn(2, read(heard), parse(reply))]})


def test_the_players_own_order_is_true_if_its_reader_carries_it_out() -> None:
    (message,) = parse(skilled(LEADER, random.Random(1))).messages
    assert judge(transcript(message.text)).share == 100
    assert judge(transcript(message.text, obeys=False)).false == {"gather: is not carried out": 1}


@pytest.mark.parametrize(
    ("text", "false"),
    [
        (
            "Marine-1 is at [30.0, 32.0] of the minimap and sees 1 enemies.",
            "report: is of a team that it does not have",
        ),
        ("Defend [20.0, 20.0].", "defend: names a place that is not under attack"),
        ("Attack [16.0, 18.0].", "attack: names an own base"),
        ("Help Raiders at [20.0, 20.0].", "help: asks for help that nobody asked for"),
    ],
)
def test_what_the_sender_does_not_see_is_false(text: str, false: str) -> None:
    assert judge(transcript(text)).false == {false: 1}


def test_a_message_within_a_minute_of_the_same_is_said_again() -> None:
    assert judge(transcript("Attack [40.0, 40.0].", "Attack [40.0, 40.0].")).again == 1


def test_a_message_that_no_rule_judges_is_an_error() -> None:
    with pytest.raises(
        UnknownMessage, match=r"'I win\.', and no rule of bench/language/messages.py judges that; add one"
    ):
        judge(transcript("I win."))


@pytest.mark.slow
def test_messages_of_full_games_are_true_and_mostly_said_once() -> None:
    games = [measure("simple64_sceb", steps=200, seed=seed) for seed in (2, 3)]
    said = [sum(found.said.values()) for found in games]
    assert min(said) > 20
    assert min(found.share for found in games) >= GOAL
    again = sum(found.again for found in games)  # 12 and 5 of 26 and 28: one game is no measure
    assert again < 0.5 * sum(said)
