"""`khala agent` and `khala llm` as a person or a launcher meets them."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
import urllib.request
from typing import TYPE_CHECKING, Any

import pytest
import typer
from typer.testing import CliRunner

from khala_agents import cli
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import decode_as, encode
from khala_protocol.errors import KhalaError
from khala_protocol.keys import Topic, agent_key, every_agent
from khala_protocol.messages import Reply

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable
    from pathlib import Path

    from khala_protocol.messages import Briefing, Observation

app = typer.Typer(pretty_exceptions_enable=False)
app.command(epilog=cli.AGENT_EPILOG)(cli.agent)
app.command(epilog=cli.LLM_EPILOG)(cli.llm)


BAD_OPTIONS = [
    (
        ["agent", "--run", "r"],
        "say which agents to play, or give a file with --agents: khala agent NAME… --run RUN",
    ),
    (
        ["agent", "A", "--run", "r", "--model", "openai", "--policy", "silent"],
        "an agent decides with a model or with a policy: give --model or --policy, not both",
    ),
    (
        ["agent", "A", "--run", "r", "--agents", "a.yaml"],
        "--agents: a file of agents says all: leave out NAMES, --model, --policy, --fallback and --rethink",
    ),
    (["agent", "--agents", "nowhere.yaml", "--run", "r"], "nowhere.yaml: there is no such file"),
    (
        ["agent", "A", "--run", "a run"],
        (
            "run 'a run' cannot stand in a key: use 1 to 64 letters, digits, '_', '.' or '-', beginning with a letter "
            "or a digit"
        ),
    ),
    (
        ["agent", "A", "--run", "r", "--connect", "localhost:7447"],
        (
            "'localhost:7447' is not an endpoint: write <transport>/<address>, such as tcp/127.0.0.1:7447; transports "
            "are quic, tcp, tls, unixsock-stream, ws"
        ),
    ),
    (
        ["llm", "--fault", "fire=1"],
        (
            "--fault: 'fire' is not a fault: use an HTTP status from 400 to 599 or one of quota, garbage, nonsense, "
            "half, reset, drip, stall, such as --fault 429=0.1"
        ),
    ),
    (
        ["llm", "--port", "0", "--ready-file", "/nowhere/ready"],
        "/nowhere/ready: cannot be written: No such file or directory",
    ),
]


@pytest.mark.parametrize(("options", "text"), BAD_OPTIONS, ids=[" ".join(options[:4]) for options, _ in BAD_OPTIONS])
def test_wrong_options_are_one_clear_sentence(options: list[str], text: str) -> None:
    result = CliRunner().invoke(app, options)
    assert isinstance(result.exception, KhalaError)
    assert str(result.exception) == text


def test_help_shows_examples() -> None:
    for command in ("agent", "llm"):
        result = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"})
        assert result.exit_code == 0
        assert f"khala {command} " in result.output


class Command:
    """A command in its own process."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        assert process.stdout is not None
        assert process.stderr is not None
        self.out, self.err = process.stdout, process.stderr

    async def until_said(self, words: str) -> str:
        """Return the first line on stderr with these words."""
        while line := (await self.err.readline()).decode():
            if words in line:
                return line
        raise AssertionError(f"it never said {words!r}")

    async def end(self, number: signal.Signals) -> tuple[int, str, str]:
        """Return the exit code, and the rest of stdout and stderr."""
        self.process.send_signal(number)
        out, err = await self.process.communicate()
        assert self.process.returncode is not None
        return self.process.returncode, out.decode(), err.decode()


@pytest.fixture
async def start() -> AsyncIterator[Callable[..., Any]]:
    """Start `khala <options>`; what still runs at the end of the test is killed."""
    running: list[asyncio.subprocess.Process] = []

    async def started(*options: str) -> Command:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "khala_sc2", *options, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
        )
        running.append(process)
        return Command(process)

    yield started
    for process in running:
        if process.returncode is None:
            process.kill()
            await process.communicate()


async def test_llm_says_where_it_is_answers_and_ends_when_told(start: Callable[..., Any], tmp_path: Path) -> None:
    ready = tmp_path / "ready.json"
    command = await start("llm", "--port", "0", "--json", "--ready-file", str(ready))
    said = json.loads(await command.out.readline())
    assert said == json.loads(ready.read_text(encoding="utf-8"))
    assert said["pid"] == command.process.pid
    assert said["base_url"] in await command.until_said("scripted models silent, random-legal, focus-fire, skilled at ")

    def ask() -> Any:
        with urllib.request.urlopen(said["base_url"] + "/models") as response:
            return json.load(response)

    assert len((await asyncio.to_thread(ask))["data"]) == 4
    code, _, err = await command.end(signal.SIGINT)
    assert (code, err) == (0, "0 requests were answered\n")


async def test_an_agent_plays_over_the_network_and_tells_what_it_did(
    start: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    bus = await open_bus(BusConfig(mode="router", listen=("tcp/127.0.0.1:0",)))
    replies = await bus.subscribe(every_agent("test", Topic.REPLY), Delivery.SPEECH)
    for message, topic in ((briefing(), Topic.BRIEFING), (observation(), Topic.OBSERVATION)):
        publisher = await bus.publisher(agent_key("test", "blue", "Stalkers", topic), Delivery.STATE)
        await publisher.put(encode(message))
    command = await start(
        "agent", "Stalkers", "--run", "test", "--policy", "silent", "--connect", bus.endpoints[0], "--json"
    )
    reply = decode_as(Reply, (await anext(replies)).payload)
    assert (reply.agent, reply.status, reply.text) == ("Stalkers", "ok", "Analysis: I watch.\nActions:\n")
    assert "Stalkers on side blue of run test: waiting for the host at" in await command.until_said("waiting")
    code, out, err = await command.end(signal.SIGTERM)
    assert (code, err) == (0, ""), err
    done = json.loads(out)["agents"]["Stalkers"]
    assert (done["replies"], done["ended"]) == ({"ok": 1}, "stopped")
    await bus.close()
