"""Measure the server of OpenEnv: sessions and steps a second with 1, 8 and 32 clients, and memory.

    python -m bench openenv                              a table
    python -m bench openenv --clients 1 8 --steps 5      fewer clients, shorter episodes

The server is `khala openenv` in a process of its own, and each client has a session. `sessions` are whole
ones a second: a client connects, begins an episode of 2s3z with a seed, plays some steps without orders,
disconnects, and begins again. The start of a game is in it, and most of it. `steps` are those a second of all
clients together while their games run on from episode to episode. Memory is PSS, in which pages that
processes share count once: of the server, and of a game, at their highest.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import psutil
from openenv.core.generic_client import GenericEnvClient

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator

CLIENTS = (1, 8, 32)
LOOK_S = 0.25


@dataclass(slots=True)
class Counts:
    """What all clients have done."""

    sessions: int = 0
    reset_s: list[float] = field(default_factory=list)
    step_s: list[float] = field(default_factory=list)


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--clients", type=int, nargs="+", default=CLIENTS)
    parser.add_argument("--steps", type=int, default=10, help="of an episode")
    parser.add_argument("--seconds", type=float, default=20.0, help="how long to measure each number of clients")
    given = parser.parse_args()
    found = {"steps": given.steps, "rows": [of_clients(count, given.steps, given.seconds) for count in given.clients]}
    if given.json:
        print(json.dumps(found))
        return
    print_table(
        ("clients", "sessions/s", "steps/s", "reset p50 s", "step p50 ms", "server MB", "a game MB"),
        [
            (row["clients"], f"{row['sessions_per_s']:.2f}", f"{row['steps_per_s']:.1f}", f"{row['reset_p50_s']:.2f}",
             f"{row['step_p50_s'] * 1000:.1f}", f"{row['server_mb']:.0f}", f"{row['game_mb']:.0f}")
            for row in found["rows"]
        ],
    )  # fmt: skip


def of_clients(count: int, steps: int, seconds: float) -> dict[str, Any]:
    """Return what a number of clients got from a server of its own."""
    command = [sys.executable, "-m", "khala_sc2", "openenv", "2s3z", "--port", "0", "--sessions", str(count)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        address = server.stderr.readline().strip()
        try:
            return {"clients": count} | asyncio.run(measure(address, count, steps, seconds, psutil.Process(server.pid)))
        finally:
            server.terminate()


async def measure(address: str, count: int, steps: int, seconds: float, server: psutil.Process) -> dict[str, Any]:
    counts = Counts()
    watching = asyncio.create_task(highest(server))
    began_s = time.monotonic()
    end_s = began_s + seconds
    await asyncio.gather(*(client(address, number, steps, end_s, counts) for number in range(count)))
    took_s = time.monotonic() - began_s
    watching.cancel()
    server_mb, game_mb = await watching  # which returns when it is cancelled
    return {
        "sessions_per_s": counts.sessions / took_s,
        "steps_per_s": await steady(address, count, seconds),
        "reset_p50_s": statistics.median(counts.reset_s),
        "step_p50_s": statistics.median(counts.step_s),
        "server_mb": server_mb,
        "game_mb": game_mb,
    }


async def client(address: str, number: int, steps: int, end_s: float, counts: Counts) -> None:
    """Play sessions, at least one."""
    seed = number
    while not counts.sessions or time.monotonic() < end_s:
        async with GenericEnvClient(address, connect_timeout_s=60, message_timeout_s=300) as env:
            before_s = time.monotonic()
            await env.reset(seed=seed, max_steps=steps)
            counts.reset_s.append(time.monotonic() - before_s)
            done = False
            while not done:
                before_s = time.monotonic()
                done = (await env.step({"reply": ""})).done
                counts.step_s.append(time.monotonic() - before_s)
        counts.sessions += 1
        seed += 1000


async def steady(address: str, count: int, seconds: float) -> float:
    """Return the steps a second of games that all run."""
    envs = [GenericEnvClient(address, connect_timeout_s=60, message_timeout_s=300) for _ in range(count)]
    try:
        await asyncio.gather(*(env.reset(seed=number) for number, env in enumerate(envs)))
        began_s = time.monotonic()
        taken = await asyncio.gather(*(stepping(env, began_s + seconds / 2) for env in envs))
        return sum(taken) / (time.monotonic() - began_s)
    finally:
        await asyncio.gather(*(env.close() for env in envs))


async def stepping(env: GenericEnvClient, end_s: float) -> int:
    """Return the number of steps that a session takes until a time; one that is over begins its next episode."""
    steps = 0
    while time.monotonic() < end_s:
        steps += 1
        if (await env.step({"reply": ""})).done:
            await env.reset()
    return steps


async def highest(server: psutil.Process) -> tuple[float, float]:
    """Return the highest memory of the server and of a game, in MB, when it is cancelled."""
    server_mb = game_mb = 0.0
    try:
        while True:
            server_mb = max(server_mb, pss_mb(server))
            games = [pss_mb(child) for child in server.children(recursive=True)]
            game_mb = max(game_mb, sum(games) / max(len(games), 1))
            await asyncio.sleep(LOOK_S)
    except asyncio.CancelledError:
        return server_mb, game_mb


def pss_mb(process: psutil.Process) -> float:
    try:
        return float(process.memory_full_info().pss) / 1e6
    except psutil.Error:  # it has ended
        return 0.0


def measures(found: dict[str, Any]) -> Iterator[Figure]:
    """Make figures of what `--json` prints."""
    for row in found["rows"]:
        name = f"{row['clients']} clients"
        yield Figure(f"{name}, sessions", "/s", (row["sessions_per_s"],), "more")
        yield Figure(f"{name}, steps", "/s", (row["steps_per_s"],), "more")
        yield Figure(f"{name}, memory of the server", "MB", (row["server_mb"],))
        yield Figure(f"{name}, memory of a game", "MB", (row["game_mb"],))
