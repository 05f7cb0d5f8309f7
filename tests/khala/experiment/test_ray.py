"""Matches are played on a Ray cluster of three nodes, one of which is killed in the middle."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from khala_agents.scripted.endpoint import Behaviour, Endpoint
from khala_protocol.errors import ConfigError
from khala_sc2.experiment.engine import MATCH_MB, Local
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.runner import Runner, RunnerEvent
from khala_sc2.experiment.spec import Experiment, ExperimentBudget
from khala_sc2.experiment.store import Store

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from aiohttp import web

    from khala_sc2.experiment.engine import Engine

pytestmark = [pytest.mark.slow, pytest.mark.game, pytest.mark.filterwarnings("ignore")]  # those of Ray's own code

BY_THE_CLOCK = {"wall_s", "latency_p50_s", "latency_p95_s", "lag_s"}
"""Measures that differ each time."""
PLAYERS = [{"name": name, "model": name} for name in ("skilled", "focus-fire")]
PATIENT = {
    "RAY_agent_register_timeout_ms": "300000",
    "RAY_raylet_start_wait_time_s": "300",
    "RAY_USAGE_STATS_ENABLED": "0",
}
"""A node of Ray is a dozen processes, and this machine may have two cores."""
PER_MINUTE = 18


def experiment(**fields: Any) -> Experiment:
    fixed = {"task": "2s3z_pair", "max_steps": 6, "clock": "frozen", "rhythm": "paper"}
    return Experiment.model_validate({"name": "e", "fixed": fixed, "factors": {"player": PLAYERS}} | fields)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Yield a cluster with two nodes of one core each; the runner is on the first one."""
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    with pytest.MonkeyPatch.context() as patched:
        for name, value in PATIENT.items():
            patched.setenv(name, value)
        cluster = Cluster()
        try:
            for _ in range(2):
                node(cluster, cores=1)
            yield cluster
        finally:
            cluster.shutdown()  # type: ignore[no-untyped-call]  # by Ray


def node(cluster: Any, *, cores: int) -> Any:
    memory = 2 * cores * MATCH_MB * 2**20
    return cluster.add_node(num_cpus=cores, memory=memory, object_store_memory=100 * 2**20, include_dashboard=False)


def ray(cluster: Any, **options: Any) -> Any:
    from khala_sc2.experiment.ray_engine import Ray

    return Ray(options.pop("slots", None), game="simulator", address=cluster.address, **options)


async def run(
    directory: Path, engine: Engine, found: Experiment, see: Callable[[RunnerEvent], None] = lambda _: None
) -> Store:
    store = Store(directory / found.name)
    async with engine:
        runner = Runner(found, store, engine, ExperimentBudget(), see=see)
        await runner.play(plan(found))
    return store


def rows(store: Store) -> dict[str, dict[str, Any]]:
    """Return the results by key, without what differs each time."""
    results = {row["match"]: row for row in store.results()}
    assert len(results) == len(store.results()), "a match of this experiment has one episode and one side"
    return {key: {n: value for n, value in row.items() if n not in BY_THE_CLOCK} for key, row in results.items()}


class TimedEndpoint(Endpoint):
    """Keeps when it was asked, and how many requests it had at once."""

    def __init__(self) -> None:
        super().__init__(Behaviour(latency_s=0.3))
        self.times: list[float] = []
        self.now = self.most_at_once = 0

    async def _complete(self, request: web.Request) -> web.StreamResponse:
        self.times.append(asyncio.get_running_loop().time())
        self.now += 1
        self.most_at_once = max(self.now, self.most_at_once)
        try:
            return await super()._complete(request)
        finally:
            self.now -= 1


async def test_matches_on_two_nodes_ask_a_model_together_no_more_often_than_its_file_says(
    cluster: Any, tmp_path: Path
) -> None:
    shared = tmp_path / "shared"
    async with TimedEndpoint() as endpoint:
        file = tmp_path / "limited.yaml"
        limits = {"requests_per_minute": PER_MINUTE, "in_flight": 1}
        model = {"profile": "compatible", "model": "skilled", "base_url": endpoint.base_url, "limits": limits}
        file.write_text(yaml.safe_dump(model))
        found = experiment(factors={"player": [{"name": "limited", "model": str(file)}]}, seeds=2)
        store = await run(tmp_path, engine := ray(cluster, recordings=f"file://{shared}"), found)
    assert engine.slots == 2
    assert [played.state for played in store.matches().values()] == ["done"] * 2

    assert endpoint.most_at_once == 1
    first, *_ = times = sorted(endpoint.times)
    assert len(times) == 2 * 2 * 6, "matches, agents, steps"
    for number, at in enumerate(times, 1):
        assert number <= PER_MINUTE * (1 + (at - first) / 60) + 1, "one for how late the first one arrived"

    for key, played in store.matches().items():
        assert (shared / key / "recording.mcap").read_bytes() == (store.directory / played.recording).read_bytes()


async def test_when_a_node_is_killed_every_match_is_played_once_with_the_results_of_one_machine(
    cluster: Any, tmp_path: Path
) -> None:
    found = experiment(seeds=6)
    doomed = [node(cluster, cores=2)]
    seen: list[RunnerEvent] = []

    def see(event: RunnerEvent) -> None:
        seen.append(event)
        if event.what == "ends" and doomed:  # three of four are being played, so that one at least is on this node
            cluster.remove_node(doomed.pop(), allow_graceful=False)

    store = await run(tmp_path / "ray", ray(cluster, slots=4), found, see)
    played = store.matches()
    assert (len(played), {one.state for one in played.values()}) == (12, {"done"})
    assert sorted(event.match.key for event in seen if event.what == "ends") == sorted(played)
    lost = [event for event in seen if event.what == "again"]
    assert lost and all(event.words.startswith("Ray says: ") for event in lost)
    assert len(list(store.directory.glob("matches/*/*.mcap"))) == 12
    assert sum(one.attempts for one in played.values()) == 12 + len(lost)

    alone = await run(tmp_path / "local", Local(2, game="simulator", logs=tmp_path / "logs"), found)
    assert rows(store) == rows(alone)


async def test_ctrl_c_ends_ray_on_this_machine_and_keeps_what_was_played(tmp_path: Path) -> None:
    pytest.importorskip("ray")
    file = tmp_path / "many.yaml"
    fixed = {"task": "2s3z_pair", "max_steps": 6, "model": "skilled"}
    file.write_text(yaml.safe_dump({"name": "many", "fixed": fixed, "factors": {"task": ["2s3z_pair"]}, "seeds": 1000}))
    words = ("experiment", "run", str(file), "--on", "ray", "--jobs", "1", "--out", str(tmp_path))
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "khala_sc2", *words), stderr=subprocess.PIPE, env=os.environ | PATIENT
    )
    assert process.stderr is not None
    said = [await process.stderr.readline()]
    assert b"done in" in said[0], (said[0] + await process.stderr.read()).decode()
    process.send_signal(signal.SIGINT)
    said.append(await process.stderr.read())
    assert await process.wait() == 128 + signal.SIGINT
    assert b"interrupted: " in said[1]
    assert {played.state for played in Store(tmp_path / "many").matches().values()} == {"done"}


@pytest.mark.parametrize(
    ("address", "complaint"),
    [("127.0.0.1:1", "there is no Ray cluster"), ("ray://127.0.0.1:10001", "give HOST:PORT, such as 10.0.0.5:6379")],
)
async def test_a_cluster_that_is_not_there_is_said(address: str, complaint: str) -> None:
    from khala_sc2.experiment.ray_engine import Ray

    with pytest.raises(ConfigError) as caught:
        async with Ray(1, game="simulator", address=address):
            pass
    assert complaint in str(caught.value)
