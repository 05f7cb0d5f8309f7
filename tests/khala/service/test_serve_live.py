"""`khala serve` as a process, with real workers and games: orders, a lost worker, and both ways to end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import psutil
import pytest

from khala_protocol.bus.config import BusConfig, TlsFiles
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.certificates import certify_observer, make_authority
from khala_protocol.messages import Report
from khala_protocol.recording import Recording
from khala_protocol.service import Stop, Submit
from khala_sc2.playing.matches import new
from khala_sc2.playing.minds import Minds
from khala_sc2.service import client

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_protocol.bus import Bus
    from khala_protocol.messages import Wire
    from khala_protocol.service import MatchCard

pytestmark = [pytest.mark.game, pytest.mark.slow]

WITHIN_S = 90.0
"""Of two cores that other tests use as well."""
ENDLESS = 1000
"""Episodes: one of them is won in a second."""


class Serving:
    """A service as a process, and a client's session with it."""

    def __init__(self, process: asyncio.subprocess.Process, bus: Bus, endpoint: str) -> None:
        self.process = process
        self.bus = bus
        self.endpoint = endpoint

    async def submit(self, run: str, max_steps: int, episodes: int = 1) -> MatchCard:
        return await client.submit(self.bus, order(run, max_steps, episodes), within_s=WITHIN_S)

    async def step(self, run: str) -> None:
        """Wait until the match has played a step."""
        came = asyncio.Event()

        def see(message: Wire) -> None:
            if isinstance(message, Report):
                came.set()

        watching = asyncio.create_task(client.watch(self.bus, run, see))
        stepped = asyncio.create_task(came.wait())
        async with asyncio.timeout(WITHIN_S):
            await asyncio.wait({watching, stepped}, return_when=asyncio.FIRST_COMPLETED)
        assert came.is_set(), f"{run} ended before it was watched: {watching.result()}"
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)

    async def over(self, run: str) -> MatchCard:
        async with asyncio.timeout(WITHIN_S):
            return await client.watch(self.bus, run, lambda _: None)

    def below(self, *words: str) -> list[psutil.Process]:
        """Return the processes of the service whose command lines have all of these words."""
        family = psutil.Process(self.process.pid).children(recursive=True)
        return [process for process in family if all(word in " ".join(process.cmdline()) for word in words)]


def order(run: str, max_steps: int, episodes: int = 1) -> Submit:
    config = new("2s3z_pair", run, Path(), seed=1, episodes=episodes, assemble_s=60.0, max_steps=max_steps)
    match = config.model_dump(mode="json", exclude={"record", "run"})
    return Submit(run=run, number=client.new_number(), match=match, minds=asdict(Minds(latency_s=0.2)))


@contextlib.asynccontextmanager
async def serving(
    out: Path, *options: str, listen: str = "tcp/127.0.0.1:0", tls: TlsFiles | None = None
) -> AsyncIterator[Serving]:
    command = ("-m", "khala_sc2", "serve", "--json", "--listen", listen, "--out", str(out), *options)
    with (out / "serve.log").open("wb") as log:
        process = await asyncio.create_subprocess_exec(
            sys.executable, *command, stdout=asyncio.subprocess.PIPE, stderr=log
        )
    assert process.stdout is not None
    try:
        endpoint = json.loads(await process.stdout.readline())["endpoints"][0]
        bus = await open_bus(BusConfig(connect=(endpoint,), tls=tls))
        yield Serving(process, bus, endpoint)
        await bus.close()
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()


async def test_matches_are_played_side_by_side_and_survive_a_worker_and_the_end(tmp_path: Path) -> None:
    async with serving(tmp_path, "--matches", "2", "--warm", "2", "--log-json") as service:
        await service.submit("short", 12)
        await service.submit("long", 10_000, ENDLESS)
        await service.step("long")
        assert (await service.over("short")).state == "done"
        (worker,) = [p for p in service.below("khala_sc2.playing.worker") if _is_playing(p)]
        worker.kill()
        await service.step("long")
        card = client.find(await client.list_matches(service.bus), "long")
        assert (card.state, card.starts) == ("running", 2)
        stopped = await client.stop(service.bus, Stop(run="long", number=client.new_number()), within_s=WITHIN_S)
        assert stopped.state == "stopped"
        await service.submit("last", 8)
        ending = asyncio.create_task(service.over("last"))
        await service.step("last")
        service.process.send_signal(signal.SIGTERM)
        assert (await ending).state == "done"
        assert await service.process.wait() == 0
    for run in ("short", "long", "last"):
        assert all(Recording.open(path).complete for path in (tmp_path / run).glob("recording-2.mcap"))
    lines = [json.loads(line) for line in (tmp_path / "serve.log").read_text().splitlines() if line.startswith("{")]
    assert {line.get("run") for line in lines} >= {"short", "long", "last"}


def _is_playing(worker: psutil.Process) -> bool:
    """Return whether its spare processes have become agents: these have logs among their open files."""
    files = (file.path for process in worker.children(recursive=True) for file in process.open_files())
    return any(path.endswith("agents-0.log") for path in files)


async def test_after_kill_no_process_of_the_service_is_left(tmp_path: Path) -> None:
    async with serving(tmp_path, "--matches", "1", "--warm", "1") as service:
        await service.submit("first", 10_000, ENDLESS)
        await service.step("first")
        family = psutil.Process(service.process.pid).children(recursive=True)
        assert len(family) >= 3  # a worker, its agents and its game
        service.process.kill()
        gone, alive = await asyncio.to_thread(psutil.wait_procs, family, timeout=10)
        assert alive == []
        assert len(gone) == len(family)


async def test_with_tls_a_host_orders_and_an_observer_only_looks_on(tmp_path: Path) -> None:
    keys = tmp_path / "keys"
    _, host = make_authority(keys, ["localhost", "127.0.0.1"])
    observer = certify_observer(keys, "screen")
    port = 20_000 + os.getpid() % 10_000
    listen, options = f"tls/127.0.0.1:{port}", ("--tls", str(keys), "--warm", "0", "--matches", "1")
    async with serving(tmp_path, *options, listen=listen, tls=_files(host)) as service:
        onlooker = await open_bus(BusConfig(connect=(listen,), tls=_files(observer)))
        with pytest.raises(client.NoService, match="only the certificate of a host may give orders"):
            await client.submit(onlooker, order("theirs", 3), within_s=3)
        await service.submit("ours", 3)
        assert [card.run for card in (await client.list_matches(onlooker)).matches] == ["ours"]
        seen: list[Wire] = []
        async with asyncio.timeout(WITHIN_S):
            card = await client.watch(onlooker, "ours", seen.append)
        assert card.state == "done", card.reason
        assert any(isinstance(message, Report) for message in seen)
        await onlooker.close()


def _files(folder: Path) -> TlsFiles:
    return TlsFiles(ca=folder / "ca.pem", certificate=folder / "certificate.pem", key=folder / "key.pem")
