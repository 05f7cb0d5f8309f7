"""One recorded battle, and the data set that is made of it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from khala_agents.build import Workshop, load_policy
from khala_agents.config import WorkerSpec
from khala_agents.scripted.endpoint import Endpoint
from khala_agents.worker import run_workers
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key
from khala_protocol.messages import ModelCall
from khala_protocol.recording import Recorder, Recording
from khala_sc2.dataset.card import Recipe
from khala_sc2.dataset.export import export
from khala_sc2.playing import games
from khala_sc2.playing.hosting import host_match

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable, Mapping
    from pathlib import Path

    from khala_agents.policy import Policy
    from khala_protocol.messages import Result, Wire
    from khala_protocol.recording import Recorded

    PlayAgain = Callable[[str, Mapping[str, Policy]], Awaitable[Recording]]
    Rewrite = Callable[..., Recording]

STEPS = 14


def battle(run: str, record: Path) -> MatchConfig:
    task = change(load_task("2s3z_pair"), max_steps=STEPS, max_wait_s=30, images="screen", memory=2)
    return MatchConfig(task=task, run=run, seed=3, record=record, game=games.find("simulator")[1])


async def play(config: MatchConfig, policies: Mapping[str, Policy]) -> Result:
    broker, (sc2path, _) = MemoryBroker(), games.find("simulator")
    workers = asyncio.create_task(run_workers(broker.session(), config.run, "blue", policies))
    (result,) = await host_match(config, sc2path, broker.session())
    await workers
    return result


async def recorded(path: Path) -> None:
    """Record a battle of a model that sees, and of a policy without a model."""
    async with Endpoint() as endpoint:
        workshop = Workshop(overrides={"base_url": endpoint.base_url, "model": "focus-fire", "images": True})
        model = workshop.policy(WorkerSpec(model="scripted"))
        await play(battle("first", path), {"Stalkers": model, "Zealots": load_policy("skilled")})


@pytest.fixture(scope="package")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("runs") / "first" / "recording.mcap"
    asyncio.run(recorded(path))
    return Recording.open(path)


@pytest.fixture(scope="package")
def data_set(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the directory of the whole data set, in every form."""
    out = tmp_path_factory.mktemp("data") / "set"
    export([recording.path.parent.parent], out, Recipe())
    return out


@pytest.fixture
def play_again(tmp_path: Path) -> PlayAgain:
    """Play the battle with other policies, and return what was recorded of it."""

    async def again(run: str, policies: Mapping[str, Policy]) -> Recording:
        path = tmp_path / f"{run}.mcap"
        await play(battle(run, path), policies)
        return Recording.open(path)

    return again


@pytest.fixture
def rewritten(recording: Recording, tmp_path: Path) -> Rewrite:
    """Copy the recording with its samples changed, and return the copy."""

    def copy(change: Callable[[Recorded], Iterable[Wire]], name: str = "changed.mcap") -> Recording:
        with Recorder(tmp_path / name) as recorder:
            for sample in recording:
                if sample.message is None:
                    recorder.write(sample.key, sample.payload)
                for message in change(sample) if sample.message else ():
                    recorder.write(_key(message, sample), encode(message))
        return Recording.open(tmp_path / name)

    return copy


def _key(message: Wire, sample: Recorded) -> str:
    if isinstance(message, ModelCall):
        return agent_key(message.run, message.side, message.agent, Topic.EXCHANGE)
    return sample.key
