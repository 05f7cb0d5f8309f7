"""One match on two or three machines: network namespaces with cables, and the commands that a person would type.

On the first machine are the keys, router and host, on the second the agents and their model. In a duel, the agents of
one side are on the second machine, and those of the other on the third.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_sc2.cli import main
from khala_sc2.experiment.store import Store

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

pytestmark = [pytest.mark.netns, pytest.mark.game]

ROUTER = "tls/192.0.2.1:7447"  # addresses of this range belong to nobody (RFC 5737)
RUN, TASK, DUEL = "machines", "2s3z_pair", "duel_3m"
AGENTS = ("Stalkers", "Zealots")
READY_S, MATCH_S, END_S = 30.0, 60.0, 15.0
RAY = Path("/tmp/ray")  # where Ray has the sockets of a node
OWN_FILES = f'mount --bind "$0" {RAY} && exec "$@"'
"""Two nodes that begin together in one directory take the same names, and one of them dies."""


@dataclass
class Command:
    """A running `khala` command."""

    process: asyncio.subprocess.Process
    log: Path

    async def line(self) -> Any:
        """Return its next line on stdout, as JSON."""
        assert self.process.stdout is not None
        async with asyncio.timeout(READY_S):
            line = await self.process.stdout.readline()
        if not line:
            await self.ended()
        return json.loads(line)

    async def said(self, text: str) -> None:
        """Wait until this text is on its stderr."""
        assert self.process.stderr is not None
        async with asyncio.timeout(READY_S):
            async for line in self.process.stderr:
                self._keep(line)
                if text in line.decode():
                    return
        pytest.fail(f"it never said {text!r}: {self.log.read_text()}")

    async def ended(self, within_s: float = READY_S) -> bytes:
        """Return what it wrote on stdout when it has ended well."""
        async with asyncio.timeout(within_s):
            out, err = await self.process.communicate()
        self._keep(err)
        assert self.process.returncode == 0, self.log.read_text()
        return out

    async def result(self, within_s: float) -> Any:
        """Return its result as JSON when it has ended well."""
        return json.loads(await self.ended(within_s))

    def _keep(self, said: bytes) -> None:
        with self.log.open("ab") as log:
            log.write(said)


@dataclass
class Machine:
    """A network namespace."""

    name: str
    address: str
    directory: Path
    commands: list[Command] = field(default_factory=list)

    async def khala(self, *arguments: str) -> Command:
        """Start a command there."""
        return await self.python("-m", "khala_sc2", *arguments)

    async def python(self, *arguments: str) -> Command:
        """Start Python there."""
        files = self.directory / f"{self.name}-ray"
        for directory in (files, RAY):
            directory.mkdir(exist_ok=True)
        process = await asyncio.create_subprocess_exec(
            *("ip", "netns", "exec", self.name, "sh", "-c", OWN_FILES, str(files), sys.executable, *arguments),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={name: value for name, value in os.environ.items() if not name.startswith("KHALA_")}
            | {"KHALA_CACHE": str(self.directory / "cache")},
        )
        command = Command(process, self.directory / f"{self.name}-{len(self.commands)}.log")
        self.commands.append(command)
        return command

    def ip(self, *arguments: str) -> None:
        """Change its network."""
        _ip("-n", self.name, *arguments)

    def crash(self) -> None:
        """Kill all that runs there, as if its power were cut."""
        pids = subprocess.run(["ip", "netns", "pids", self.name], check=True, capture_output=True, text=True).stdout
        for pid in map(int, pids.split()):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    async def off(self) -> None:
        """End all that runs there."""
        self.crash()
        for command in self.commands:
            await command.process.communicate()


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True, text=True)


@pytest.fixture
async def machines(tmp_path: Path) -> AsyncIterator[tuple[Machine, Machine, Machine]]:
    """Yield three machines that reach each other, through a switch at the first one, and nothing else."""
    if sys.platform != "linux" or os.geteuid() != 0 or shutil.which("ip") is None:
        pytest.skip("network namespaces need root and iproute2")
    first, second, third = (Machine(f"khala-{os.getpid()}-{n}", f"192.0.2.{n}", tmp_path) for n in (1, 2, 3))
    async with contextlib.AsyncExitStack() as stack:
        for machine in (first, second, third):
            try:
                _ip("netns", "add", machine.name)
            except subprocess.CalledProcessError as error:
                pytest.skip(f"no network namespaces here: {error.stderr.strip()}")
            stack.callback(_ip, "netns", "delete", machine.name)
            stack.push_async_callback(machine.off)
            machine.ip("link", "set", "lo", "up")
        first.ip("link", "add", "name", "cable", "type", "bridge")
        for number, machine in enumerate((second, third)):
            port = f"port-{number}"
            first.ip("link", "add", "name", port, "type", "veth", "peer", "name", "cable", "netns", machine.name)
            first.ip("link", "set", port, "master", "cable", "up")
        for machine in (first, second, third):
            machine.ip("address", "add", f"{machine.address}/24", "dev", "cable")
            machine.ip("link", "set", "cable", "up")
        yield first, second, third


def _make(*arguments: str) -> None:
    """Make keys, which needs no machine."""
    with pytest.raises(SystemExit) as ended:
        main(["keys", *arguments])
    assert not ended.value.code


async def _router_and_agents(first: Machine, second: Machine, *, latency_s: float) -> Command:
    """Start a router here, both agents and their model there, ready to play."""
    keys = str(first.directory / "keys")
    _make("init", keys, "--host", "192.0.2.1")
    for name in AGENTS:
        _make("agent", name, keys)
        shutil.copytree(f"{keys}/agent.blue.{name}", first.directory / "copied" / name)
    copied = str(first.directory / "copied")
    router = await first.khala("router", "--listen", ROUTER, "--tls", keys, "--task", TASK, "--run", RUN, "--json")
    model = await second.khala("llm", "--port", "0", "--latency", str(latency_s), "--json")
    await router.line()
    check = await second.khala("router", "--check", "--connect", ROUTER, "--tls", copied, "--json")
    where = ("--run", RUN, "--connect", ROUTER, "--tls", copied, "--base-url", (await model.line())["base_url"])
    agents = await second.khala("agent", *AGENTS, *where, "--json")
    assert len((await check.result(READY_S))["routers"]) == 1
    await agents.said("waiting for the host")
    return agents


async def _host(first: Machine, *options: str, task: str = TASK) -> Command:
    where = ("--connect", ROUTER, "--tls", str(first.directory / "keys"), "--out", str(first.directory / "runs"))
    return await first.khala("host", task, "--run", RUN, *where, "--json", *options)


@pytest.mark.slow
async def test_agents_of_another_machine_play_a_match(machines: tuple[Machine, Machine, Machine]) -> None:
    first, second, _ = machines
    agents = await _router_and_agents(first, second, latency_s=0)
    played = await (await _host(first, "--max-steps", "10")).result(MATCH_S)

    (result,) = played["results"]
    assert result["steps"] == 10
    assert result["statuses"] == {name: {"ok": result["steps"]} for name in AGENTS}
    did = (await agents.result(END_S))["agents"]
    assert {name: (done["replies"], done["ended"]) for name, done in did.items()} == {
        name: ({"ok": result["steps"]}, "result") for name in AGENTS
    }
    assert (first.directory / "runs" / RUN / "recording.mcap").stat().st_size > 0


@pytest.mark.slow
async def test_a_match_waits_for_agents_whose_cable_is_cut(machines: tuple[Machine, Machine, Machine]) -> None:
    first, second, _ = machines
    agents = await _router_and_agents(first, second, latency_s=0.2)  # so that it happens early in the match
    host = await _host(first, "--max-wait", str(2 * MATCH_S))  # so that no deadline can end the wait
    await host.said("step 0, ")
    second.ip("link", "set", "cable", "down")
    await host.said("is away; waiting for it")
    second.ip("link", "set", "cable", "up")

    (result,) = (await host.result(MATCH_S))["results"]
    assert result["valid"]
    unasked = {name: sum(result["unasked"].get(name, {}).values()) for name in AGENTS}  # one may lose all its units
    assert result["statuses"] == {name: {"ok": result["steps"] - unasked[name]} for name in AGENTS}
    assert any("was away for" in incident for incident in result["incidents"])
    assert {done["ended"] for done in (await agents.result(END_S))["agents"].values()} == {"result"}


SPY = """
import asyncio, json, sys
from collections import Counter
from pathlib import Path
from khala_protocol.bus import Delivery
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.common_names import agent_name
from khala_protocol.joining import client_config
from khala_protocol.keys import Topic, agent_key, run_key

async def spy(router, keys, run):
    bus = await open_bus(client_config([router], tls=Path(keys), names=(agent_name("red", "Captain"),), insecure=False))
    heard = Counter()
    topics = (Topic.BRIEFING, Topic.OBSERVATION, Topic.REPLY, Topic.MESSAGE, Topic.EXCHANGE)
    wanted = [agent_key(run, side, "Captain", topic) for side in ("blue", "red") for topic in topics]

    async def listen(key):
        async for _ in await bus.subscribe(key, Delivery.LOG):
            heard[key] += 1

    listening = [asyncio.create_task(listen(key)) for key in (*wanted, run_key(run, Topic.REPORT))]
    over = await bus.subscribe(run_key(run, Topic.RESULT), Delivery.STATE)
    print(json.dumps("listening"), flush=True)
    await anext(over)
    print(json.dumps(heard))
    await bus.close()

asyncio.run(spy(*sys.argv[1:]))
"""
"""A program with the certificate of red's agent that asks for all that both agents read and write."""


@pytest.mark.slow
async def test_the_sides_of_a_duel_play_from_two_machines_and_read_nothing_of_each_other(
    machines: tuple[Machine, Machine, Machine],
) -> None:
    first, *others = machines
    keys = str(first.directory / "keys")
    _make("init", keys, "--host", "192.0.2.1")
    router = await first.khala("router", "--listen", ROUTER, "--tls", keys, "--task", DUEL, "--run", RUN, "--json")
    await router.line()
    agents = {}
    for machine, side, player in zip(others, ("blue", "red"), ("skilled", "focus-fire"), strict=True):
        _make("agent", "Captain", keys, "--side", side)
        shutil.copytree(f"{keys}/agent.{side}.Captain", first.directory / side / "own")
        where = ("--run", RUN, "--side", side, "--connect", ROUTER, "--tls", str(first.directory / side))
        agents[side] = await machine.khala("agent", "Captain", *where, "--policy", player, "--json")
        await agents[side].said("waiting for the host")
    spy = await others[1].python("-c", SPY, ROUTER, str(first.directory / "red"), RUN)
    assert await spy.line() == "listening"

    results = (await (await _host(first, task=DUEL)).result(MATCH_S))["results"]
    assert [result["side"] for result in results] == ["blue", "red"]
    assert {result["outcome"] for result in results} in ({"win", "loss"}, {"draw"})
    steps = results[0]["steps"]
    assert [result["statuses"] for result in results] == [{"Captain": {"ok": steps}}] * 2
    for agent in agents.values():
        assert (await agent.result(END_S))["agents"]["Captain"]["replies"] == {"ok": steps}
    own = f"khala/{RUN}/red/Captain"
    assert await spy.line() == {f"{own}/briefing": 1, f"{own}/observation": steps}


@pytest.mark.slow
@pytest.mark.timeout(900)
async def test_workers_play_an_experiment_and_one_that_is_killed_loses_nothing(
    machines: tuple[Machine, Machine, Machine],
) -> None:
    first, second, doomed = machines
    file = first.directory / "many.yaml"
    fixed = {"task": TASK, "max_steps": 6, "model": "skilled"}
    file.write_text(json.dumps({"name": "many", "fixed": fixed, "factors": {"task": [TASK]}, "seeds": 8}))
    head = f"{first.address}:6379"
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("RAY_AUTH_MODE", "disabled")
        out = ("--out", str(first.directory), "--json")
        runner = await first.khala("experiment", "run", str(file), "--on", "ray", "--head", head, *out)
        for machine in (second, doomed):
            await machine.khala("experiment", "join", head, "--jobs", "1")
    assert runner.process.stderr is not None
    async with asyncio.timeout(600):
        async for line in runner.process.stderr:
            if b"done in" in line:
                break
        doomed.crash()
        done = json.loads(await runner.ended(600))
    assert done["matches"] == {"done": 8}
    played = Store(first.directory / "many").matches()
    assert {match.seed for match in played.values()} == set(range(1, 9))
    assert len(list(first.directory.glob("many/matches/*/recording*.mcap"))) == 8
