"""Matches are played for real: in one process, in workers that are killed, from the command line."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sqlite3
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from bench.survival import experiments
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.recording import Recording
from khala_sc2.cli import app
from khala_sc2.commands.exit_codes import NOT_VALID
from khala_sc2.experiment.engine import Local
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.spec import Experiment
from khala_sc2.experiment.store import Store
from khala_sc2.playing import local, one_process, worker
from khala_sc2.playing.jobs import Job

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.game


def job(directory: Path, *, task: str = "2s3z_pair", **fields: Any) -> Job:
    found = Experiment.model_validate(
        {"name": "e", "fixed": {"max_steps": 3, "model": "skilled"}, "factors": {"task": [task]}}
    )
    (match,) = plan(found)
    config = match.config.model_copy(update={"record": directory / "recording.mcap"})
    return Job(config=config, minds=match.minds, timeout_s=120, **fields)


async def test_a_match_is_played_and_recorded_in_one_process(tmp_path: Path) -> None:
    ended = await worker.play(job(tmp_path), game="simulator")
    assert (ended.state, ended.words) == ("done", "")
    recording = Recording.open(tmp_path / "recording.mcap")
    assert [(result.steps, set(result.statuses)) for result in recording.results] == [(3, {"Stalkers", "Zealots"})]
    assert recording.run is not None
    assert recording.run.labels["factor.task"] == "2s3z_pair"
    assert recording.run.hardware["cores"]
    assert len(recording.run.code_sha256) == 64


@pytest.mark.posix
async def test_a_worker_that_dies_loses_its_match_and_the_next_one_is_played(tmp_path: Path) -> None:
    async with Local(1, game="simulator", logs=tmp_path / "logs") as engine:
        engine._idle.append(process := await engine._start())
        playing = asyncio.create_task(engine.play(job(tmp_path / "first")))
        os.kill(process.pid, signal.SIGKILL)
        ended = await playing
        assert (ended.state, ended.words.partition(";")[0]) == ("lost", "its process ended with SIGKILL")
        (tmp_path / "second").mkdir()
        assert (await engine.play(job(tmp_path / "second"))).state == "done"


@pytest.mark.slow
async def test_a_match_in_one_process_is_the_match_of_many_processes(tmp_path: Path) -> None:
    task = change(load_task("2s3z_pair"), max_steps=12)
    minds = job(tmp_path).minds
    config = MatchConfig(task=task, run="same", record=tmp_path / "same.mcap")
    (one,) = await one_process.play(config, minds, game="simulator")
    (many,) = await local.play(config.model_copy(update={"record": None}), minds, tmp_path, game="simulator")
    times = {"wall_s": 0, "latency_p50_s": 0, "latency_p95_s": 0, "lag_s": 0}
    assert one.but(**times) == many.but(**times)


@pytest.mark.slow
def test_an_experiment_from_the_command_line(tmp_path: Path) -> None:
    file = experiments.write(tmp_path, seeds=1, steps=3)
    told = CliRunner().invoke(app, ["experiment", "run", str(file), "--out", str(tmp_path), "--jobs", "2", "--json"])
    assert told.exit_code == 0, told.output
    line = next(line for line in told.output.splitlines() if line.startswith("{"))
    assert json.loads(line)["matches"] == {"done": 4}
    with contextlib.closing(sqlite3.connect(tmp_path / "attacked" / "index.sqlite")) as index:
        assert index.execute("select count(*) from results").fetchone() == (4,)
    again = CliRunner().invoke(app, ["experiment", "resume", "attacked", "--out", str(tmp_path)])
    assert "4 of 4 matches were played before" in again.output


@pytest.mark.timeout(120)
def test_a_model_that_its_endpoint_does_not_have_ends_the_run_in_the_first_step_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "nobody.yaml"
    file.write_text("{name: nobody, factors: {task: [2s3z], model: [scripted/nobody]}, seeds: 3}")
    run = ["experiment", "run", str(file), "--out", str(tmp_path), "--jobs", "1", "--pilot", "1"]
    told = CliRunner().invoke(app, run)
    assert told.exit_code == NOT_VALID
    assert "not all were played: the endpoint of blue/CombatGroupSmac will not answer it" in told.output
    assert "http 404: there is no model 'nobody'" in told.output
    (row,) = Store(tmp_path / "nobody").results()
    assert row["steps"] <= 1
    status = CliRunner().invoke(app, ["experiment", "status", "nobody", "--out", str(tmp_path)])
    assert "2s3z, scripted/nobody: the endpoint of blue/CombatGroupSmac will not answer it" in status.stdout


@pytest.mark.timeout(120)
def test_a_pilot_estimates_the_rest_and_plays_it_only_for_somebody_who_says_yes(tmp_path: Path) -> None:
    file = experiments.write(tmp_path, seeds=2, steps=2)
    run = ["experiment", "run", str(file), "--out", str(tmp_path), "--jobs", "1", "--pilot", "1"]
    told = CliRunner().invoke(app, run)
    assert "after the pilot: 4 of 8 matches are left, about" in told.output
    assert "nobody was there to say yes after the pilot: --yes plays the rest" in told.output
    assert len(Store(tmp_path / "attacked").matches()) == 4


@pytest.mark.slow
def test_a_runner_that_is_killed_again_and_again_ends_with_the_same_table() -> None:
    killed = asyncio.run(experiments.kills(2, seed=5, seeds=6, steps=4, after_s=(2, 4)))
    assert killed.is_good, killed
    assert killed.kills > 0


@pytest.mark.slow
def test_an_experiment_never_costs_more_than_its_cap() -> None:
    charged = asyncio.run(experiments.money(0.2, seeds=4, steps=4))
    assert charged.is_good, charged
    assert charged.refused > 0


def test_a_wrong_name_of_an_experiment_says_which_there_are(tmp_path: Path) -> None:
    told = CliRunner().invoke(app, ["experiment", "status", "nothing", "--out", str(tmp_path)])
    assert told.exception is not None
    assert "there is no experiment in" in str(told.exception)
    assert not Store(tmp_path / "nothing").matches()
