"""inspect_ai evaluates models on tasks of the catalogue: its own eval with its mock model, the tasks and the scores.

Tests import inspect_ai themselves, since that takes a second and a half of every process that looks for tests.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.config import all_tasks
from khala_protocol.messages import ChatMessage, ImageRef, Reply, Result, Usage
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from inspect_ai.log import EvalLog
    from inspect_ai.scorer import Score, Scorer

game = pytest.mark.game
USED = {"input_tokens": 100, "output_tokens": 10, "total_tokens": 110, "input_tokens_cache_read": 60}
SCRIPT = Path(__file__).with_name("mock_eval.py")


def evaluated(name: str, tmp_path: Path, *, answers: str = "skilled", **given: object) -> EvalLog:
    """Return the log of an evaluation with the mock model.

    It has a process of its own: inspect_ai changes logging, and warns of what it uses itself.
    """
    from inspect_ai.log import read_eval_log

    arguments = [name, answers, json.dumps(USED), json.dumps(given)]
    subprocess.run([sys.executable, str(SCRIPT), *arguments], cwd=tmp_path, check=True, timeout=100)
    (path,) = (tmp_path / "logs").glob("*.eval")
    return read_eval_log(str(path))


@pytest.mark.slow
@game
def test_a_model_plays_all_agents_of_a_side_and_is_scored(tmp_path: Path) -> None:
    from inspect_ai.event import InfoEvent, ModelEvent
    from inspect_ai.model import ChatMessageUser, ContentImage

    log = evaluated("2s3z_pair", tmp_path, seeds=1, max_steps=2, images="screen")
    assert log.results is not None, log.error
    metrics = {score.name: list(score.metrics) for score in log.results.scores}
    assert metrics == {"win": ["accuracy", "stderr"], "value": ["kd"], "legality": ["legal"]}
    (sample,) = log.samples or []
    result = Result.model_validate(sample.store["khala_result"])
    assert result.statuses == {"Stalkers": {"ok": 2}, "Zealots": {"ok": 2}}
    assert result.usage["Zealots"] == Usage(
        requests=2, prompt_tokens=200, completion_tokens=20, cached_tokens=120, images=4
    )
    assert len(list(Recording.open(tmp_path / sample.store["khala_recording"]).of(Reply))) == 4
    asked = [event for event in sample.events if isinstance(event, ModelEvent)]
    assert len(asked) == 4
    assert [message.role for message in asked[0].input] == ["system", "user", "assistant", "user"]
    seen = [message for message in sample.messages if isinstance(message, ChatMessageUser)][1:]
    assert sum("# Stalkers, step 0\n" in message.text for message in seen) == 1
    assert [any(isinstance(part, ContentImage) for part in message.content) for message in seen] == [True] * 4
    notes = [event.data for event in sample.events if isinstance(event, InfoEvent) and event.source == "khala"]
    assert [note["step"] for note in notes if isinstance(note, dict)] == [0, 1]


@pytest.mark.slow
@game
def test_the_other_side_of_a_duel_is_played_by_somebody_else(tmp_path: Path) -> None:
    samples = evaluated("duel_3m", tmp_path, seeds=2, images="none").samples or []
    assert [sample.id for sample in samples] == ["seed 1", "seed 2"]
    for sample in samples:
        result = Result.model_validate(sample.store["khala_result"])
        assert (result.side, set(result.statuses)) == ("blue", {"Captain"})


@pytest.mark.slow
@game
def test_an_error_of_the_model_ends_the_sample(tmp_path: Path) -> None:
    log = evaluated("2s3z", tmp_path, answers="fails", seeds=1)
    assert log.status == "error"
    assert log.error is not None
    assert "the endpoint is away" in log.error.message


@pytest.mark.slow
def test_every_task_of_the_catalogue_is_one_of_inspect() -> None:
    from khala_sc2.inspect.tasks import TASKS

    assert list(TASKS) == [config.name for config in all_tasks()]
    made = TASKS["pvz_task6_level1"](seeds=2, images="none")
    assert (made.name, [sample.id for sample in made.dataset]) == ("khala_sc2/pvz_task6_level1", ["seed 1", "seed 2"])
    assert made.dataset[1].metadata == {
        "khala_match": {
            "task": "pvz_task6_level1", "seed": 2, "images": "none", "max_steps": None, "rule": None, "executor": None,
        }
    }  # fmt: skip


def result_with(**changes: Any) -> Result:
    least: dict[str, Any] = {
        "run": "r", "episode": 0, "outcome": "win", "cause": "enemy defeated", "steps": 1, "game_loop": 1, "game_s": 1,
        "wall_s": 1, "killed": {"value": 500}, "lost": {"value": 200}, "kd": 2.5, "accepted": 6,
        "rejections": {"not_available": 1, "dead_target": 1},
    }  # fmt: skip
    return Result.model_validate(least | changes)


async def score_of(scorer: Scorer, result: Result | None) -> Score:
    """Return what a scorer says of a result; None if the episode did not come to one."""
    from inspect_ai.model import ModelName
    from inspect_ai.scorer import Target
    from inspect_ai.solver import TaskState

    state = TaskState(ModelName("mockllm/model"), 1, 1, "", [])
    if result is not None:
        state.store.set("khala_result", result.model_dump(mode="json"))
    score = await scorer(state, Target("win"))
    assert score is not None
    return score


async def test_scores_are_those_of_the_result() -> None:
    from khala_sc2.inspect.scores import legality, value, win

    assert (await score_of(win(), result_with())).value == "C"
    assert (await score_of(win(), result_with(outcome="draw"))).value == "I"
    assert (await score_of(value(), result_with())).value == {"killed": 500, "lost": 200}
    legal_score = await score_of(legality(), result_with())
    assert legal_score.value == {"accepted": 6, "refused": 2}
    assert legal_score.explanation == "not_available: 1, dead_target: 1"


async def test_an_episode_that_says_nothing_of_its_agents_is_not_scored() -> None:
    from khala_sc2.inspect.scores import win

    failed = await score_of(win(), result_with(valid=False, invalid_because="an agent was away"))
    assert math.isnan(failed.as_float())
    assert failed.reason == "an agent was away"
    assert (await score_of(win(), None)).reason == "a limit ended the episode before its result"


def over(metric: object, *values: dict[str, float]) -> float:
    """Return what a metric says of samples with these values."""
    from inspect_ai.scorer import SampleScore, Score

    assert callable(metric)
    return float(metric([SampleScore(score=Score(value=dict(one))) for one in values]))


def test_ratios_are_of_sums_over_all_samples() -> None:
    from khala_sc2.inspect.scores import kd, legal

    assert over(kd(), {"killed": 500, "lost": 200}, {"killed": 100, "lost": 0}) == 3.0
    assert over(kd(), {"killed": 1, "lost": 0}) == math.inf
    assert math.isnan(over(kd(), {"killed": 0, "lost": 0}))
    assert over(legal(), {"accepted": 6, "refused": 2}, {"accepted": 2, "refused": 0}) == 0.8


def test_a_message_has_its_pictures_before_its_text() -> None:
    from inspect_ai.model import ContentImage, ContentText

    from khala_sc2.inspect.model import message_of

    ref = ImageRef(name="s", media_type="image/png", sha256="x", title="Screen", width=1, height=1, bytes=3)
    shown = message_of(ChatMessage(role="user", content="Game", images=(ref,)), {"x": b"png"})
    assert shown.content == [
        ContentText(text="Screen"), ContentImage(image="data:image/png;base64,cG5n"), ContentText(text="Game")
    ]  # fmt: skip
    assert message_of(ChatMessage(role="assistant", content="go"), {}).role == "assistant"


def test_a_model_that_says_nothing_of_its_usage_has_unknown_usage() -> None:
    from inspect_ai.model import ModelUsage

    from khala_sc2.inspect.model import usage_of

    known = Usage(requests=1, prompt_tokens=100, completion_tokens=10, cached_tokens=60)
    assert usage_of(None) == Usage(requests=1, unknown_requests=1)
    assert usage_of(ModelUsage.model_validate(USED)) == known
