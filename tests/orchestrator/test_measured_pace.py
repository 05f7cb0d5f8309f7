"""The pace of a model, from its calls."""

from __future__ import annotations

import json
import random
from typing import TYPE_CHECKING

import numpy as np
import pytest
from typer.testing import CliRunner

from khala_orchestrator.past.measured_pace import least_squares, measured_paces, yaml
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key
from khala_protocol.messages import ModelCall, Pace, Usage
from khala_protocol.recording import Recorder
from khala_sc2.cli import app

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

TRUE = Pace(latency_s=0.4, read_tokens_per_s=4000, write_tokens_per_s=60)


def calls(
    pace: Pace, number: int, *, noise_s: float = 0.0, model: str = "m", status: str = "ok"
) -> Iterator[ModelCall]:
    rng = random.Random(7)
    for step in range(number):
        usage = Usage(requests=1, prompt_tokens=rng.randint(500, 9000), completion_tokens=rng.randint(20, 600))
        latency_s = pace.seconds(usage) + rng.uniform(-noise_s, noise_s)
        yield ModelCall(
            run="r", agent="A", side="blue", episode=0, step=step, attempt=1, model=model, endpoint="http://e/v1",
            prompt=(), completion="", status=status, started_s=0, latency_s=latency_s, usage=usage,
        )  # fmt: skip


def test_the_pace_that_made_the_calls_is_found() -> None:
    (found,) = measured_paces(calls(TRUE, 20))
    assert found.pace == TRUE
    assert found.calls == 20
    assert found.error_s == pytest.approx(0, abs=1e-9)


def test_noise_moves_it_little_and_is_told() -> None:
    (found,) = measured_paces(calls(TRUE, 400, noise_s=0.2))
    assert found.pace.latency_s == pytest.approx(0.4, abs=0.05)
    assert found.pace.write_tokens_per_s == pytest.approx(60, rel=0.05)
    assert found.error_s == pytest.approx(0.1, abs=0.02)


def test_a_model_whose_tokens_cost_nothing_has_no_negative_pace() -> None:
    (found,) = measured_paces(
        calls(Pace(latency_s=0.2, read_tokens_per_s=1e9, write_tokens_per_s=1e9), 50, noise_s=0.01)
    )
    assert found.pace.latency_s == pytest.approx(0.2, abs=0.01)
    assert min(found.pace.read_tokens_per_s, found.pace.write_tokens_per_s) > 10_000


def test_the_best_numbers_that_are_not_negative_leave_no_better_direction() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        columns, wanted = rng.random((30, 3)), rng.normal(size=30)
        found = least_squares(columns, wanted)
        slope = columns.T @ (columns @ found - wanted)  # Karush-Kuhn-Tucker: 0 where free, not downhill where at 0
        assert np.all(found >= 0)
        assert np.allclose(slope[found > 0], 0, atol=1e-9)
        assert np.all(slope[found == 0] >= -1e-9)


def test_each_model_has_its_own_and_failed_calls_do_not_count() -> None:
    slow = Pace(latency_s=1, read_tokens_per_s=1000, write_tokens_per_s=20)
    mixed = [*calls(TRUE, 9), *calls(slow, 9, model="slow"), *calls(slow, 9, status="timeout")]
    assert {found.model: found.pace for found in measured_paces(mixed)} == {"m": TRUE, "slow": slow}


def test_the_command_prints_the_lines_of_the_model_file(tmp_path: Path) -> None:
    with Recorder(tmp_path / "r.mcap") as recorder:
        for call in calls(TRUE, 5):
            recorder.write(agent_key("r", "blue", "A", Topic.EXCHANGE), encode(call))
    printed = CliRunner().invoke(app, ["replay", str(tmp_path / "r.mcap"), "--pace"])
    (found,) = measured_paces(calls(TRUE, 5))
    assert printed.stdout == yaml(found)
    assert printed.stdout.endswith("pace:\n  latency_s: 0.4\n  read_tokens_per_s: 4000\n  write_tokens_per_s: 60\n")
    as_json = CliRunner().invoke(app, ["replay", str(tmp_path / "r.mcap"), "--pace", "--json"])
    assert json.loads(as_json.stdout)["paces"][0]["pace"] == TRUE.model_dump()
