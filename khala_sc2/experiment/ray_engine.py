"""Plays matches on a Ray cluster: each is a Ray task with a core and its memory.

The node plays it in a process that plays many, and its recording travels back with the answer, or over an fsspec URL
that all nodes can write. Ray itself tries nothing again: a match whose node or process dies is `lost`, and the runner
plays it once more.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from khala_agents.llm.money import SUFFIX, MoneyLedger
from khala_protocol.errors import ConfigError
from khala_protocol.extras import needs
from khala_sc2.experiment.engine import MATCH_MB, MATCHES_OF_A_PROCESS, slots_of_this_machine
from khala_sc2.playing import logs, worker
from khala_sc2.playing.jobs import END_S, Ended, Job

with needs("ray", source="--on ray"):
    import fsspec  # type: ignore[import-untyped]  # it has no types
    import ray
    from ray.exceptions import RayError

    from khala_sc2.experiment.ray_limits import endpoints, gates_at
    from khala_sc2.experiment.ray_node import RETRY_S, START_S, running_head

if TYPE_CHECKING:
    from types import TracebackType

    from khala_sc2.experiment.ray_node import RayHead

MATCH_BYTES = MATCH_MB * 2**20
REACH_S = 10.0
MOST_WAITING = 64
"""Matches that are given to a cluster that machines join at any time; those that find no room wait there."""


class Ray:
    """Plays matches on the nodes of a Ray cluster."""

    def __init__(
        self,
        slots: int | None,
        *,
        game: str,
        address: str | None = None,
        head: str | None = None,
        recordings: str | None = None,
    ) -> None:
        """Take how many matches at a time, which game, and where the cluster is.

        Args:
            slots: None for as many as the cluster has room for when the engine begins.
            game: as the nodes find it.
            address: of the cluster: `HOST:PORT`, or `auto`; None for one on this machine, which ends with the engine.
            head: instead: where a cluster is begun here, `HOST:PORT`; it has no room for matches until others join it,
                and ends with the engine.
            recordings: where nodes write recordings, each in a directory with its key as name, an fsspec URL; None to
                get them over Ray.
        """
        self.slots = slots or 0
        self._game = game
        self._address = address
        self._head = head
        self._url = recordings
        self._stack = contextlib.AsyncExitStack()
        self._endpoints: Any = None

    async def __aenter__(self) -> Self:
        try:
            await self._begin()
        except BaseException:
            await self._stack.aclose()
            raise
        return self

    async def _begin(self) -> None:
        # Ray prints on stdout when a node is gone, and stdout is for the result
        self._stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        head: RayHead | None = None
        if self._head is not None:
            head = await self._stack.enter_async_context(running_head(self._head))
            self._address = self._head
            self.slots = self.slots or MOST_WAITING
        if self._address not in (None, "auto"):
            await _check(self._address)
        await self._connect_until(time.monotonic() + (START_S if head else 0.0), head)
        self.slots = self.slots or _room_of_the_cluster()
        if not self.slots:
            ray.shutdown()
            raise ConfigError(f"no node of the cluster has a core and {MATCH_MB} MB: give --jobs to say how many "
                              "matches to play at a time once one has", source=f"Ray at {self._address}")  # fmt: skip
        self._endpoints = endpoints()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        ray.shutdown()  # Ray ends what still runs with the runner, and each game its process is gone
        await self._stack.aclose()

    async def play(self, job: Job) -> Ended:
        """Play a match on a node that has room for it."""
        assert job.config.record is not None
        with MoneyLedger(job.config.record.with_suffix(SUFFIX)) as ledger:
            return await self._play(job, job.config.record, ledger)

    async def _play(self, job: Job, record: Path, ledger: MoneyLedger) -> Ended:
        """Play a match; until it is known what it has cost, it counts with all that it may spend."""
        part_usd = sum(mind.budget_usd or 0.0 for mind in job.minds.values())
        entry = ledger.hold("", part_usd, None) if part_usd else None
        playing = _match.remote(job.model_dump_json(), self._game, self._url, self._endpoints)
        try:
            ended, recording, cost_usd = await playing
        except asyncio.CancelledError:
            ray.cancel(playing)
            await asyncio.to_thread(ray.wait, [playing], timeout=END_S)  # its game ends in order
            raise
        except RayError as error:  # the node took the recording with it, and its own ledger
            return Ended(state="lost", words=f"Ray says: {str(error).strip().splitlines()[-1]}")
        if entry is not None:
            ledger.settle(entry, cost_usd)
        if isinstance(recording, str):
            recording = await asyncio.to_thread(_read, recording)
        if recording is not None:
            _write(record, recording)
        return Ended.model_validate_json(ended)

    async def _connect_until(self, end_s: float, head: RayHead | None) -> None:
        """Connect; a head that listens may still need a minute until it is a node, or die before."""
        while True:
            try:
                return self._connect()
            except ConfigError:
                if head is None or time.monotonic() > end_s:
                    raise
            await asyncio.sleep(RETRY_S)
            await head.listen()

    def _connect(self) -> None:
        ended_by = signal.getsignal(signal.SIGTERM)
        local: dict[str, Any] = {"include_dashboard": False, "num_cpus": self.slots or slots_of_this_machine()}
        options = {} if self._address else local
        try:
            ray.init(self._address or "local", log_to_driver=False, logging_level=logging.ERROR, **options)
        except Exception as error:  # a node that does not start raises no narrower one
            raise ConfigError(f"Ray did not start: {error}", source=f"--address {self._address or 'local'}") from error
        signal.signal(signal.SIGTERM, ended_by)  # Ray has set its own, which would end us in the middle


async def _check(address: str) -> None:
    """Raise `ConfigError` unless something listens there: Ray itself would wait for minutes."""
    host, colon, port = address.rpartition(":")
    if not (colon and port.isdecimal()) or "://" in host:
        raise ConfigError("give HOST:PORT, such as 10.0.0.5:6379, or auto", source=f"--address {address}")
    try:
        async with asyncio.timeout(REACH_S):
            _, writer = await asyncio.open_connection(host.strip("[]"), int(port))
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise ConfigError(
            f"there is no Ray cluster ({why}): start one with `ray start --head`", source=f"--address {address}"
        ) from None
    writer.close()


def _room_of_the_cluster() -> int:
    """Return how many matches the nodes play at the same time."""
    nodes: list[dict[str, Any]] = ray.nodes()  # type: ignore[no-untyped-call]  # by Ray
    alive = [node["Resources"] for node in nodes if node["Alive"]]
    return sum(int(min(has.get("CPU", 0), has.get("memory", 0) // MATCH_BYTES)) for has in alive)


# --- on a node ----------------------------------------------------------------------------------------


@ray.remote(num_cpus=1, memory=MATCH_BYTES, max_retries=0, max_calls=MATCHES_OF_A_PROCESS)
def _match(text: str, game: str, url: str | None, actor: Any) -> tuple[str, bytes | str | None, float]:
    """Play a match; return how it ended, its recording, or where it is, None if there is none, and what it has cost."""
    logs.set_up()
    job = Job.model_validate_json(text)
    assert job.config.record is not None
    with tempfile.TemporaryDirectory(prefix="khala-") as directory:
        here = Path(directory) / job.config.record.name
        config = job.config.model_copy(update={"record": here})
        job_here = job.model_copy(update={"config": config})
        ended = asyncio.run(worker.play(job_here, game=game, gates=gates_at(actor)))
        recording = here.read_bytes() if here.exists() else None
        with MoneyLedger(here.with_suffix(SUFFIX)) as ledger:
            cost_usd = ledger.booked_usd()
    if url is None or recording is None:
        return ended.model_dump_json(), recording, cost_usd
    place = f"{url.rstrip('/')}/{job.directory.name}/{job.config.record.name}"
    _put(place, recording)
    return ended.model_dump_json(), place, cost_usd


# --- recordings ---------------------------------------------------------------------------------------


def _put(place: str, recording: bytes) -> None:
    with fsspec.open(place, "wb", auto_mkdir=True) as file:
        file.write(recording)


def _read(place: str) -> bytes:
    with fsspec.open(place, "rb") as file:
        return bytes(file.read())


def _write(record: Path, recording: bytes) -> None:
    """Write all of a recording, or nothing."""
    part = record.with_suffix(".part")
    part.touch(0o600)  # as the host makes its own
    part.write_bytes(recording)
    part.replace(record)
