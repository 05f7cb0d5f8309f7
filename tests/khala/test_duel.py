"""Two sides play a whole match: nothing of one reaches the other, and what was recorded plays again."""

from __future__ import annotations

import asyncio
import re
from typing import TYPE_CHECKING

import pytest

from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_worker
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.past.resume import read_unfinished
from khala_orchestrator.past.transcript import StepSelection, transcript
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.keys import Topic, parse
from khala_protocol.messages import Message, Observation, Report, Result
from khala_protocol.recording import Recorder, Recording
from khala_sc2.playing import games
from khala_sc2.playing.hosting import host_match
from khala_sc2.testing import replay_host

if TYPE_CHECKING:
    from pathlib import Path

    from khala_orchestrator.past.resume import Unfinished
    from khala_protocol.messages import Briefing
    from khala_protocol.recording import Recorded

pytestmark = pytest.mark.game

STEPS = 8
TAG = re.compile(rb"0x[0-9a-f]+")


def talk_and_attack(briefing: Briefing, seen: Observation) -> str:
    """Say something to everybody of either side, as far as that is possible, and attack the first enemy in sight."""
    other = next(contact.name for contact in briefing.correspondents)
    lines = ["Communications:", f"<MessageTo({other}, 'secret of {seen.side}, step {seen.step}')>"]
    if seen.step == 0:
        lines += ["<ListenTo(Army)>", "<MessageTo(Captain, 'secret of nobody')>"]
    lines += [f"<MessageTo(Army, 'all of {seen.side}')>", "Actions:"]
    for team in seen.view.teams:
        lines += [f"Team {team.name}:"] + ([f"<Attack_Unit({team.enemies[0].tag})>"] if team.enemies else [])
    return "\n".join(lines)


async def play(config: MatchConfig, past: Unfinished | None = None) -> list[Result]:
    sc2path, name = games.find("simulator")
    broker = MemoryBroker()
    agents = [
        asyncio.create_task(
            run_worker(broker.session(), config.run, task.side, agent.name, FunctionPolicy(talk_and_attack))
        )
        for task in config.task.per_side()
        for agent in task.agents
    ]
    try:
        return await host_match(config.model_copy(update={"game": name}), sc2path, broker.session(), past=past)
    finally:
        for agent in agents:
            agent.cancel()
        await asyncio.gather(*agents, return_exceptions=True)


def match(task: str, steps: int, record: Path) -> MatchConfig:
    return MatchConfig(task=change(load_task(task), max_steps=steps, max_wait_s=30), run="duel", record=record)


@pytest.fixture(scope="module")
def duel(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A duel of four agents, two of each name."""
    path = tmp_path_factory.mktemp("duel") / "recording.mcap"
    asyncio.run(play(match("duel_2s3z", STEPS, path)))
    return Recording.open(path)


def test_each_side_has_a_report_of_each_step_and_a_result(duel: Recording) -> None:
    reports = [(report.side, report.step) for report in duel.of(Report)]
    assert reports == [(side, step) for step in range(STEPS) for side in ("blue", "red")]
    assert {agent.side for report in duel.of(Report) if report.side == "red" for agent in report.agents} == {"red"}
    assert [result.side for result in duel.results] == ["blue", "red"]
    for result in duel.results:
        assert result.statuses == {"Stalkers": {"ok": STEPS}, "Zealots": {"ok": STEPS}}


def words_of_the_other_side(sample: Recorded) -> bool:
    """Return whether a sample under a key of one side has something that the other side said."""
    assert sample.address is not None
    other = {"blue": b"red", "red": b"blue"}[str(sample.address.side)]
    return any(words in sample.payload for words in (b"secret of " + other, b"all of " + other))


def test_no_word_of_a_side_is_under_a_key_of_the_other(duel: Recording) -> None:
    own = [sample for sample in duel if sample.address and sample.address.side]
    assert {parse(sample.key).topic for sample in own} >= {
        Topic.BRIEFING,
        Topic.OBSERVATION,
        Topic.REPLY,
        Topic.MESSAGE,
    }
    assert not any(map(words_of_the_other_side, own))
    for side in ("blue", "red"):
        heard = [said.text for seen in duel.observations("Zealots", side=side) for said in seen.messages]
        assert f"secret of {side}, step 0" in heard
        assert f"all of {side}" in heard
        assert {said.side for said in duel.of(Message, side=side)} == {side}


def test_an_agent_reads_who_else_is_on_its_side_only(duel: Recording) -> None:
    rejected = [r.message for seen in duel.observations("Zealots", side="red") for r in seen.rejections]
    assert rejected == ["You cannot write to 'Captain': you can write to Stalkers, Army."]


async def test_no_unit_that_the_fog_hides_is_under_a_key_of_the_other_side(tmp_path: Path) -> None:
    path = tmp_path / "apart.mcap"
    await play(match("simple64_duel", 2, path))
    tags: dict[str, set[bytes]] = {"blue": set(), "red": set()}
    for sample in Recording.open(path):
        if sample.address and sample.address.side:
            tags[sample.address.side].update(TAG.findall(sample.payload))
    assert tags["blue"] and tags["red"]  # of the Nexus of each
    assert not tags["blue"] & tags["red"]


@pytest.mark.slow
async def test_a_recorded_duel_plays_again_byte_for_byte(duel: Recording) -> None:
    assert await replay_host(duel.path) == []


@pytest.mark.slow
async def test_a_duel_goes_on_where_its_host_was_lost(duel: Recording, tmp_path: Path) -> None:
    """The host was lost between the reports of the two sides, so that this step is the open one."""
    with Recorder(tmp_path / "torn.mcap") as torn:
        for sample in duel:
            torn.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns)
            if isinstance(sample.message, Report) and (sample.message.side, sample.message.step) == ("blue", 5):
                break
    config = match("duel_2s3z", STEPS, tmp_path / "whole.mcap")
    past = read_unfinished(Recording.open(torn.path), config.model_copy(update={"game": "Khala simulator"}))
    assert past.steps == 5
    await play(config, past)
    whole = Recording.open(tmp_path / "whole.mcap")
    assert list(whole.of(Observation)) == list(duel.of(Observation))
    assert [result.killed for result in whole.results] == [result.killed for result in duel.results]


def test_a_duel_is_told_with_the_names_of_the_sides(duel: Recording) -> None:
    lines = [str(part) for part in transcript(duel.path, StepSelection.of("red/Zealots", "0"))]
    assert any(line.startswith("step 0  0:00  red  score") for line in lines)
    assert any(line.startswith("  red/Zealots → Stalkers: secret of red, step 0") for line in lines)
    assert not any("blue" in line for line in lines if line.startswith("  "))
