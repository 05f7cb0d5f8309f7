"""Nodes of a cluster: where a head is, and how long a machine belongs to it. `test_ray` starts Ray itself."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from khala_protocol.errors import ConfigError
from khala_sc2.experiment import ray_node

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(autouse=True)
def own_signals() -> Iterator[None]:
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("address", ["", "6379", "host:", "host:port", ":6379"])
def test_an_address_that_is_none_is_said(address: str) -> None:
    with pytest.raises(ConfigError, match="give HOST:PORT, such as"):
        ray_node.split_address(address)


async def test_a_head_that_died_before_it_was_a_node_is_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        started: list[subprocess.Popen[bytes]] = []

        def start(*words: str, own: str, matches: int) -> subprocess.Popen[bytes]:
            assert (words[0], own, matches) == ("--head", "127.0.0.1", 0)
            started.append(subprocess.Popen([sys.executable, "-c", "import signal; signal.pause()"]))
            return started[-1]

        monkeypatch.setattr(ray_node, "_start", start)
        async with ray_node.running_head(f"127.0.0.1:{server.getsockname()[1]}") as head:
            await head.listen()
            assert len(started) == 1
            started[0].kill()
            started[0].wait()
            await head.listen()
            assert len(started) == 2
            assert started[1].poll() is None
        assert started[1].poll() is not None


async def test_a_head_whose_port_is_taken_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray_node, "_start", lambda *_, **__: subprocess.Popen([sys.executable, "-c", ""]))
    with pytest.raises(ConfigError, match="is the port taken"):
        async with ray_node.running_head("127.0.0.1:1"):
            pass


def test_a_machine_whose_node_dies_joins_again_and_ends_with_the_head(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("ray")
    head = socket.create_server(("127.0.0.1", 0))
    port = head.getsockname()[1]
    started: list[tuple[object, ...]] = []

    def start(*words: str, own: str, matches: int) -> subprocess.Popen[bytes]:
        started.append((*words, own, matches))
        if len(started) == 2:
            head.close()
        return subprocess.Popen([sys.executable, "-c", ""])

    monkeypatch.setattr(ray_node, "_start", start)
    with head:
        ray_node.join(f"127.0.0.1:{port}", 3)
    assert started == [(f"--address=127.0.0.1:{port}", "127.0.0.1", 3)] * 2
    where = f"an experiment at 127.0.0.1:{port}"
    joining = f"joining the experiment at 127.0.0.1:{port}, to play 3 at a time"
    assert capsys.readouterr().err.splitlines() == [
        f"waiting for {where}", joining, joining, f"the experiment at 127.0.0.1:{port} is over"
    ]  # fmt: skip
