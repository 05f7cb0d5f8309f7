"""Matches in processes of their own: what comes back of a job, whatever becomes of its match or its process."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.errors import KhalaError
from khala_protocol.messages import Report
from khala_protocol.recording import Recording
from khala_sc2.playing import worker
from khala_sc2.playing.jobs import Ended, Job, MatchWorker
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from khala_protocol.messages import Wire

pytestmark = [pytest.mark.game, pytest.mark.posix]

LOUD = """
from pathlib import Path

def decide(briefing, observation):
    print('{"state": "done", "words": "said by a policy"}', flush=True)
    Path(__file__).with_name("asked").write_text("!")
    return ""
"""
"""A policy that prints what its process might answer, and says that it was asked."""


def job(directory: Path, *, max_steps: int = 3, policy: str = "silent", timeout_s: float | None = None) -> Job:
    directory.mkdir(exist_ok=True)
    config = MatchConfig(
        task=change(load_task("2s3z_pair"), max_steps=max_steps), run="first", record=directory / "recording.mcap"
    )
    return Job(config=config, minds={"blue": Minds(policy=policy)}, timeout_s=timeout_s)


@pytest.fixture
async def asked(tmp_path: Path) -> AsyncIterator[asyncio.Event]:
    """Yield an event that is set when the loud policy is asked."""
    asked = asyncio.Event()

    def hear() -> None:
        os.read(pipe, 4096)
        asked.set()

    os.mkfifo(tmp_path / "asked")
    pipe = os.open(tmp_path / "asked", os.O_RDWR)
    asyncio.get_running_loop().add_reader(pipe, hear)
    yield asked
    asyncio.get_running_loop().remove_reader(pipe)
    os.close(pipe)


@pytest.fixture
async def process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[MatchWorker]:
    """Yield a process that can import the loud policy."""
    (tmp_path / "loud.py").write_text(LOUD)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("KHALA_TRUST", "loud")
    process = await MatchWorker.start(log=tmp_path / "log")
    yield process
    await process.close()
    assert not process.running


async def begin(process: MatchWorker, directory: Path, asked: asyncio.Event) -> asyncio.Task[Ended]:
    """Begin a match that does not end by itself; return when its agents are asked."""
    playing = asyncio.create_task(process.play(job(directory, max_steps=100_000, policy="loud:decide")))
    await asyncio.wait({playing, asyncio.create_task(asked.wait())}, return_when=asyncio.FIRST_COMPLETED)
    assert not playing.done(), playing.result()
    return playing


async def test_a_process_plays_one_match_after_another_and_answers_for_itself_alone(
    process: MatchWorker, asked: asyncio.Event, tmp_path: Path
) -> None:
    for name in ("first", "second"):
        ended = await process.play(job(tmp_path / name, policy="loud:decide"))
        assert (ended.state, "said by a policy" in ended.words) == ("done", False)
        assert [result.steps for result in Recording.open(tmp_path / name / "recording.mcap").results] == [3]
    assert asked.is_set()


@pytest.mark.slow
async def test_a_process_that_is_told_to_end_closes_its_match_and_says_so(
    process: MatchWorker, asked: asyncio.Event, tmp_path: Path
) -> None:
    playing = await begin(process, tmp_path / "first", asked)
    process.stop()
    assert await playing == Ended(state="stopped", words="its process was told to end")
    assert Recording.open(tmp_path / "first" / "recording.mcap").complete


@pytest.mark.posix
@pytest.mark.slow
async def test_a_process_that_is_killed_has_lost_its_match(
    process: MatchWorker, asked: asyncio.Event, tmp_path: Path
) -> None:
    playing = await begin(process, tmp_path / "first", asked)
    os.kill(process.pid, signal.SIGKILL)
    words = f"its process ended with SIGKILL; {tmp_path / 'log'} has its last words"
    assert await playing == Ended(state="lost", words=words)
    assert (await process.play(job(tmp_path / "second"))).state == "lost"


async def test_a_process_that_does_not_get_ready_answers_its_job_nevertheless(tmp_path: Path) -> None:
    process = await MatchWorker.start("--live", "--game", str(tmp_path / "no game"))
    ended = await process.play(job(tmp_path))
    await process.close()
    assert (ended.state, "no game" in ended.words) == ("error", True)


async def test_what_cannot_be_played_is_said(tmp_path: Path) -> None:
    ended = await worker.play(job(tmp_path), game=str(tmp_path / "no game"))
    assert (ended.state, "no game" in ended.words) == ("error", True)


async def test_a_match_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    ended = await worker.play(job(tmp_path, max_steps=100_000, timeout_s=0.36), game="simulator")
    assert ended == Ended(state="timeout", words="it took longer than 0.0001 hours")


@pytest.mark.slow
async def test_a_match_goes_on_from_the_newest_recording_of_its_directory(tmp_path: Path) -> None:
    def lose(message: Wire) -> None:
        if isinstance(message, Report) and message.step == 4:
            raise KhalaError("the host is lost")

    first = job(tmp_path, max_steps=8)
    assert (await worker.play(first, game="simulator", watch=lose)).words == "the host is lost"
    record = tmp_path / "recording-2.mcap"
    again = first.but(config=first.config.model_copy(update={"record": record}), beginning=tmp_path)
    assert (await worker.play(again, game="simulator")).state == "done"
    incidents = [report.incidents for report in Recording.open(record).of(Report)]
    assert [step for step, found in enumerate(incidents) if found] == [5]
    assert len(incidents) == 8
