"""What agents say that wait for a host, or that the run does not know, and which links they open."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from khala_agents.commands import PATIENCE_S, BusPlace, _say_if_nobody_comes
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.certificates import certify_agent, make_authority
from khala_protocol.keys import Topic, agent_key

if TYPE_CHECKING:
    from pathlib import Path

CLOCK = "jumps"


async def said(capsys: pytest.CaptureFixture[str], names: list[str], *, briefed: list[str]) -> str:
    broker = MemoryBroker()
    for name in briefed:
        host = await broker.session().publisher(agent_key("first", "blue", name, Topic.BRIEFING), Delivery.STATE)
        await host.put(b"a briefing")
    await _say_if_nobody_comes({name: broker.session() for name in names}, "first", "blue", "tls/10.0.0.5:7447")
    return capsys.readouterr().err


async def test_agents_say_that_they_wait_for_which_run_and_where(capsys: pytest.CaptureFixture[str]) -> None:
    assert await said(capsys, ["Stalkers", "Zealots"], briefed=[]) == (
        "Stalkers, Zealots on side blue: no host that knows them in run first has come to tls/10.0.0.5:7447 within "
        "10 s, and they wait on; are the names right? `khala tasks` lists those of agents\n"
    )
    assert asyncio.get_running_loop().time() == pytest.approx(PATIENCE_S)


async def test_an_agent_that_the_run_does_not_know_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    names = ["Stalkers", "Stlkers"]
    assert (await said(capsys, names, briefed=["Stalkers"])).startswith("Stlkers on side blue: no host that knows")
    assert await said(capsys, names, briefed=names) == ""


def test_agents_share_a_link_but_over_tls_each_has_its_own(tmp_path: Path) -> None:
    names = ["Stalkers", "Zealots"]
    (shared,) = BusPlace().links("blue", names)
    assert (shared.names, shared.config.connect_to) == (names, ("tcp/127.0.0.1:7447",))
    make_authority(tmp_path)
    for name in names:
        certify_agent(tmp_path, "blue", name)
    links = BusPlace(tls=tmp_path).links("blue", names)
    assert [(link.names, link.config.tls and link.config.tls.key.parent.name) for link in links] == [
        (["Stalkers"], "agent.blue.Stalkers"), (["Zealots"], "agent.blue.Zealots"),
    ]  # fmt: skip


def test_a_link_to_another_machine_without_tls_is_loud(capsys: pytest.CaptureFixture[str]) -> None:
    BusPlace(["tcp/10.0.0.5:7447"], insecure=True).links("blue", ["Stalkers"])
    assert capsys.readouterr().err == (
        "WARNING: tcp/10.0.0.5:7447 has no encryption and no identities: everyone who reaches it can read all, and "
        "speak as any agent or as the host; `khala keys` makes keys for --tls\n"
    )
