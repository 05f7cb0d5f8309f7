"""Whole pages, one for each kind of agent: a golden file holds exactly what a model reads."""

from __future__ import annotations

import re
from typing import Any

import pytest

from khala_bridge.observe import Feedback, Observer
from khala_bridge.observe.text import SECTIONS_OF
from khala_protocol.messages import Received, Rejection

FEEDBACK = {
    "Developer": Feedback(
        accepted=("Empty <Train_Stalker()>",),
        rejections=(
            Rejection(reason="not_available", message="There is no Stargate.", text="<Train_Phoenix()>", start=9),
        ),
    ),
    "Commander": Feedback(
        messages=(Received(sender="CombatGroup1", recipient="Commander", text="We are under fire."),)
    ),
}


@pytest.mark.parametrize("agent", ["Commander", "Developer", "Builder", "CombatGroup1"])
def test_a_page_of_each_kind_of_agent(agent: str, pages: Any, golden: Any) -> None:
    golden(f"{agent.lower()}.txt", pages(FEEDBACK)[agent])


def test_every_kind_of_agent_has_a_page(base_task: Any) -> None:
    assert {agent.kind for agent in base_task.agents} == SECTIONS_OF.keys()


def test_the_same_game_gives_the_same_pages(pages: Any) -> None:
    assert pages(FEEDBACK) == pages(FEEDBACK)


def test_the_order_in_which_the_game_lists_units_does_not_matter(base: Any, look: Any, base_task: Any) -> None:
    units = base()
    texts = []
    for listed in (units, units[::-1]):
        observation = Observer(base_task).observe(look(listed))
        texts.append({name: agent.text for name, agent in observation.agents.items()})
    assert texts[0] == texts[1]


def test_a_side_that_has_lost_everything_has_pages_still(base_task: Any, look: Any) -> None:
    observation = Observer(base_task).observe(look([], abilities={}))
    texts = {name: agent.text for name, agent in observation.agents.items()}
    assert "Teams without units: Stalker-1, Sentry-1" in texts["CombatGroup1"]
    assert "You have no team to order now" in texts["CombatGroup1"]
    assert re.search(r"        no .*Nexus.*: all that is made there\n", texts["Developer"])
    assert "Enemies spotted so far: none" in texts["Commander"]


def test_a_team_without_units_of_its_own_has_no_place(base: Any, look: Any, base_task: Any) -> None:
    agent = Observer(base_task).observe(look(base())).agents["Developer"]
    (team,) = agent.teams
    assert (team.camera, team.view.minimap, team.view.units) == (None, None, ())
    assert not re.search(r"^Team Empty", agent.text, re.MULTILINE)
    assert "    Team Empty: <Train_Probe()>" in agent.text
