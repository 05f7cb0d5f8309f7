"""What the answers say is what the recording says: positions, health, fate, money, words, at random moments."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.messages import (
    AgentReport,
    Observation,
    Rejection,
    Reply,
    Report,
    Scene,
    UnitFlag,
    count_refusals,
)
from khala_protocol.recording import Recording
from khala_sc2.view.digest import Digest, Memory
from khala_sc2.view.wire import MOST_SCENES
from tests.khala.view.made import opened

if TYPE_CHECKING:
    from pathlib import Path

    from khala_sc2.view.runs import Opened

MOMENTS = 200


def told(recording: Recording, kind: type[Any]) -> dict[tuple[int, str, str], Any]:
    """Return the messages of a kind by step, side and agent; of replies the first one counts."""
    found: dict[tuple[int, str, str], Any] = {}
    for message in recording.of(kind):
        found.setdefault((message.step, getattr(message, "side", ""), getattr(message, "agent", "")), message)
    return found


@pytest.mark.parametrize("name", ["made", "golden", "old"])
def test_two_hundred_random_moments_are_as_recorded(name: str, request: pytest.FixtureRequest) -> None:
    check_moments(request.getfixturevalue(name), MOMENTS)


def check_moments(shown: Opened, count: int) -> None:
    """Compare random moments with what a reading of the whole recording says."""
    recording = Recording.open(shown.path)
    seen, replies, reports = (told(recording, kind) for kind in (Observation, Reply, Report))
    steps = sorted({step for step, _, _ in reports})
    chance = random.Random(14)
    for _ in range(count):
        step = chance.choice(steps)
        moment = json.loads(shown.moment(0, step))
        for decision in moment["decisions"]:
            who = decision["side"], decision["agent"]
            asked = max(other for other, *whose in seen if tuple(whose) == who and other <= step)
            assert decision["step"] == asked
            assert decision["reply"] == (replies[asked, *who].text if (asked, *who) in replies else "")
            assert decision["game_loop"] == seen[asked, *who].game_loop
            if decision["effect_step"] is None:
                continue
            report = reports[decision["effect_step"], who[0], ""]
            mine = next(agent for agent in report.agents if agent.agent == who[1])
            assert (decision["fate"], decision["status"]) == (mine.fate, mine.status)
            assert decision["usage"] == json.loads(mine.usage.model_dump_json())
            refused = {(deed["reason"], deed["message"]) for deed in decision["deeds"] if deed["accepted"] is False}
            assert refused == {(one.reason, one.message) for one in mine.rejections if one.text}
        for side in moment["sides"]:
            so_far = [report for (at, whose, _), report in reports.items() if at <= step and whose == side["side"]]
            assert side["killed_value"] == pytest.approx(sum(report.killed_value or 0 for report in so_far))
            assert side["lost_value"] == pytest.approx(sum(report.lost_value or 0 for report in so_far))
            usages = [agent.usage for report in so_far for agent in report.agents]
            assert side["tokens"] == sum(usage.prompt_tokens + usage.completion_tokens for usage in usages)
            costs = [usage.cost_usd for usage in usages if usage.cost_usd is not None]
            assert side["cost_usd"] == (pytest.approx(sum(costs)) if costs else None)


@pytest.mark.parametrize("name", ["made", "golden"])
def test_scenes_are_the_recorded_ones(name: str, request: pytest.FixtureRequest) -> None:
    found: Opened = request.getfixturevalue(name)
    recorded = {scene.step: scene for scene in Recording.open(found.path).of(Scene)}
    shown = json.loads(found.scenes(0, 8, 23))["scenes"]
    assert [Scene.model_validate(one) for one in shown] == [recorded[step] for step in range(8, 24)]


def test_units_of_an_old_recording_are_where_agents_saw_them(old: Opened) -> None:
    recorded = list(Recording.open(old.path).of(Observation))
    chance = random.Random(14)
    for seen in chance.sample(recorded, 30):
        (scene,) = (Scene.model_validate(one) for one in json.loads(old.scenes(0, seen.step, seen.step))["scenes"])
        drawn = {mark.tag: mark for mark in scene.units}
        for team in seen.view.teams:
            for unit in (*team.units, *team.enemies):
                mark = drawn[int(unit.tag, 16)]
                assert (mark.type, mark.x, mark.y) == (unit.type, *unit.minimap)
                assert (mark.health, mark.shield) == (unit.health, unit.shield)
                assert not mark.flags & UnitFlag.REMEMBERED


def test_the_time_line_sums_up_to_the_result(made: Opened) -> None:
    (result,) = Recording.open(made.path).results
    curves = {(one["name"], one["side"]): one["values"] for one in json.loads(made.timeline(0))["curves"]}
    assert curves["killed_value", result.side][-1] == pytest.approx(result.killed.value)
    assert curves["lost_value", result.side][-1] == pytest.approx(result.lost.value)
    assert curves["army_value", "opponent"][-1] == 175.0
    assert curves["minerals", "blue"][-1] == 89.0


def test_refused_calls_are_counted_as_everywhere_else() -> None:
    """A rejection may stand for many others; messages are read as plain JSON here."""
    single = Rejection(reason="not_available", message="Not now.", text="<Stop()>", start=0)
    many = single.but(text="", others={"malformed": 3, "unknown_team": 2})
    agent = AgentReport(agent="A", side="blue", status="ok", rejections=(single, many))
    report = Report(run="r", side="blue", episode=0, step=0, game_loop=0, agents=(agent,))
    digest = Digest(Memory())
    digest.report(report.model_dump(mode="json"))
    assert digest.steps[0, 0]["refused/blue"] == count_refusals(agent.rejections).total() == 6


@pytest.mark.parametrize("name", ["golden", "old"])
def test_every_death_of_the_result_is_on_the_time_line(name: str, request: pytest.FixtureRequest) -> None:
    found: Opened = request.getfixturevalue(name)
    (result,) = Recording.open(found.path).results
    deaths = [mark for mark in json.loads(found.timeline(0))["marks"] if mark["kind"] == "death"]
    lost = sum(mark["weight"] for mark in deaths if mark["side"] == result.side)
    killed = sum(mark["weight"] for mark in deaths if mark["side"] == "opponent")
    # the deaths of the last step are in its report, and no observation follows that would name them
    assert result.lost.units - 1 <= lost <= result.lost.units
    assert result.killed.units - 1 <= killed <= result.killed.units


@pytest.mark.slow
@pytest.mark.game
@pytest.mark.parametrize("task", ["2s3z_pair", "simple64_duel"])
def test_a_match_that_is_played_now_is_shown_as_it_was(task: str, tmp_path: Path) -> None:
    arguments = ["run", task, "--policy", "skilled", "--max-steps", "40", "--out", str(tmp_path), "--run", "now"]
    subprocess.run([sys.executable, "-m", "khala_sc2", *arguments], check=False, capture_output=True)
    played = opened(tmp_path / "now" / "recording.mcap")
    recorded = {scene.step: scene for scene in Recording.open(played.path).of(Scene)}
    assert recorded
    for begin in range(0, max(recorded) + 1, MOST_SCENES):
        shown = json.loads(played.scenes(0, begin, begin + MOST_SCENES - 1))["scenes"]
        for one in shown:
            assert Scene.model_validate(one) == recorded[one["step"]]
    check_moments(played, 200)
