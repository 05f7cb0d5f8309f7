"""Scripted players on a golden observation: what they read, and what they answer."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_agents.scripted.players import PLAYERS, focus_fire, in_reach, random_legal, silent
from khala_agents.scripted.reading import Situation, TextAction, TextUnit, read
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

GOLDEN = Path(__file__).resolve().parents[2] / "bridge" / "golden"
"""Observations as the host writes them; the two packages share no code, only this text."""
OBSERVATION = (Path(__file__).parent / "observation.txt").read_text(encoding="utf-8")


def quiet() -> random.Random:
    """Return a generator whose first roll is no message."""
    return random.Random(2)


def test_an_observation_is_read_as_it_stands() -> None:
    situation = read(OBSERVATION)
    assert list(situation.teams) == ["Zealot-1", "Stalker-1", "Stalker-2"]
    zealots, stalkers, others = situation.teams.values()
    assert zealots.own == [TextUnit("0x100040001", "Zealot", 12, 12, 150, 150, float("inf"))]
    assert [unit.tag for unit in zealots.allies] == ["0x100080001"]
    assert zealots.enemies == [
        TextUnit("0x100140001", "Zealot", 13.5, 12, 112, 150, 1.5),
        TextUnit("0x100180001", "Stalker", 16, 12, 41, 160, 4.12),
        TextUnit("0x1001c0001", "Stalker", 23, 12, 3, 160, 11),
    ]
    assert [(unit.x, unit.y) for unit in stalkers.own] == [(12, 12), (27.5, -1)]
    assert [(unit.weapon_s, unit.order) for unit in stalkers.own] == [(0, ""), (0.62, "Attack")]
    assert (stalkers.minimap, others.minimap) == ((18, 32), (40, 40))
    assert (stalkers.bounds, others.bounds) == ((3.5, 24, 0, 24), (0, 24, 0, 24))
    assert zealots.actions == [TextAction("Attack_Unit", ("tag",))]
    assert others.actions == [TextAction("Attack_Unit", ("tag",)), TextAction("Move_Screen", ("screen",))]
    assert situation.max_actions == 2
    assert situation.correspondents == ["Scout", "Commander"]


def test_the_enemies_in_reach_are_those_that_will_do() -> None:
    told = "    What will do for team Zealot-1:\n        Attack_Unit: tag 0x1001c0001\n"
    zealots, *_ = read(OBSERVATION.replace("Valid actions\n", f"Valid actions\n{told}", 1)).teams.values()
    assert [unit.tag for unit in in_reach(zealots)] == ["0x1001c0001"]


@pytest.mark.parametrize("text", ["", "\n\n", "What is 2 + 2?", "Team \n    Your units:\n        nothing"])
def test_a_text_that_is_no_observation_is_an_empty_situation(text: str) -> None:
    assert read(text) == Situation()


def test_the_enemies_in_reach_are_those_about_as_near_as_the_nearest() -> None:
    zealots, stalkers, others = read(OBSERVATION).teams.values()
    assert [unit.tag for unit in in_reach(zealots)] == ["0x100140001", "0x100180001"]
    assert [unit.tag for unit in in_reach(stalkers)] == ["0x100180001"]
    assert in_reach(others) == []


FOCUS_FIRE = """\
Analysis: 0x100180001 is the weakest enemy in reach, with 41 left. All fire on it.
Actions:
    Team Zealot-1:
        <Attack_Unit(0x100180001)>
    Team Stalker-1:
        <Attack_Unit(0x100180001)>
    Team Stalker-2:
        <Move_Screen([5.0, 5.0])>
"""


def test_focus_fire_attacks_the_weakest_enemy_that_most_teams_reach() -> None:
    assert focus_fire(OBSERVATION, quiet()) == FOCUS_FIRE


def test_focus_fire_tells_the_others_now_and_then() -> None:
    said = [focus_fire(OBSERVATION, random.Random(seed)).removeprefix(FOCUS_FIRE) for seed in range(400)]
    message = "Communications:\n    <MessageTo(Scout, '''We fire on 0x100180001.''')>\n"
    assert set(said) == {"", message}
    assert 60 < said.count(message) < 140


def test_focus_fire_walks_to_the_middle_when_nobody_is_in_sight() -> None:
    text = "Team A\n    Your units:\n        Stalker | tag 0x1 | screen [12, 12] | health 1/1\n\n"
    text += "Valid actions\n    Team A: <Move_Minimap(minimap)>\n"
    assert focus_fire(text, quiet()).endswith("    Team A:\n        <Move_Minimap([32.0, 32.0])>\n")


def test_silent_orders_nothing() -> None:
    assert silent(OBSERVATION, quiet()) == "Analysis: 3 team(s) of mine, 3 enemy unit(s) in sight. I watch.\n"


@pytest.mark.parametrize("seed", range(30))
def test_random_legal_orders_what_is_valid_with_arguments_that_are_there(seed: int) -> None:
    situation = read(OBSERVATION)
    speech = parse(random_legal(OBSERVATION, random.Random(seed)))
    assert speech.faults == ()
    assert {call.team for call in speech.calls} == set(situation.teams)
    for call in speech.calls:
        team = situation.teams[call.team or ""]
        assert call.name in {action.name for action in team.actions}
        (argument,) = call.args
        if call.name == "Attack_Unit":
            assert argument in {unit.tag for unit in team.enemies}
        else:
            assert isinstance(argument, tuple)
            x, y = argument
            assert team.bounds[0] < x < team.bounds[1]
            assert team.bounds[2] < y < team.bounds[3]


def test_random_legal_selects_an_own_unit_first() -> None:
    text = OBSERVATION.replace("Zealot-1: <Attack_Unit(tag)>", "Zealot-1: <Select_Unit_Attack_Unit(tag, tag)>")
    (call, *_) = parse(random_legal(text, quiet())).calls
    assert call.args[0] == "0x100040001"
    assert call.args[1] in {"0x100140001", "0x100180001", "0x1001c0001"}


@pytest.mark.parametrize("player", PLAYERS.values(), ids=PLAYERS)
def test_the_same_prompt_gets_the_same_reply(player: Callable[[str, random.Random], str]) -> None:
    assert player(OBSERVATION, random.Random("x")) == player(OBSERVATION, random.Random("x"))


@pytest.mark.parametrize("page", sorted(GOLDEN.glob("*.txt")), ids=lambda page: page.stem)
def test_the_host_writes_what_players_can_read(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    teams = read(text).teams.values()
    units = [unit for team in teams for unit in (*team.own, *team.allies, *team.enemies)]
    again = re.findall(r"0x\w+ \[[^\]]*\] [\d.]+", text)
    grouped = "".join(re.findall(r"Allied units by type:\n((?: {8}.*\n)*)", text))
    assert sum(bool(unit.tag) for unit in units) == text.count(" | tag 0x") + len(again)
    assert sum(not unit.tag for unit in units) == sum(map(int, re.findall(r"^ {8}(\d+)", grouped, re.MULTILINE)))
    assert all(unit.hit_points > 0 for unit in units)
    assert all(unit.distance < 100 for team in teams for unit in team.enemies)
    assert all(team.actions for team in teams)
    for player in PLAYERS.values():
        speech = parse(player(text, quiet()))
        assert speech.faults == ()
        assert {call.team for call in speech.calls} <= set(read(text).teams)


@given(st.data())
def test_no_prompt_upsets_a_player(data: st.DataObject) -> None:
    lines = OBSERVATION.splitlines()
    pieces = st.one_of(st.sampled_from(lines), st.text(), st.sampled_from(OBSERVATION.split()))
    text = "".join(data.draw(st.lists(st.tuples(pieces, st.sampled_from(["\n", " ", "", "."]))).map(_joined)))
    for player in PLAYERS.values():
        assert player(text, random.Random(0)).startswith("Analysis: ")


def _joined(parts: list[tuple[str, str]]) -> str:
    return "".join(text + end for text, end in parts)
