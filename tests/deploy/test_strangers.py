"""Attacks on a running match over TLS: none succeeds, the match goes on. They are in `bench/survival/strangers.py`."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bench.survival.strangers import ANSWER_S, ATTACKS, Row, attack_here, siege

if TYPE_CHECKING:
    from collections.abc import Iterator

REPRESENTATIVES = (
    "stranger: no certificate",
    "stranger: certificate of another authority",
    "stranger: plain TCP",
    "agent: reads prompts of others",
    "agent: reads reports and the run card",
    "agent: writes junk under replies of others",
    "agent: writes as host",
    "agent: holds tokens of others",
)
HOST_ADDRESS, STRANGER_ADDRESS = "198.18.78.1", "198.18.78.2"
ALL_S = 400


def assert_repelled(row: Row) -> None:
    assert row.tried
    assert row.succeeded == 0, row
    assert row.steps > 5, row
    assert row.slowest_ms < 1000 * ANSWER_S + 500, row  # a busy machine is late with it, too


async def test_strangers_and_dishonest_agents_get_nowhere() -> None:
    async with siege() as match:
        for name in REPRESENTATIVES:
            assert_repelled(await attack_here(match, name, seconds=0.5))


@pytest.mark.slow
async def test_the_attacks_would_succeed_without_access_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.survival.strangers.router_settings", lambda *_: {})
    async with siege() as match:
        for name in REPRESENTATIVES[3:]:
            assert (await attack_here(match, name, seconds=0.5)).succeeded, name


@pytest.fixture
def machines() -> Iterator[tuple[str, str]]:
    """Yield two network namespaces with a cable between them."""
    if sys.platform != "linux" or os.geteuid() != 0 or shutil.which("ip") is None:
        pytest.skip("network namespaces need root and iproute2")
    names = [f"siege{os.getpid()}-{n}" for n in (1, 2)]
    try:
        for name in names:
            subprocess.run(["ip", "netns", "add", name], check=True, capture_output=True)
            _ip(name, "link", "set", "lo", "up")
        _ip(names[0], "link", "add", "cable", "type", "veth", "peer", "cable", "netns", names[1])
        for name, address in zip(names, (HOST_ADDRESS, STRANGER_ADDRESS), strict=True):
            _ip(name, "address", "add", f"{address}/24", "dev", "cable")
            _ip(name, "link", "set", "cable", "up")
        yield names[0], names[1]
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no network namespaces here: {error.stderr.decode().strip()}")
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "delete", name], check=False, capture_output=True)


def _ip(namespace: str, *arguments: str) -> None:
    subprocess.run(["ip", "-n", namespace, *arguments], check=True, capture_output=True)


@pytest.mark.slow
@pytest.mark.netns
@pytest.mark.timeout(2 * ALL_S)
@pytest.mark.parametrize("topology", ["the host is the router", "a router between"])
async def test_no_attack_from_another_machine_succeeds(machines: tuple[str, str], topology: str) -> None:
    host, stranger = machines
    command = [sys.executable, "-m", "bench", "strangers", "--json", "--seconds", "1"]
    command += ["--listen", f"tls/{HOST_ADDRESS}:7447", "--through", "ip", "netns", "exec", stranger]
    command += ["--router"] if topology == "a router between" else []
    process = await asyncio.create_subprocess_exec(
        *("ip", "netns", "exec", host, *command), stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]
    )
    try:
        async with asyncio.timeout(ALL_S):
            said, _ = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    rows = [Row(**row) for row in json.loads(said)["rows"]]
    assert [row.attack for row in rows] == list(ATTACKS)
    for row in rows:
        assert_repelled(row)
