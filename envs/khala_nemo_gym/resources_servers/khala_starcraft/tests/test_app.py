"""The server as `gymnasium_agent` and an environment server use it; `gym env test` runs it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import MagicMock

import pytest
from fastapi.testclient import TestClient
from nemo_gym.base_resources_server import BaseResourcesServerConfig, ResourcesSeedSessionRequest
from nemo_gym.episode_types import EpisodeId, TaskId
from nemo_gym.server_utils import ServerClient
from nemo_gym.testing.session_conformance import check_resources_session_contract
from resources_servers.khala_starcraft.app import KhalaStarCraftServer
from resources_servers.khala_starcraft.task_data import TaskData

if TYPE_CHECKING:
    from fastapi import FastAPI

ROWS = [json.loads(line) for line in (Path(__file__).parents[1] / "data/example.jsonl").read_text().splitlines()]
PARAMS: dict[str, Any] = {"responses_create_params": {"input": []}}


@pytest.fixture
def app() -> FastAPI:
    config = BaseResourcesServerConfig(host="", port=0, entrypoint="", name="khala_starcraft")
    return KhalaStarCraftServer(config=config, server_client=MagicMock(spec=ServerClient)).setup_webserver()


def said(text: str) -> dict[str, Any]:
    content = [{"annotations": [], "text": text, "type": "output_text"}]
    message = {"id": "m", "content": content, "role": "assistant", "status": "completed", "type": "message"}
    same = {"id": "r", "created_at": 0.0, "model": "m", "object": "response", "parallel_tool_calls": True}
    return PARAMS | {"response": same | {"output": [message], "tool_choice": "auto", "tools": []}}


def test_an_agent_plays_an_episode_to_its_end_and_is_rewarded(app: FastAPI) -> None:
    client = TestClient(app)
    begun = client.post("/reset", json=PARAMS | {"battle": "2s3z_pair", "agent": "Stalkers", "seed": 2, "max_steps": 2})
    assert begun.status_code == 200, begun.text
    assert "Stalkers" in begun.json()["observation"]
    first = client.post("/step", json=said("Actions:\nTeam Stalkers-1:\n<Nonsense()>\n")).json()
    assert (first["terminated"], first["truncated"]) == (False, False)
    assert first["observation"]
    last = client.post("/step", json=said("")).json()
    assert (last["terminated"], last["truncated"], last["observation"]) == (False, True, None)
    turns = last["info"]["turns"]
    assert [turn["refused"] for turn in turns] == [1, 0]
    assert first["reward"] + last["reward"] == pytest.approx(sum(turn["reward"] for turn in turns))
    assert turns[0]["reward"] == pytest.approx(-0.1)
    assert client.post("/step", json=said("")).status_code == 400


@pytest.mark.parametrize(
    "row", [{"battle": "../secret.yaml"}, {"others": "my_module:decide"}, {"agent": "Nobody"}, {"seed": -1}]
)
def test_a_row_names_no_file_no_code_and_nobody_else(app: FastAPI, row: dict[str, Any]) -> None:
    assert TestClient(app).post("/reset", json=PARAMS | row).status_code == 422


def test_sessions_keep_the_contract_of_environment_servers(app: FastAPI) -> None:
    seed = ResourcesSeedSessionRequest(
        resources_session_id="one",
        episode_id=EpisodeId(rollout_id="episode"),
        task_id=TaskId(taskset="khala", task_id="2s3z-1"),
        task_data={"battle": "2s3z", "seed": 1},
    )
    check_resources_session_contract(app, seed, keeps_state=True)


def test_examples_are_rows_of_the_schema() -> None:
    assert [TaskData.model_validate(row).seed for row in ROWS] == [1, 2, 3, 4, 5]
