"""A match whose model answers with nonsense at first, and is asked again: reports, result, usage, and its replays."""

from __future__ import annotations

import asyncio
import json
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from khala_agents.build import Workshop
from khala_agents.config import WorkerSpec
from khala_agents.scripted.endpoint import NONSENSE, Behaviour, Endpoint
from khala_agents.scripted.faults import InjectedFaults
from khala_agents.worker import run_worker
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.game.game import GameConfig, GameThread, Sides
from khala_bridge.game.pysc2_game import PySC2Game
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.messages import Observation, Reply, Report, Usage
from khala_protocol.recording import Recording
from khala_sc2.dataset.rows import Rows
from khala_simulator.process.install import install
from tests.khala.view.made import opened

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    from khala_protocol.messages import Result
    from khala_protocol.recording.difference import Difference

    Replay = Callable[..., Awaitable[list[Difference]]]

pytestmark = pytest.mark.game

RUN = "rethink"
AGENTS = ("Stalkers", "Zealots")


async def play(path: Path, rule: str, steps: int) -> Result:
    """Play some steps with a scripted model half of whose answers are nonsense."""
    task = change(load_task("2s3z_pair"), max_wait_s=10.0, max_steps=steps, rule=rule)
    config = MatchConfig(task=task, run=RUN, record=path / "recording.mcap", game="Khala simulator")
    game = GameConfig(sc2path=install(path / "sc2"), map=task.map_spec, seed=1)
    broker = MemoryBroker()
    async with AsyncExitStack() as stack:
        behaviour = Behaviour(faults=InjectedFaults({"nonsense": 0.5}))
        endpoint = await stack.enter_async_context(Endpoint(behaviour))
        workshop = Workshop(overrides={"base_url": endpoint.base_url})
        agents = await stack.enter_async_context(asyncio.TaskGroup())
        for name in AGENTS:
            policy = workshop.policy(WorkerSpec(model="scripted", rethink=1 if name == "Stalkers" else 0))
            agents.create_task(run_worker(broker.session(), RUN, "blue", name, policy))
        side = await stack.enter_async_context(Sides(GameThread(lambda: PySC2Game(game)), [RawExecutor()]))
        (result,) = await host(config, side, broker.session())
    return result


@pytest.mark.parametrize(
    ("rule", "steps"),
    [("frozen", 8), *(pytest.param(rule, 60, marks=pytest.mark.slow) for rule in ("budget", "token", "realtime"))],
)
async def test_nonsense_is_answered_within_the_step_and_counted_and_replays_the_same(
    tmp_path: Path, replay_host: Replay, replay_agents: Replay, rule: str, steps: int
) -> None:
    result = await play(tmp_path, rule, steps)
    recording = Recording.open(tmp_path / "recording.mcap")
    verdicts = [seen for seen in recording.of(Observation) if seen.verdict is not None]
    reports = [agent for report in recording.of(Report) for agent in report.agents]
    assert {seen.agent for seen in verdicts} == {"Stalkers"}
    assert result.rethinks == {"Stalkers": len(verdicts)} == {"Stalkers": sum(a.rethinks for a in reports)}
    replies = list(recording.of(Reply, agent="Stalkers"))
    first = {(r.step, r.rethinks): r for r in replies}
    assert verdicts
    for seen in verdicts:
        assert seen.verdict is not None
        assert "rejected: <Attack_Unit()>: Attack_Unit takes (tag)" in seen.verdict.text
        assert first[seen.step, 0].text == NONSENSE
        second = first[seen.step, 1]
        assert second.usage.requests == 2
        assert second.usage.completion_tokens > first[seen.step, 0].usage.completion_tokens
    better = [a for a in reports if a.rethinks and a.accepted]
    assert better
    assert result.usage["Stalkers"] == sum((a.usage for a in reports if a.agent == "Stalkers"), Usage())
    shown = opened(tmp_path / "recording.mcap")
    for seen in verdicts:
        texts = json.loads(shown.texts(0, seen.step, "blue", "Stalkers"))
        assert texts["reply"] == first[seen.step, 1].text
        assert [call["completion"] for call in texts["calls"]] == [NONSENSE, first[seen.step, 1].text]
    shown.index.close()
    assert await replay_host(tmp_path / "recording.mcap") == []
    assert await replay_agents(tmp_path / "recording.mcap") == []
    assert recording.run is not None
    rows = [row for row in Rows(recording, recording.run) if row.agent == "Stalkers"]
    assert [row.reply for row in rows if row.step == verdicts[0].step] == [first[verdicts[0].step, 1].text]
    assert all(row.prompt[-2].content == NONSENSE for row in rows if row.step in {seen.step for seen in verdicts})
