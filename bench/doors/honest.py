"""How long honest clients of the HTTP doors wait while others attack.

    python -m bench doors.honest                two seconds calm and two under attack for each server
    python -m bench doors.honest --seconds 10

The attackers are a process of their own: eight connections that send requests of foreign pages, of foreign names and
with wrong tokens, one after the other, and 100 connections that say nothing. The honest client asks a hundred times a
second, at most.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bench.command_line import make_parser
from bench.doors.http_doors import SERVERS, Target, send
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

ATTACKERS, SILENT = 8, 100
EVERY_S: Final = 0.01
ATTACK: Final = """
import asyncio, sys
port = int(sys.argv[1])
HEADS = [
    f"GET /?token=wrong HTTP/1.1\\r\\nHost: 127.0.0.1:{port}\\r\\n\\r\\n",
    f"POST /step HTTP/1.1\\r\\nHost: 127.0.0.1:{port}\\r\\nOrigin: http://evil\\r\\nContent-Length: 0\\r\\n\\r\\n",
    "GET / HTTP/1.1\\r\\nHost: evil.example\\r\\n\\r\\n",
]
async def attack(place):
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(HEADS[place % 3].encode())
            await reader.read(100)
            writer.close()
        except OSError:
            pass
        place += 1
async def main():
    silent = [await asyncio.open_connection("127.0.0.1", port) for _ in range(int(sys.argv[3]))]
    await asyncio.gather(*(attack(place) for place in range(int(sys.argv[2]))))
asyncio.run(main())
"""


async def measure(name: str, seconds: float, directory: Path) -> tuple[str, ...]:
    """Return a row: median and 95th percentile of an honest request in ms, calm and under attack, and failures."""
    async with SERVERS[name](directory) as target:
        calm, _ = await _ask(target, seconds)
        attacker = await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-c", ATTACK, str(target.port), str(ATTACKERS), str(SILENT)
        )
        try:
            await _ask(target, 0.5)
            attacked, failed = await _ask(target, seconds)
        finally:
            with contextlib.suppress(ProcessLookupError):
                attacker.kill()
            await attacker.wait()
    return (name, *_quantiles(calm), *_quantiles(attacked), f"{failed} of {len(attacked)}")


async def _ask(target: Target, seconds: float) -> tuple[list[float], int]:
    """Ask for so long; return the times in seconds, and how many requests were not answered with 200."""
    times: list[float] = []
    failed = 0
    end = time.perf_counter() + seconds
    while (began := time.perf_counter()) < end:
        failed += await send(target) != 200
        times.append(time.perf_counter() - began)
        await asyncio.sleep(max(EVERY_S - times[-1], 0))
    return times, failed


def _quantiles(times: Sequence[float]) -> tuple[str, str]:
    cuts = statistics.quantiles(times, n=20)
    return f"{1000 * cuts[9]:.1f}", f"{1000 * cuts[18]:.1f}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("--seconds", type=float, default=2.0, help="of each measurement")
    given = parser.parse_args(arguments)
    logging.disable(logging.ERROR)
    names = [name for name in SERVERS if name != "khala mcp"]  # a seat has one client, and refuses all others
    with tempfile.TemporaryDirectory(prefix="khala-honest-") as directory:
        rows = [asyncio.run(measure(name, given.seconds, Path(directory))) for name in names]
    print_table(
        {"server": "left", "calm, median ms": "right", "95 %": "right", "attacked, median ms": "right",
         "95 % ": "right", "failed": "right"},
        rows,
    )  # fmt: skip
    return 0
