"""The stages of a task: which one a team is at."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from khala_bridge.observe import Observer
from khala_bridge.observe.stages import Stages
from khala_bridge.state.teams import Team
from khala_bridge.task.config import TeamConfig
from khala_bridge.task.variant import Stage

GO, TAKE, HOLD = (
    Stage(task="go", at=(30, 30), within=4),
    Stage(task="take", until_s=20),
    Stage(task="hold"),
)


def team(name: str = "T", stages: tuple[Stage, ...] = (GO, TAKE, HOLD)) -> Team:
    config = TeamConfig(name="T", unit_types=("Stalker",), stages=stages)
    return Team("A", name, "group", (1,), None, config)


def test_a_team_goes_through_its_stages() -> None:
    stages, seen = Stages(), []
    for place, time_s in (
        ((10, 10), 0),
        ((25.9, 30), 1),
        ((26, 30), 2),
        ((10, 10), 19.9),
        ((10, 10), 20),
        ((0, 0), 99),
    ):
        seen.append(stages.task(team(), place, time_s))
    assert seen == ["go", "go", "take", "take", "hold", "hold"]


def test_a_stage_that_is_over_by_its_time_is_passed_over() -> None:
    assert Stages().task(team(), (30, 30), 25) == "hold"


def test_a_place_is_not_reached_without_a_screen() -> None:
    assert Stages().task(team(), None, 0) == "go"


def test_teams_of_one_configuration_are_at_a_stage_each() -> None:
    stages = Stages()
    assert [stages.task(team("T-1"), (30, 30), 0), stages.task(team("T-2"), (0, 0), 0)] == ["take", "go"]


def test_a_team_without_stages_has_no_task_of_the_moment() -> None:
    assert Stages().task(team(stages=()), (0, 0), 0) == ""


def test_a_stage_without_an_end_must_be_the_last() -> None:
    with pytest.raises(ValidationError, match="every stage but the last one needs an end: give at or until_s"):
        TeamConfig(name="T", unit_types=("Stalker",), stages=(HOLD, GO))


def test_the_stage_stands_in_the_task_of_the_page(base: Any, look: Any, base_task: Any, unit: Any) -> None:

    observer = Observer(base_task)
    far = observer.observe(look(base())).agents["CombatGroup1"]
    near = observer.observe(look([unit(0x100210001, "Stalker", 32, 32)])).agents["CombatGroup1"]
    assert "    Team Stalker-1: Stay alive.\n    Team Stalker-1: Go to [32, 32].\n" in far.text
    assert "    Team Stalker-1: Stay alive.\n    Team Stalker-1: Hold [32, 32].\n" in near.text
    assert [agent.view.teams[0].task for agent in (far, near)] == ["Go to [32, 32].", "Hold [32, 32]."]
