"""The addresses that `khala mcp --port` prints: a seat has one client at a time, and no other program acts for it."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import httpx
import pytest
import typer
from mcp import Client

from khala_protocol.errors import ConfigError
from khala_sc2.mcp import holder as holding
from khala_sc2.mcp.holder import HELD_S, Holder, Taken
from khala_sc2.mcp.serve import TOKENS, over_http
from khala_sc2.mcp.server import client_of
from khala_sc2.mcp.table import MOST_MESSAGES
from tests.khala.test_mcp import STALKERS, ZEALOTS, game, refusal, said, table

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_sc2.mcp.table import Table

LONG_S = 3600  # a busy machine is slow
TAKEN = f"another client plays blue/Stalkers: end it, or come back when it has done nothing for {HELD_S:.0f} s"
LOST = f"another client has taken blue/Stalkers over, since you did nothing for {HELD_S:.0f} s"
ASKS: dict[str, Any] = {
    "json": {"jsonrpc": "2.0", "id": 1, "method": "tools/list"},
    "headers": {"Accept": "application/json, text/event-stream"},
}


@contextlib.asynccontextmanager
async def serving(match: Table, capsys: pytest.CaptureFixture[str]) -> AsyncIterator[dict[str, str]]:
    """Yield the addresses by seat, and end the server in order."""
    task = asyncio.create_task(over_http(match, 0))
    await asyncio.sleep(0)  # it has its port, and says its addresses, before it waits for anything
    try:
        yield dict(line.split(": ", 1) for line in capsys.readouterr().err.splitlines())
    finally:
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(typer.Exit):
            await task


# --- who holds a seat ---------------------------------------------------------------------------------


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_a_seat_goes_to_another_client_when_its_own_is_idle_or_leaves_and_both_are_told() -> None:
    clock = Clock()
    holder = Holder("blue/Stalkers", clock)
    holder.take("a")
    clock.now_s += HELD_S - 1
    with pytest.raises(Taken, match=TAKEN):
        holder.take("b")
    holder.take("a")
    clock.now_s += HELD_S
    holder.take("b")
    with pytest.raises(Taken, match=LOST):
        holder.take("a")
    with pytest.raises(Taken, match=TAKEN):
        holder.take("a")
    holder.leave("a")
    with pytest.raises(Taken, match=TAKEN):
        holder.take("c")
    holder.leave("b")
    holder.take("c")


def test_each_client_is_briefed_once() -> None:
    clock = Clock()
    holder = Holder("blue/Stalkers", clock)
    holder.take("a")
    assert [holder.brief(), holder.brief()] == [True, False]
    clock.now_s += HELD_S
    holder.take("b")
    assert [holder.brief(), holder.brief()] == [True, False]
    holder.leave("b")
    holder.take("b")
    assert holder.brief()
    holder.greet()
    assert holder.brief(), "clients without a name are told apart by their first request alone"


@pytest.mark.parametrize(
    ("headers", "name"),
    [
        ({"mcp-session-id": "s", "cookie": "khala_client=c"}, "session s"),
        ({"cookie": "a=b; khala_client=c"}, "cookie c"),
        ({"cookie": "\x00=;"}, ""),
        ({}, ""),
    ],
)
def test_a_client_is_named_by_its_session_or_its_cookie(headers: dict[str, str], name: str) -> None:
    assert client_of(headers) == name


# --- over HTTP ----------------------------------------------------------------------------------------


@game
@pytest.mark.parametrize("mode", ["auto", pytest.param("legacy", marks=pytest.mark.slow)])
async def test_a_second_client_is_refused_and_is_briefed_once_it_may_play(
    mode: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(holding, "HELD_S", LONG_S)
    async with serving(table(STALKERS, max_steps=3), capsys) as addresses:
        address = addresses[str(STALKERS)]
        async with Client(address, mode=mode) as first, Client(address, mode=mode) as second:
            assert (await said(first, "observe")).startswith("# Who you are")
            for tool, given in (("observe", {}), ("act", {"reply": ""}), ("message", {"to": "Zealots", "text": "hi"})):
                assert await refusal(second, tool, **given) == (
                    f"another client plays blue/Stalkers: end it, or come back when it has done nothing for {LONG_S} s"
                )
            assert "Observation of step 1" in await said(first, "act", reply="")
            monkeypatch.setattr(holding, "HELD_S", 0.0)
            assert (await said(second, "observe")).startswith("# Who you are")
            monkeypatch.setattr(holding, "HELD_S", LONG_S)
            assert (await refusal(first, "act", reply="")).startswith("another client has taken blue/Stalkers over")
            assert "Observation of step 2" in await said(second, "act", reply="")


@pytest.mark.slow
@game
async def test_a_client_of_an_older_protocol_that_ends_its_session_frees_the_seat_at_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    async with serving(table(STALKERS, max_steps=3), capsys) as addresses:
        for _ in range(2):
            async with Client(addresses[str(STALKERS)], mode="legacy") as client:
                assert (await said(client, "observe")).startswith("# Who you are")


async def test_only_the_printed_address_of_a_seat_reaches_it(capsys: pytest.CaptureFixture[str]) -> None:
    async with (
        serving(table(STALKERS, ZEALOTS), capsys) as addresses,
        httpx.AsyncClient() as client,
    ):
        stalkers, zealots = addresses.values()
        bare, port = stalkers.partition("?")[0], urlsplit(stalkers).port
        for address in (bare, f"{bare}?token=guessed", f"{bare}?{urlsplit(zealots).query}"):
            refused = await client.post(address, **ASKS)
            assert (refused.status_code, refused.text) == (
                403, "the token is missing or wrong: open the address that `khala mcp` printed\n",
            )  # fmt: skip
        for origin in ("http://evil.example", "http://localhost:9", f"http://localhost:{port}", "null"):
            assert (await client.post(stalkers, json={}, headers={"Origin": origin})).status_code == 403
        own = ASKS | {"headers": ASKS["headers"] | {"Origin": f"http://127.0.0.1:{port}"}}
        assert (await client.post(stalkers, **own)).status_code not in {403, 413}
        assert (await client.post(stalkers, content=b"{" + b" " * 100_000)).status_code == 413


async def test_a_token_of_the_environment_stays_and_must_not_be_guessed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(TOKENS, "0123456789abcdef")
    async with serving(table(STALKERS), capsys) as addresses:
        assert addresses[str(STALKERS)].endswith("/blue/Stalkers/mcp?token=0123456789abcdef")
    monkeypatch.setenv(TOKENS, "short")
    with pytest.raises(ConfigError, match=f"^{TOKENS}: it can be guessed"):
        await over_http(table(STALKERS), 0)


@game
async def test_long_answers_and_messages_without_end_are_refused() -> None:
    from khala_sc2.mcp.server import server_of

    match = table(STALKERS, max_steps=2)
    async with match, Client(server_of(match, STALKERS)) as client:
        await said(client, "observe")
        assert "at most 32768" in await refusal(client, "act", reply="x" * 100_000)
        assert "at most 2000" in await refusal(client, "message", to="Zealots", text="x" * 100_000)
        for _ in range(MOST_MESSAGES):
            await said(client, "message", to="Zealots", text="hi")
        assert await refusal(client, "message", to="Zealots", text="hi") == (
            f"{MOST_MESSAGES} messages wait for your next act already: call act, which sends them"
        )
