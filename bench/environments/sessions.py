"""Measure many sessions of `khala openenv` at a time: how soon they begin, steps a second, memory of each.

    python -m bench sessions                              a table
    python -m bench sessions --clients 1 64 --seconds 5   other numbers of clients, and less time

The server is a process of its own, and so are all clients together; a session plays 2s3z without orders. `begin` is one
session after the other: how long its `reset` takes while those before it are there. `all begin` is how long it takes
until all have begun a new game that they ask for at the same time. Then all step as fast as they are answered: `steps`
a second, and the `p99` of a step, which waits for those of all other sessions. `p99 paced` is with clients that think:
together they ask for half of those steps, at times that are random. `cpu` is the processor time of the server for a
begin and a step, which a busy machine changes less. Memory is PSS: what the server has more than before its first
session, for each.
"""

from __future__ import annotations

import asyncio
import json
import random
import statistics
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import psutil
from openenv.core.generic_client import GenericEnvClient

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

CLIENTS = (1, 32, 256)
PASS = {"type": "call_tool", "tool_name": "reply", "arguments": {"text": ""}}
WAIT_S = 600.0


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--clients", type=int, nargs="+", default=CLIENTS)
    parser.add_argument("--seconds", type=float, default=20.0, help="how long to step, for each number of clients")
    given = parser.parse_args()
    found = {"rows": [of_clients(count, given.seconds) for count in given.clients]}
    if given.json:
        print(json.dumps(found))
        return
    print_table(
        ("clients", "begin p50 ms", "p99 ms", "cpu ms", "all begin s", "steps/s", "cpu ms", "p99 ms", "p99 paced ms",
         "MB each", "server MB"),
        [
            (row["clients"], f"{row['begin_p50_s'] * 1000:.0f}", f"{row['begin_p99_s'] * 1000:.0f}",
             f"{row['begin_cpu_s'] * 1000:.0f}", f"{row['all_begin_s']:.2f}", f"{row['steps_per_s']:.1f}",
             f"{row['step_cpu_s'] * 1000:.1f}", f"{row['step_p99_s'] * 1000:.0f}", f"{row['paced_p99_s'] * 1000:.0f}",
             f"{row['session_mb']:.1f}", f"{row['server_mb']:.0f}")
            for row in found["rows"]
        ],
    )  # fmt: skip


def of_clients(count: int, seconds: float) -> dict[str, Any]:
    """Return what a number of clients got from a server of its own."""
    command = [sys.executable, "-m", "khala_sc2", "openenv", "2s3z", "--port", "0", "--sessions", str(count + 1)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        address = server.stderr.readline().strip()
        try:
            return {"clients": count} | asyncio.run(measure(address, count, seconds, psutil.Process(server.pid)))
        finally:
            server.terminate()


async def measure(address: str, count: int, seconds: float, server: psutil.Process) -> dict[str, Any]:
    clients = [GenericEnvClient(address, connect_timeout_s=60, message_timeout_s=WAIT_S) for _ in range(count + 1)]
    first, *envs = clients
    try:
        await reset(first, 0)  # what is read once
        for _ in range(3):
            await step(first)
        before_mb = pss_mb(server)
        cpu_s = cpu_of(server)
        begins = [await reset(env, number) for number, env in enumerate(envs)]
        begin_cpu_s = (cpu_of(server) - cpu_s) / count
        began_s = time.monotonic()
        await asyncio.gather(*(reset(env, 1000 + number) for number, env in enumerate(envs)))
        all_begin_s = time.monotonic() - began_s
        cpu_s = cpu_of(server)
        steps = await stepping(envs, seconds)
        step_cpu_s = (cpu_of(server) - cpu_s) / len(steps)
        per_s = len(steps) / seconds
        paced = await stepping(envs, seconds, pause_s=2 * count / per_s)
        server_mb = pss_mb(server)
    finally:
        await asyncio.gather(*(env.close() for env in clients))
    return {
        "begin_p50_s": statistics.median(begins),
        "begin_p99_s": p99(begins),
        "begin_cpu_s": begin_cpu_s,
        "all_begin_s": all_begin_s,
        "steps_per_s": per_s,
        "step_cpu_s": step_cpu_s,
        "step_p99_s": p99(steps),
        "paced_p99_s": p99(paced),
        "session_mb": (server_mb - before_mb) / count,
        "server_mb": server_mb,
    }


async def reset(env: GenericEnvClient, seed: int) -> float:
    """Begin a new game, and return the seconds that it took."""
    began_s = time.monotonic()
    await env.reset(seed=seed)
    return time.monotonic() - began_s


async def step(env: GenericEnvClient) -> float:
    """Take a step, and return the seconds that it took; an episode that is over gives way to the next."""
    began_s = time.monotonic()
    is_over = (await env.step(PASS)).done
    took_s = time.monotonic() - began_s
    if is_over:
        await env.reset()
    return took_s


async def stepping(envs: Sequence[GenericEnvClient], seconds: float, pause_s: float = 0.0) -> list[float]:
    """Return the seconds of the steps that all sessions take for a while, with pauses of this mean."""
    draws = random.Random(1)
    end_s = time.monotonic() + seconds

    async def play(env: GenericEnvClient) -> list[float]:
        taken: list[float] = []
        await asyncio.sleep(draws.uniform(0, pause_s))
        while time.monotonic() < end_s or not taken:
            taken.append(await step(env))
            await asyncio.sleep(draws.expovariate(1 / pause_s) if pause_s else 0)
        return taken

    return [took_s for taken in await asyncio.gather(*map(play, envs)) for took_s in taken]


def p99(seconds: Sequence[float]) -> float:
    return sorted(seconds)[int(0.99 * (len(seconds) - 1))]


def cpu_of(process: psutil.Process) -> float:
    """Return the seconds of the processor that a process has taken."""
    times = process.cpu_times()
    return float(times.user + times.system)


def pss_mb(process: psutil.Process) -> float:
    """Return the memory of a process and its children."""
    return float(sum(each.memory_full_info().pss for each in [process, *process.children(recursive=True)])) / 1e6


def measures(found: dict[str, Any]) -> Iterator[Figure]:
    """Make figures of what `--json` prints."""
    for row in found["rows"]:
        name = f"{row['clients']} sessions"
        yield Figure(f"{name}, begin", "s", (row["begin_p50_s"],))
        yield Figure(f"{name}, processor time of a begin", "s", (row["begin_cpu_s"],))
        yield Figure(f"{name}, processor time of a step", "s", (row["step_cpu_s"],))
        yield Figure(f"{name}, all begin", "s", (row["all_begin_s"],))
        yield Figure(f"{name}, steps", "/s", (row["steps_per_s"],), "more")
        yield Figure(f"{name}, p99 of a step", "s", (row["step_p99_s"],))
        yield Figure(f"{name}, memory of each", "MB", (row["session_mb"],))
