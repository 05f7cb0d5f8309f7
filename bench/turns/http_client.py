"""Measure requests to a model on this machine: many at once on one loop, each over its own client.

The endpoint is `khala llm` in its own process, on the same cores. It compares a plain `httpx.AsyncClient`, one
over the transport that agents use, and an agent's whole client (prompt to bytes, bytes to completion). Medians of the
rounds after the first; CPU time is that of this process alone.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import time
from contextlib import AsyncExitStack
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import httpx

from bench.command_line import make_parser
from bench.tables import print_table
from bench.turns.endpoint import endpoint
from khala_agents.llm.client import Request
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.llm.transport import AiohttpTransport
from khala_protocol.garbage import tidy_memory
from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

LATENCY_S = 0.3
PROMPT = (ChatMessage(role="system", content="s" * 5000), ChatMessage(role="user", content="Game\n" * 2000))
BODY = json.dumps({"model": "silent", "messages": [{"role": m.role, "content": m.content} for m in PROMPT]}).encode()
TIMEOUT = httpx.Timeout(connect=5.0, write=30.0, read=None, pool=None)
LIMITS = httpx.Limits(max_connections=None, max_keepalive_connections=2, keepalive_expiry=120.0)


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    client: str
    calls_at_once: int
    over_latency_ms: float
    cpu_ms_per_call: float


async def measure(name: str, calls: list[Callable[[], Awaitable[object]]], rounds: int) -> Row:
    wall, cpu = [], []
    for _ in range(rounds + 1):
        began = time.perf_counter()
        used = time.process_time()
        await asyncio.gather(*(call() for call in calls))
        wall.append(time.perf_counter() - began - LATENCY_S)
        cpu.append((time.process_time() - used) / len(calls))
    return Row(name, len(calls), statistics.median(wall[1:]) * 1e3, statistics.median(cpu[1:]) * 1e3)


async def compare(base_url: str, count: int, rounds: int) -> list[Row]:
    tls = httpx.create_ssl_context()
    url = f"{base_url}/chat/completions"
    rows = []

    async def post(client: httpx.AsyncClient) -> None:
        response = await client.post(url, content=BODY)
        response.raise_for_status()

    kinds: dict[str, Callable[[], httpx.AsyncClient]] = {
        "httpx": lambda: httpx.AsyncClient(verify=tls, limits=LIMITS, timeout=TIMEOUT, trust_env=False),
        "httpx over our transport": lambda: httpx.AsyncClient(
            transport=AiohttpTransport(tls), timeout=TIMEOUT, trust_env=False
        ),
    }
    for name, make in kinds.items():
        async with AsyncExitStack() as stack:
            clients = [await stack.enter_async_context(make()) for _ in range(count)]
            rows.append(await measure(name, [lambda c=c: post(c) for c in clients], rounds))  # type: ignore[misc]  # bound
    models = [
        OpenAICompatible(PROFILES["scripted"], model="silent", base_url=base_url, prices=Prices()) for _ in range(count)
    ]
    asked = Request(PROMPT, timeout_s=30.0)
    rows.append(await measure("an agent's client", [lambda m=m: m.complete(asked) for m in models], rounds))  # type: ignore[misc]  # bound
    await asyncio.gather(*(model.close() for model in models))
    return rows


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--calls", type=int, nargs="+", default=[1, 8, 32, 128], help="requests at once")
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    with endpoint(LATENCY_S) as base_url:
        tidy_memory()
        rows = [row for count in options.calls for row in asyncio.run(compare(base_url, count, options.rounds))]
    if options.json:
        print(json.dumps({"latency_s": LATENCY_S, "prompt_bytes": len(BODY), "rows": [asdict(row) for row in rows]}))
        return
    print_table(
        ("client", "at once", "over latency, ms", "CPU a call, ms"),
        [(row.client, row.calls_at_once, f"{row.over_latency_ms:.1f}", f"{row.cpu_ms_per_call:.2f}") for row in rows],
    )
