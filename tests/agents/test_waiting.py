"""What agents say that wait for a host, or that the run does not know, and which links they open."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from khala_agents.commands import PATIENCE_S, Place, _say_if_nobody_comes
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.certificates import certify_agent, make_authority
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import AgentCard, Clock, Run

if TYPE_CHECKING:
    from pathlib import Path

CLOCK = "jumps"
CARD = Run(
    run="first", task="2s3z_pair", map_name="2s3z", map_sha256="", seed=0, episodes=1, game="none", executor="raw",
    clock=Clock(step_loops=8), agents=(AgentCard(name="Stalkers", side="blue", teams=()),), catalogue_sha256="",
    versions={},
)  # fmt: skip


async def said(capsys: pytest.CaptureFixture[str], names: list[str], *, host: bool) -> str:
    broker = MemoryBroker()
    if host:
        cards = await broker.session().publisher(run_key("first", Topic.RUN), Delivery.STATE)
        await cards.put(encode(CARD))
    await _say_if_nobody_comes(broker.session(), "first", "blue", names, "tls/10.0.0.5:7447")
    return capsys.readouterr().err


async def test_agents_say_that_they_wait_for_which_run_and_where(capsys: pytest.CaptureFixture[str]) -> None:
    assert await said(capsys, ["Stalkers", "Zealots"], host=False) == (
        "Stalkers, Zealots on side blue: no host of run first has come to tls/10.0.0.5:7447 within 10 s, and they wait "
        "on; is the name of the run right?\n"
    )
    assert asyncio.get_running_loop().time() == pytest.approx(PATIENCE_S)


async def test_agents_that_the_run_does_not_know_say_which_it_has(capsys: pytest.CaptureFixture[str]) -> None:
    assert await said(capsys, ["Stalkers", "Stlkers"], host=True) == (
        "run first at tls/10.0.0.5:7447 has no Stlkers on side blue, and will ask them nothing: its agents are "
        "blue/Stalkers\n"
    )
    assert await said(capsys, ["Stalkers"], host=True) == ""


def test_agents_share_a_link_but_over_tls_each_has_its_own(tmp_path: Path) -> None:
    names = ["Stalkers", "Zealots"]
    (shared,) = Place().links("blue", names)
    assert (shared.names, shared.config.connect_to) == (names, ("tcp/127.0.0.1:7447",))
    make_authority(tmp_path)
    for name in names:
        certify_agent(tmp_path, "blue", name)
    links = Place(tls=tmp_path).links("blue", names)
    assert [(link.names, link.config.tls and link.config.tls.key.parent.name) for link in links] == [
        (["Stalkers"], "agent.blue.Stalkers"), (["Zealots"], "agent.blue.Zealots"),
    ]  # fmt: skip


def test_a_link_to_another_machine_without_tls_is_loud(capsys: pytest.CaptureFixture[str]) -> None:
    Place(["tcp/10.0.0.5:7447"], insecure=True).links("blue", ["Stalkers"])
    assert capsys.readouterr().err == (
        "WARNING: tcp/10.0.0.5:7447 has no encryption and no identities: everyone who reaches it can read all, and "
        "speak as any agent or as the host; `khala keys` makes keys for --tls\n"
    )
