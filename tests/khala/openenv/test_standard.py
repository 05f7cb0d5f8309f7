"""What OpenEnv's own tools check holds for a server that runs: each test has the name of its check."""

from __future__ import annotations

import asyncio
import json
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from openenv.cli._validation import validate_running_environment
from openenv.core.env_server.mcp_types import CallToolAction, CallToolObservation
from openenv.core.mcp_client import MCPToolClient
from openenv.validation.graders import Subject
from openenv.validation.graders.runtime import ObservationSchemaGrader, RewardWellFormedGrader, StateContractGrader
from openenv.validation.parsers.openenv_yaml import OpenEnvYamlParser
from openenv.validation.runtime.collector import collect_runtime_evidence
from openenv.validation.runtime.contracts import load_runtime_plan

from khala_sc2.openenv.client import KhalaAction, KhalaEnv
from khala_sc2.openenv.tools import TOOLS

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable
    from contextlib import AbstractAsyncContextManager

    Serving = Callable[..., AbstractAsyncContextManager[str]]

HERE = Path(__file__).resolve().parents[3] / "envs" / "khala_env"
SHORT: dict[str, Any] = {"task": "2s3z", "seed": 1, "max_steps": 2}
CRITERIA = [
    "openapi_version_available", "health_endpoint", "metadata_endpoint", "schema_endpoint", "mcp_endpoint",
    "mode_endpoint_consistency",
]  # fmt: skip


async def test_openenv_validate_url(serving: Serving) -> None:
    async with serving() as address:
        report = await asyncio.to_thread(validate_running_environment, address, 60.0)
    assert [criterion["id"] for criterion in report["criteria"] if criterion["passed"]] == CRITERIA
    assert (report["passed"], report["mode"]) == (True, "simulation")


@pytest.mark.game
@pytest.mark.filterwarnings("default::DeprecationWarning")  # of the collector, for names of websockets
async def test_runtime_graders(serving: Serving, tmp_path: Path) -> None:
    manifest: Any = OpenEnvYamlParser().parse(HERE)
    plan = load_runtime_plan(HERE, manifest.execution)
    async with serving() as address:
        evidence = await asyncio.to_thread(collect_runtime_evidence, address, plan, episode_timeout_s=300.0)
    assert evidence.failure_reason is None
    assert len(evidence.exchanges) == 2 * (1 + len(plan.actions)), "each action was taken, and its state was read"
    subject = Subject(HERE, manifest, image_ref=None, running=None, outputs_dir=tmp_path, runtime_evidence=evidence)
    graders: list[Any] = [RewardWellFormedGrader(), ObservationSchemaGrader(), StateContractGrader()]
    for grader in graders:
        found = grader.run(subject)
        assert (found.status.value, found.evidence) == ("pass", ["observed runtime contract holds"]), found.check_id


@asynccontextmanager
async def tool_client(address: str) -> AsyncIterator[MCPToolClient]:
    client = MCPToolClient(address, message_timeout_s=120)
    await client.connect()
    try:
        yield client
    finally:
        await client.close()


@pytest.mark.game
async def test_mcp_tool_client(serving: Serving) -> None:
    async with serving() as address, tool_client(address) as client:
        tools = {tool.name: tool for tool in await client.list_tools()}
        assert list(tools) == list(TOOLS)
        assert tools["act"].input_schema["properties"]["orders"]["additionalProperties"]["items"] == {"type": "string"}
        began = await client.reset(**SHORT)
        assert isinstance(began.observation, CallToolObservation)
        assert "# Who you are" in began.observation.result
        assert (await client.call_tool("look_up", what="Stalker")).startswith("Stalker")
        seen = await client.call_tool("act", orders={"Zealot-1": ["<Nonsense()>"]})
        assert "There is no action Nonsense" in seen
        last = await client.step(CallToolAction(tool_name="act", arguments={}))
        assert last.done
        assert isinstance(last.reward, float)
        assert isinstance(last.observation, CallToolObservation)
        assert last.observation.result.startswith("The episode is over: cut, step limit")


@pytest.mark.game
async def test_a_client_of_mcp_alone_begins_by_observing(serving: Serving) -> None:
    async with serving(sessions=1) as address, httpx.AsyncClient(base_url=address, timeout=120) as client:

        async def ask(method: str, **params: Any) -> Any:
            request = {"jsonrpc": "2.0", "id": 1, "method": method, "params": params}
            return (await client.post("/mcp", json=request)).json()

        session = (await ask("openenv/session/create"))["result"]["session_id"]
        early = await ask("tools/call", name="act", arguments={}, session_id=session)
        assert early["error"]["message"] == "no episode has begun: call reset first, or the tool observe"
        seen = await ask("tools/call", name="observe", session_id=session)
        assert "# Who you are" in seen["result"]["content"][0]["text"]
        wrong = (await ask("tools/call", name="act", arguments={"orders": []}, session_id=session))["result"]
        assert (wrong["isError"], wrong["structuredContent"]["reward"]) == (True, 0.0)
        assert wrong["content"][0]["text"].startswith("act: orders: Input should be a valid dictionary")
        first = await ask("tools/call", name="act", arguments={"agent": "Stalkers"}, session_id=session)
        assert first["result"]["data"] == "Noted. The game goes on when these have acted, too: Zealots."
        both = await ask("tools/call", name="act", arguments={"agent": "Zealots"}, session_id=session)
        assert both["result"]["data"].startswith("# Stalkers\n\n")
        assert (await ask("openenv/session/close", session_id=session))["result"]["closed"]


@pytest.mark.game
async def test_a_call_that_is_wrong_moves_nothing(serving: Serving) -> None:
    async with serving() as address, KhalaEnv(address) as env:
        before = (await env.reset(**SHORT)).observation
        for tool, arguments, sentence in (
            ("fly", {}, "there is no tool 'fly': there are observe, act, reply, look_up"),
            ("look_up", {"what": "Zealout"}, "nothing in version 4.10 of the game is called 'Zealout'"),
            ("act", {"agent": "Me"}, "this session does not play 'Me': it plays CombatGroupSmac"),
        ):
            with pytest.raises(RuntimeError, match=sentence):
                await env.step(CallToolAction(tool_name=tool, arguments=arguments))
        again = (await env.step(CallToolAction(tool_name="observe"))).observation
        assert again.text == before.text
        after = (await env.step(KhalaAction(reply=""))).observation
        assert after.step == before.step + 1
        assert json.loads((await env.state()).model_dump_json())["step_count"] == 5
