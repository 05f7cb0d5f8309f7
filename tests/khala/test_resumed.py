"""`--resume`: which recording, which task, and where the rest is recorded."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.game.game import GameIdentity
from khala_orchestrator.match.cards import run_card
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Report
from khala_protocol.recording import Recorder
from khala_sc2.playing.matches import new, new_or_resumed

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

RUN = "lost"
GIVEN: dict[str, Any] = {"seed": None, "episodes": None, "assemble_s": 7.0}


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes what a host left behind that was killed after some steps; without a run card it had not begun."""
    match = new("2s3z_pair", RUN, tmp_path, seed=5, episodes=2, assemble_s=60.0, rule="budget", max_steps=9)
    match = match.model_copy(update={"game": "Khala simulator 0.1.0, as"})
    card = run_card(match, GameIdentity("4.10.0.75689", "B89B", "2s3z.SC2Map", "0" * 64))

    def one(name: str, *, steps: int | None, age_s: int) -> Path:
        path = tmp_path / RUN / name
        path.parent.mkdir(exist_ok=True)
        with Recorder(path) as recorder:
            if steps is not None:
                recorder.write(run_key(RUN, Topic.RUN), encode(card))
            for step in range(steps or 0):
                report = Report(run=RUN, episode=0, step=step, game_loop=8 * step, agents=())
                recorder.write(run_key(RUN, Topic.REPORT), encode(report))
        os.utime(path, (10_000 - age_s, 10_000 - age_s))
        return path

    return one


def test_the_match_is_the_recorded_one(tmp_path: Path, write: Callable[..., Path]) -> None:
    path = write("recording.mcap", steps=3, age_s=0)
    config, past = new_or_resumed(None, path, RUN, tmp_path, **GIVEN, rule="budget", max_steps=9)
    assert past is not None
    assert (past.episode, past.steps) == (0, 3)
    assert (config.run, config.seed, config.episodes, config.assemble_s) == (RUN, 5, 2, 7.0)
    assert (config.task.name, config.task.clock.rule, config.task.max_steps) == ("2s3z_pair", "budget", 9)
    assert config.record == path.with_name("recording-2.mcap")


@pytest.mark.parametrize(
    ("left", "steps"),
    [
        ({"recording.mcap": (2, 9), "recording-2.mcap": (4, 5)}, 4),
        ({"recording.lost-1.mcap": (2, 9), "recording.mcap": (3, 5)}, 3),
        ({"recording.mcap": (2, 9), "recording-2.mcap": (None, 5)}, 2),
    ],
    ids=["the newest", "no lost one", "one that has begun"],
)
def test_of_the_recordings_of_a_run_the_newest_that_has_begun_is_gone_on_with(
    tmp_path: Path, write: Callable[..., Path], left: dict[str, tuple[int | None, int]], steps: int
) -> None:
    for name, (number, age_s) in left.items():
        write(name, steps=number, age_s=age_s)
    config, past = new_or_resumed(None, tmp_path / RUN, None, tmp_path, **GIVEN)
    assert past is not None
    assert past.steps == steps
    assert config.record is not None
    assert config.record.name not in left


def test_a_run_that_never_began_cannot_be_gone_on_with(tmp_path: Path, write: Callable[..., Path]) -> None:
    write("recording.mcap", steps=None, age_s=0)
    with pytest.raises(RecordingError, match="has no run card: the run ended before the match began"):
        new_or_resumed(None, tmp_path / RUN, None, tmp_path, **GIVEN)


def test_a_directory_without_a_recording_says_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"there is no recording in .*: give the directory of a run, or a"):
        new_or_resumed(None, tmp_path, None, tmp_path, **GIVEN)


def test_a_task_or_a_recording_is_given(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"give a task, such as .*, or a recording with --resume"):
        new_or_resumed(None, None, None, tmp_path, **GIVEN)
