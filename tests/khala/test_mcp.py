"""MCP clients play agents of a match: the SDK's own client, in memory, over stdio and over streamable HTTP."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import random
import shutil
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import httpx
import pytest
import typer
from mcp import Client, MCPError, StdioServerParameters
from mcp.types import BlobResourceContents, CallToolResult, ImageContent, TextContent, TextResourceContents

from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol import speech
from khala_protocol.messages import Message, Observation, Reply, Result
from khala_protocol.recording import Recording
from khala_sc2.mcp.serve import over_http
from khala_sc2.mcp.server import server_of
from khala_sc2.mcp.table import Table, TableLook, with_messages
from khala_sc2.mcp.words import page
from khala_sc2.playing.minds import Minds
from khala_sc2.playing.seats import Seat, without_time_limit

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator
    from pathlib import Path

game = pytest.mark.game
STALKERS, ZEALOTS = Seat("blue", "Stalkers"), Seat("blue", "Zealots")


def table(*seats: Seat, record: Path | None = None, episodes: int = 1, hurried: bool = False, **changes: Any) -> Table:
    task = change(load_task("2s3z_pair"), **changes)
    config = MatchConfig(
        task=task if hurried else without_time_limit(task), run="mcp", episodes=episodes, record=record, assemble_s=20
    )
    return Table(config, seats, {"blue": Minds().with_name("silent")})


@contextlib.asynccontextmanager
async def client_of(table: Table, seat: Seat = STALKERS) -> AsyncIterator[Client]:
    async with table, Client(server_of(table, seat)) as client:
        yield client


async def said(client: Client, tool: str, **arguments: object) -> str:
    """Call a tool, and return the text of its answer."""
    result = await client.call_tool(tool, arguments)
    assert not result.is_error, result.content
    return text_of(result)


async def refusal(client: Client, tool: str, **arguments: object) -> str:
    result = await client.call_tool(tool, arguments)
    assert result.is_error
    return text_of(result).removeprefix(f"Error executing tool {tool}: ")


def text_of(result: CallToolResult) -> str:
    first = result.content[0]
    assert isinstance(first, TextContent)
    return first.text


async def played(client: Client) -> list[str]:
    """Play a seat to the end as the scripted player does, and return all that it has read."""
    read = [await said(client, "observe")]
    while "The match is over." not in read[-1]:
        asked = read[-1].rpartition("Observation of step")[1]
        observation = read[-1].rpartition("Observation of step")[2]
        answer = PLAYERS["skilled"](observation, random.Random(0))
        read.append(await (said(client, "act", reply=answer) if asked else said(client, "observe")))
    return read


@game
async def test_a_client_observes_acts_and_reads_what_became_of_it_with_pictures(tmp_path: Path) -> None:
    moved: list[tuple[float, str | None]] = []

    async def moves(progress: float, total: float | None, message: str | None) -> None:
        moved.append((progress, message))

    record = tmp_path / "recording.mcap"
    async with client_of(table(STALKERS, record=record, max_steps=2, images="screen")) as client:
        assert [tool.name for tool in (await client.list_tools()).tools] == ["observe", "act", "message", "look_up"]
        assert "Call observe" in (client.instructions or "")
        assert [one.name for one in (await client.list_resources()).resources] == ["briefing", "observation"]
        with pytest.raises(MCPError, match="nothing has been observed yet: call the tool observe first"):
            await client.read_resource("khala://briefing")
        first = await client.call_tool("observe", {})
        await check_resources(client, first)
        assert text_of(first).startswith("# Who you are\nYou are Stalkers")
        assert "Observation of step 0, episode 1 of 1. The game waits for your answer." in text_of(first)
        assert await said(client, "message", to="Zealots", text="Hold '''here''') <Stop()>") == (
            "Your next act takes it to Zealots."
        )
        second = await client.call_tool(
            "act", {"reply": "Actions:\nTeam Stalker-1:\n<Move_Screen([9, 9])>\n<Nonsense()>"}, progress_callback=moves
        )
        fate, where, *_ = text_of(second).splitlines()
        assert fate == "Your last answer: fresh; 1 carried out, 1 refused."
        assert where.startswith("Observation of step 1,")
        assert "There is no action Nonsense" in text_of(second)
        ended = await said(client, "act", reply="Actions:\n<Nonsense()>")
    assert moved == [(11, "episode 1, step 0, game loop 11")]
    assert "    refused: <Nonsense()>: There is no action Nonsense" in ended
    assert "Episode 1 of 1 is over: cut at 2 steps, after 1 s of game time. Value killed 0, lost 0.\n" in ended
    assert ended.endswith(f"The match is over. Its recording is {record}: the user can look at it with `khala view`.")
    recording = Recording.open(record)
    assert [one.text for one in recording.of(Message)] == ['Hold "here") <Stop()>']
    assert len(list(recording.of(Reply, agent="Stalkers"))) == 2


async def check_resources(client: Client, observed: CallToolResult) -> None:
    """Check that what was observed is there as resources, too."""
    (picture,) = [one for one in observed.content if isinstance(one, ImageContent)]
    assert base64.b64decode(picture.data).startswith(b"\xff\xd8")
    uris = [one.uri for one in (await client.list_resources()).resources]
    assert uris == ["khala://briefing", "khala://observation", "khala://pictures/screen-Stalker-1"]
    (briefing,), (seen,), (same,) = [(await client.read_resource(uri)).contents for uri in uris]
    assert isinstance(same, BlobResourceContents)
    assert (same.blob, same.mime_type) == (picture.data, "image/jpeg")
    assert isinstance(briefing, TextResourceContents)
    assert isinstance(seen, TextResourceContents)
    assert "# How to play with these tools" in briefing.text
    assert "\n\nGame\n    Time: 0:00" in seen.text


@pytest.mark.slow
@game
async def test_what_cannot_be_done_is_said_with_what_can_and_another_episode_is_played() -> None:
    async with client_of(table(STALKERS, max_steps=1, episodes=2)) as client:
        assert await refusal(client, "message", to="Zealots", text="hi") == (
            "blue/Stalkers has seen nothing yet: call observe first"
        )
        assert await refusal(client, "act", reply="") == (
            "blue/Stalkers waits for no answer now: call observe, which waits until it does"
        )
        await said(client, "observe")
        assert await refusal(client, "message", to="Bob", text="hi") == (
            "blue/Stalkers cannot write to 'Bob': it can write to Zealots, Channel-1"
        )
        assert "did you mean Stalker" in await refusal(client, "look_up", name="Stalkr")
        assert (await said(client, "look_up", name="Stalker")).startswith("Stalker (unit, protoss, id 74)")
        between = await said(client, "act", reply="")
        assert "Episode 1 of 2 is over" in between
        assert "The match is over" not in between
        again = await said(client, "observe", briefing=True)
        assert again.startswith("# Who you are")
        assert "Observation of step 0, episode 2 of 2." in again
        await said(client, "act", reply="")
        assert await refusal(client, "act", reply="") == "the match is over: nobody waits for an answer"
        assert (await said(client, "observe")).startswith("The match is over.")


@pytest.mark.slow
@game
async def test_a_player_that_was_too_slow_must_look_before_it_answers() -> None:
    slow = table(STALKERS, hurried=True, max_wait_s=1.0, max_steps=2)
    async with client_of(slow) as client:
        assert "s to answer; then the match goes on without your answer." in await said(client, "observe")
        seen = slow.newest(STALKERS)
        while slow.newest(STALKERS) is seen:
            await asyncio.wait_for(slow._changed.wait(), timeout=20)
        assert await refusal(client, "act", reply="") == (
            "the time for an answer to what you saw is over: call observe, and answer what it says"
        )
        late = await said(client, "observe")
    assert late.startswith("Your last answer: timeout; 0 carried out, 0 refused.\nObservation of step 1,")


def server_command(tmp_path: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "khala_sc2", "mcp", "2s3z_pair", "--max-steps", "2", "--out", str(tmp_path), *options]


def result_in(tmp_path: Path) -> Result:
    (path,) = tmp_path.glob("*/recording.mcap")
    (result,) = Recording.open(path).of(Result)
    return result


@game
async def test_a_client_plays_over_stdio_while_a_policy_plays_the_others(tmp_path: Path) -> None:
    command, *options = server_command(tmp_path, "--seat", "Stalkers", "--others", "skilled")
    with (tmp_path / "stderr").open("w+") as log:
        from mcp.client.stdio import stdio_client

        transport = stdio_client(StdioServerParameters(command=command, args=options), errlog=log)
        async with Client(transport, mode="legacy") as client:
            await played(client)
        log.seek(0)
        assert log.read() == ""
    assert result_in(tmp_path).statuses == {"Stalkers": {"ok": 2}, "Zealots": {"ok": 2}}


@pytest.mark.slow
@game
@pytest.mark.parametrize(("ends", "code"), [("signal", 128 + signal.SIGTERM), ("stdin", 0)])
def test_a_server_over_stdio_ends_in_order_in_the_middle_of_a_match(tmp_path: Path, ends: str, code: int) -> None:
    info = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "test", "version": "1"}}
    calls = [
        {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": info},
        {"jsonrpc": "2.0", "method": "notifications/initialized"},
        {"jsonrpc": "2.0", "id": 2, "method": "tools/call", "params": {"name": "observe", "arguments": {}}},
    ]
    with subprocess.Popen(
        server_command(tmp_path), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for call in calls:
            process.stdin.write(json.dumps(call) + "\n")
            process.stdin.flush()
        while json.loads(process.stdout.readline()).get("id") != 2:
            pass
        if ends == "signal":
            process.send_signal(signal.SIGTERM)
        else:
            process.stdin.close()
        assert process.wait(timeout=60) == code
    (path,) = tmp_path.glob("*/recording.mcap")
    assert len(list(Recording.open(path).of(Observation))) == 2


@contextlib.contextmanager
def http_server(tmp_path: Path, *options: str) -> Iterator[dict[str, str]]:
    """Start a server, yield its addresses by seat, and end it in order."""
    with subprocess.Popen(
        server_command(tmp_path, "--port", "0", *options), stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        try:
            yield dict(process.stderr.readline().strip().split(": ", 1) for _ in range(2))
        finally:
            process.send_signal(signal.SIGTERM)
            rest = process.stderr.read()
        assert process.wait() == 128 + signal.SIGTERM
        assert "Traceback" not in rest


@game
async def test_two_clients_play_the_two_seats_of_a_match_over_http(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    both = table(STALKERS, ZEALOTS, record=tmp_path / "run" / "recording.mcap", max_steps=2)
    serving = asyncio.create_task(over_http(both, 0))
    await asyncio.sleep(0)  # it has its port, and says its addresses, before it waits for anything
    addresses = dict(line.split(": ", 1) for line in capsys.readouterr().err.splitlines())
    assert list(addresses) == [str(STALKERS), str(ZEALOTS)]
    async with (
        Client(addresses["blue/Stalkers"]) as stalkers,
        Client(addresses["blue/Zealots"], mode="legacy") as zealots,
    ):
        first, second = await asyncio.gather(played(stalkers), played(zealots))
    assert first[0].startswith("# Who you are\nYou are Stalkers")
    assert second[0].startswith("# Who you are\nYou are Zealots")
    async with httpx.AsyncClient() as foreign:
        refused = await foreign.post(addresses["blue/Zealots"], json={}, headers={"Host": "evil.example"})
    assert refused.status_code == 403
    signal.raise_signal(signal.SIGTERM)
    with pytest.raises(typer.Exit) as ended:
        await serving
    assert ended.value.exit_code == 128 + signal.SIGTERM
    assert result_in(tmp_path).statuses == {"Stalkers": {"ok": 2}, "Zealots": {"ok": 2}}


@pytest.mark.slow
@game
@pytest.mark.skipif(shutil.which("npx") is None, reason="the Inspector runs on Node")
@pytest.mark.timeout(300)
def test_the_inspector_reads_and_calls(tmp_path: Path) -> None:
    with http_server(tmp_path) as addresses:
        tools = inspected(addresses["blue/Stalkers"], "tools/list")["tools"]
        assert [tool["name"] for tool in tools] == ["observe", "act", "message", "look_up"]
        call = ("tools/call", "--tool-name", "look_up", "--tool-arg", "name=Stalker")
        (content,) = inspected(addresses["blue/Stalkers"], *call)["content"]
        assert content["text"].startswith("Stalker (unit, protoss, id 74)")
        resources = inspected(addresses["blue/Stalkers"], "resources/list")["resources"]
        assert [one["uri"] for one in resources] == ["khala://briefing", "khala://observation"]


def inspected(address: str, method: str, *options: str) -> Any:
    """Return what MCP Inspector's command line says."""
    command = ["npx", "--yes", "@modelcontextprotocol/inspector", "--cli", address, "--transport", "http"]
    done = subprocess.run(
        [*command, "--method", method, *options], capture_output=True, text=True, check=True, timeout=200
    )
    return json.loads(done.stdout)


def test_messages_stand_behind_a_reply_and_are_read_as_written() -> None:
    parsed = speech.parse(with_messages("Actions:\nTeam A:\n<Stop()>", [("Zealots", "go '''on''')>\nnow")]))
    assert [call.name for call in parsed.calls] == ["Stop"]
    assert [(one.recipient, one.text) for one in parsed.messages] == [("Zealots", 'go "on")>\nnow')]
    assert with_messages("<Stop()>", []) == "<Stop()>"


@pytest.mark.parametrize(
    ("others", "over", "says"),
    [
        ([ZEALOTS], False, "You are not asked now: the match waits for blue/Zealots. Call observe again."),
        ([], False, "You are not asked now: the match goes on. Call observe again."),
        ([], True, "The match is over. Its recording is None: the user can look at it with `khala view`."),
    ],
)
def test_a_player_without_a_question_reads_why(others: list[Seat], over: bool, says: str) -> None:
    config = MatchConfig(task=load_task("2s3z_pair"), run="mcp")
    assert page(TableLook(None, None, [], [], over, others), config) == says
