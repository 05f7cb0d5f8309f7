"""The package of verifiers: the standard's own checks, and a team with a model for each agent, by its own programs."""

from __future__ import annotations

import asyncio
import json
import os
from pathlib import Path
from typing import Any

import pytest

from khala_agents.scripted.endpoint import Endpoint

ROOT = Path(__file__).resolve().parents[2]
BIN = ROOT / ".venv-verifiers/bin"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(not (BIN.parent / ".ready").exists(), reason="`make standards` makes the environment"),
]


async def run(program: str, *arguments: str, out: Path) -> str:
    """Run a program of verifiers, and return what it printed."""
    surroundings = os.environ | {"HOME": str(out), "KHALA_ENGINE": "python"}
    process = await asyncio.create_subprocess_exec(
        BIN / program, *arguments, "-o", out, "--run.name", "run", cwd=out, env=surroundings,
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
    )  # fmt: skip
    said, _ = await process.communicate()
    assert process.returncode == 0, said.decode()
    return said.decode()


async def test_vf_validate_begins_each_game_and_finds_that_none_is_won_untouched(tmp_path: Path) -> None:
    options = ("-n", "2", "--taskset.max-steps", "2", "--runtime.type", "subprocess", "--rich", "False")
    await run("vf-validate", "khala-verifiers", *options, out=tmp_path)
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert (summary["total"], summary["valid_rate"]) == (2, 1.0)
    assert {check: counts["valid"] for check, counts in summary["checks"].items()} == {"gold": 2, "noop": 2}


async def test_vf_eval_plays_a_team_with_a_model_and_a_reward_for_each_agent(tmp_path: Path) -> None:
    async with Endpoint() as endpoint:
        await run(
            "vf-eval", "khala-verifiers", "-n", "1", "-m", "skilled", "--env.agent-2.model", "focus-fire",
            "--env.taskset.seed", "2", "--client.base-url", endpoint.base_url, "--client.api-key-var", "NO_KEY",
            "--push", "False", out=tmp_path,
        )  # fmt: skip
    (episode,) = map(json.loads, (tmp_path / "run/traces.jsonl").read_text().splitlines())
    assert (episode["ok"], episode["errors"]) == (True, [])
    traces = {trace["agent"]["name"]: trace for trace in episode["traces"]}
    assert [traces[name]["info"]["khala"]["agent"] for name in ("agent_1", "agent_2")] == ["Stalkers", "Zealots"]
    assert [{call["model"] for call in traces[name]["calls"]} for name in ("agent_1", "agent_2")] == [
        {"skilled"},
        {"focus-fire"},
    ]
    for trace in traces.values():
        told = trace["info"]["khala"]
        check_turns(trace, told["turns"])
        rewards = {name: reward["score"] * reward["weight"] for name, reward in trace["rewards"].items()}
        assert sum(rewards.values()) == pytest.approx(sum(turn["reward"] for turn in told["turns"]))
        assert rewards["objective"] == {"win": 1, "loss": -1}[told["outcome"]]
        assert rewards["kills"] > 0


def check_turns(trace: dict[str, Any], turns: list[dict[str, Any]]) -> None:
    """Check that each turn names the node with its reply, and that the last one has the result."""
    assert all(trace["nodes"][turn["node"]]["sampled"] for turn in turns)
    assert len({turn["node"] for turn in turns}) == len(turns) == len(trace["calls"])
    assert [turn["ending"] is None for turn in turns] == [True] * (len(turns) - 1) + [False]
