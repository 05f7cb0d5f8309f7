"""A battle on the simulator with pictures: sent, recorded, and repeated in a replay."""

from __future__ import annotations

import asyncio
import hashlib
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from khala_agents.policy import Policy
from khala_agents.worker import run_worker
from khala_bridge.task.images import ImageSpec
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_orchestrator.past.replay import replay
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.messages import Observation
from khala_protocol.recording import Recording
from khala_sc2.playing.hosting import game_of
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from pathlib import Path

    from khala_agents.policy import Context
    from khala_bridge.task.config import TaskConfig

pytestmark = pytest.mark.game

STEPS = 3
SPECS = {
    "Stalkers": (
        ImageSpec(what="screen", format="png"),
        ImageSpec(what="screen", source="game", size_px=256, format="png"),
        ImageSpec(what="features", source="auto"),
    ),
    "Zealots": (
        ImageSpec(what="minimap", source="game", size_px=256),
        ImageSpec(what="minimap:camera", size_px=256),
    ),
}


def task_with_pictures() -> TaskConfig:
    task = change(load_task("2s3z_pair"), max_wait_s=20.0, max_steps=STEPS)
    agents = tuple(agent.model_copy(update={"images": SPECS[agent.name]}) for agent in task.agents)
    return task.model_copy(update={"agents": agents})


class Looking(Policy):
    """A policy that charges, and keeps what it sees."""

    def __init__(self) -> None:
        self.seen: dict[str, bytes] = {}

    async def decide(self, context: Context) -> str:
        observation = context.observation
        self.seen |= await context.pictures.get(observation.images)
        teams = "\n".join(f"Team {team.name}:\n<Move_Screen([16, 12])>" for team in observation.view.teams)
        return f"Actions:\n{teams}"


@pytest.mark.slow
async def test_a_battle_with_pictures_is_recorded_and_replayed_to_the_pixel(tmp_path: Path) -> None:
    config = MatchConfig(task=task_with_pictures(), run="live", record=tmp_path / "r.mcap")
    assert config.task.render_px == 256
    broker, policies, stop = MemoryBroker(), {name: Looking() for name in SPECS}, asyncio.Event()
    workers = [
        asyncio.create_task(run_worker(broker.session(), "live", "blue", name, policy, stop=stop))
        for name, policy in policies.items()
    ]
    sc2path = install(tmp_path / "sc2")
    async with game_of(config, sc2path) as game:
        await host(config, game, broker.session())
    stop.set()
    await asyncio.gather(*workers)

    recording = Recording.open(tmp_path / "r.mcap")
    named = {ref.sha256: ref for seen in recording.of(Observation) for ref in seen.images}
    held = dict(recording.images())
    assert held.keys() == named.keys() == policies["Stalkers"].seen.keys() | policies["Zealots"].seen.keys()
    for digest, data in held.items():
        assert hashlib.sha256(data).hexdigest() == digest
        decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert decoded is not None
        assert decoded.shape[:2] == (named[digest].height, named[digest].width)
    names = [[ref.name for ref in seen.images] for seen in recording.observations("Zealots")]
    assert names == [["minimap", "minimap-camera"]] * STEPS
    rendered = [ref.title for ref in named.values() if "rendered by the game" in ref.title]
    assert rendered, "the simulator renders"

    async with game_of(config.model_copy(update={"record": None}), sc2path) as game:
        assert await replay(recording, game) == []
