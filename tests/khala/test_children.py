"""The processes of a match: gone with their parent, started again when they fail, without keys that are not theirs."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import select
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from khala_agents.config import ModelConfig
from khala_protocol import parent_watch
from khala_sc2.playing import environment
from khala_sc2.playing.children import ChildDied, Children
from khala_simulator.process import parent_watch as simulator_watch

if TYPE_CHECKING:
    from collections.abc import Iterator


pytestmark = pytest.mark.linux
KEY = "sk-test-0123456789abcdef-do-not-tell"
GONE_S = 2.0


class Processes:
    """All processes with this cache directory in their environment: those of one test."""

    def __init__(self, place: Path) -> None:
        self._place = place
        self.environ = os.environ | {"KHALA_CACHE": str(place / "cache"), "OPENAI_API_KEY": KEY}
        self._mark = f"KHALA_CACHE={place / 'cache'}".encode()

    @contextlib.contextmanager
    def playing(self, *command: str) -> Iterator[subprocess.Popen[str]]:
        """Start a command, and wait until its match has begun."""
        arguments = [sys.executable, "-m", "khala_sc2", *command]
        with subprocess.Popen(
            arguments, cwd=self._place, env=self.environ, stderr=subprocess.PIPE, text=True
        ) as process:
            assert process.stderr is not None
            assert any(line.startswith("step 0") for line in process.stderr)
            try:
                yield process
            finally:
                process.kill()

    def environs(self) -> dict[int, bytes]:
        """Return the environments of those that live, by process id."""
        found = {}
        for entry in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                found[int(entry.parent.name)] = entry.read_bytes()
        return {pid: text for pid, text in found.items() if self._mark in text.split(b"\0")}

    def left_after(self, seconds: float) -> set[int]:
        """Return those that still live after so many seconds."""
        ends = {os.pidfd_open(pid) for pid in self.environs()}
        poll = select.poll()
        for end in ends:
            poll.register(end, select.POLLIN)
        until = time.monotonic() + seconds
        gone: set[int] = set()
        while len(gone) < len(ends) and (ready := poll.poll(max(0.0, until - time.monotonic()) * 1000)):
            for end, _ in ready:
                poll.unregister(end)
                gone.add(end)
        for end in ends:
            os.close(end)
        return set(self.environs())


@pytest.mark.game
def test_a_killed_match_leaves_no_process_and_only_its_host_had_the_key(tmp_path: Path) -> None:
    processes = Processes(tmp_path)
    with processes.playing("run", "2s3z", "--latency", "0.05") as host:
        found = processes.environs()
        assert len(found) == 3  # host, game, agent
        assert [pid for pid, text in found.items() if KEY.encode() in text] == [host.pid]
        host.kill()
        host.wait()
        assert processes.left_after(GONE_S) == set()


@pytest.mark.game
@pytest.mark.slow
def test_an_agent_started_by_hand_outlives_a_killed_host_and_its_game_does_not(tmp_path: Path) -> None:
    processes = Processes(tmp_path)
    bus = f"unixsock-stream/{tmp_path}/bus.sock"
    agent = [sys.executable, "-m", "khala_sc2", "agent", "Stalkers", "Zealots", "--run", "r", "--policy", "silent"]
    router = [sys.executable, "-m", "khala_sc2", "router", "--listen", bus]
    with contextlib.ExitStack() as stack:
        for command in (router, [*agent, "--connect", bus]):
            stack.callback(stack.enter_context(subprocess.Popen(command, cwd=tmp_path, env=processes.environ)).kill)
        hand = set(processes.environs())
        with processes.playing("host", "2s3z_pair", "--run", "r", "--connect", bus) as host:
            assert len(processes.environs()) == 4
            host.kill()
            host.wait()
            assert processes.left_after(GONE_S) == hand


BACK = """
import os, signal, time
from pathlib import Path

died = Path("died").exists()

def decide(briefing, observation):
    if observation.agent == "Stalkers" and not died and observation.step == 2:
        Path("died").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if observation.agent == "Stalkers" and died:
        Path("back").touch()
    while observation.agent == "Zealots" and observation.step == 3 and not Path("back").exists():
        time.sleep(0.05)
    return ""
"""


@pytest.mark.slow
@pytest.mark.game
def test_an_agent_that_dies_in_a_match_is_started_again_and_plays_on(tmp_path: Path) -> None:
    (tmp_path / "mortal.py").write_text(BACK)
    command = ["run", "2s3z_pair", "--policy", "mortal:decide", "--max-steps", "8", "--max-wait", "30", "--run", "r"]
    done = subprocess.run(
        [sys.executable, "-m", "khala_sc2", *command, "--json"],
        cwd=tmp_path, env=Processes(tmp_path).environ, capture_output=True, text=True, timeout=110, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "process agents-0 ended with code -9" in done.stderr
    statuses = json.loads(done.stdout)["results"][0]["statuses"]
    assert statuses["Zealots"] == {"ok": 8}
    assert statuses["Stalkers"]["ok"] > 2
    assert "started again, 1 of 3 times: it had ended with code -9" in (tmp_path / "runs/r/agents-0.log").read_text()


async def begun() -> asyncio.Event:
    event = asyncio.Event()
    event.set()
    return event


@pytest.mark.slow
async def test_a_child_that_fails_again_and_again_has_failed_for_good_in_its_last_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("khala_sc2.playing.children.PAUSES_S", (0.0,))
    async with Children(tmp_path) as children:
        await children.start("wrong", "agent", "A", "--run", "r", "--policy", "nope:decide")
        with pytest.raises(ChildDied) as died:
            await children.keep(await begun())
    assert str(died.value).startswith(
        "process wrong ended with code 1: khala: policy nope:decide: there is no module 'nope'"
    )
    assert "started again" not in str(died.value)
    assert (tmp_path / "wrong.log").read_text().count("there is no module") == 2
    assert (tmp_path / "wrong.log").stat().st_mode & 0o777 == 0o600


ENVIRON = {
    "PATH": "/bin", "LC_ALL": "C", "PYTHONPATH": "here", "KHALA_CACHE": "c", "https_proxy": "http://u:p@proxy",
    "OPENAI_API_KEY": KEY, "OPENAI_API_KEY_FILE": "key", "OPENAI_BASE_URL": "u", "ANTHROPIC_API_KEY": KEY,
    "AWS_SECRET": KEY,
}  # fmt: skip


def test_a_process_without_a_model_gets_no_keys_and_no_proxy() -> None:
    assert set(environment.plain(ENVIRON)) == {"PATH", "LC_ALL", "PYTHONPATH", "KHALA_CACHE"}


def test_an_agent_gets_what_its_model_names_and_the_keys_of_no_other() -> None:
    model = ModelConfig(
        profile="openai",
        model="m",
        base_url="https://x/v1",
        api_key_env="OPENAI_API_KEY",
        base_url_env="OPENAI_BASE_URL",
    )
    more = set(environment.with_model(model, ENVIRON)) - set(environment.plain(ENVIRON))
    assert more == {"https_proxy", "OPENAI_API_KEY", "OPENAI_API_KEY_FILE", "OPENAI_BASE_URL"}


def test_the_simulator_reads_the_variable_that_the_host_writes() -> None:
    assert simulator_watch.PARENT == parent_watch.PARENT
