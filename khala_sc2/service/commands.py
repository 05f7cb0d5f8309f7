"""The work of `khala serve` and of the commands that ask it.

`khala_sc2.service.cli` above has the options. It imports this module only to run a command: the bus and the messages take
half a second to import, and `--help` need not wait for that.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
from typing import TYPE_CHECKING, Any, TypeVar

import typer
from rich.table import Table
from rich.text import Text

from khala_orchestrator.console import Progress, print_table, stderr_console
from khala_protocol.access import service_settings
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.errors import NoRouter
from khala_protocol.joining import client_config, router_config
from khala_protocol.signals import stop_on_signal
from khala_protocol.trust import trust_files
from khala_sc2.commands.exit_codes import DONE, FAILED, NOT_VALID
from khala_sc2.playing import logs
from khala_sc2.playing.jobs import MatchWorker
from khala_sc2.playing.local_bus import local_endpoint
from khala_sc2.service import client, memory
from khala_sc2.service.book import Limits
from khala_sc2.service.daemon import Service
from khala_sc2.service.pool import Pool

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable, Sequence
    from pathlib import Path

    from khala_protocol.bus import Bus
    from khala_protocol.service import MatchCard
    from khala_sc2.service.daemon import MatchListener

T = TypeVar("T")

ENDINGS_THAT_FAIL = frozenset({"failed", "refused", "stopped"})
STATES = {"running": "cyan", "done": "green", "failed": "bold red", "refused": "red", "stopped": "yellow"}


def serve(
    *,
    listen: Sequence[str],
    tls: Path | None,
    insecure: bool,
    matches: int | None,
    memory_gb: float | None,
    warm: int,
    spares: int,
    queue: int,
    game: str,
    out: Path,
    trust: bool,
    metrics: int | None,
    otlp: str | None,
    drain_s: float,
    log_json: bool,
    as_json: bool,
) -> None:
    """Play matches on order until a signal arrives."""
    logs.set_up(as_json=log_json)
    logging.getLogger("khala_sc2.service").setLevel(logging.INFO)
    memory_mb = int(memory_gb * 1024) if memory_gb else memory.machine_mb() * 8 // 10
    trust_files(trust)  # and its workers
    limits = Limits(matches or os.cpu_count() or 1, memory_mb, queue, trusts=trust)
    config = router_config(listen, tls=tls, insecure=insecure, rules=service_settings() if tls else None)
    options = ["--live", "--game", game, "--spares", str(spares), *(["--log-json"] if log_json else [])]
    traced = otlp is not None or any(name.startswith("OTEL_EXPORTER_OTLP") for name in os.environ)
    asyncio.run(_serve(config, limits, out, drain_s, warm, options, metrics, otlp, traced=traced, as_json=as_json))


async def _serve(
    config: BusConfig,
    limits: Limits,
    out: Path,
    drain_s: float,
    warm: int,
    options: list[str],
    metrics: int | None,
    otlp: str | None,
    *,
    traced: bool,
    as_json: bool,
) -> None:
    stop = stop_on_signal()
    async with contextlib.AsyncExitStack() as stack:
        socket = stack.enter_context(local_endpoint())
        bus = await open_bus(config.model_copy(update={"listen": (*config.listen_on, socket)}))
        stack.push_async_callback(bus.close)
        listeners, port = await _listeners(stack, metrics, otlp, traced=traced)
        pool = await stack.enter_async_context(Pool(warm, lambda: MatchWorker.start(*options)))
        service = Service(
            bus, BusConfig(connect=(socket,)), pool.take, out, limits, drain_s, listeners, exchanges=traced,
            used_mb=lambda: memory.rss_mb(os.getpid()),
        )  # fmt: skip
        endpoints = [endpoint for endpoint in bus.endpoints if endpoint != socket]
        about = {"endpoints": endpoints, "matches": limits.matches, "memory_mb": limits.memory_mb, "metrics_port": port}
        if as_json:
            typer.echo(json.dumps(about))
        words = f"service at {', '.join(endpoints)}: {limits.matches} matches at once; Ctrl-C ends it"
        stderr_console().print(words, soft_wrap=True)
        await service.run(stop)


async def _listeners(
    stack: contextlib.AsyncExitStack, metrics: int | None, otlp: str | None, *, traced: bool
) -> tuple[list[MatchListener], int | None]:
    listeners: list[MatchListener] = []
    port = None
    if metrics is not None:
        from khala_sc2.service.metrics import Metrics  # noqa: PLC0415

        counted = Metrics()
        port = await stack.enter_async_context(counted.serve(metrics))
        listeners.append(counted)
    if traced:
        from khala_sc2.service import traces  # noqa: PLC0415  # 0.2 s

        spans = traces.Traces(traces.otlp(otlp))
        stack.callback(spans.close)
        listeners.append(spans)
    return listeners, port


def matches(connect: list[str] | None, *, tls: Path | None, insecure: bool, as_json: bool) -> None:
    """Print the matches of a service."""
    found = ask(connect, tls, insecure, ("host", "observer"), client.list_matches)
    if as_json:
        typer.echo(json.dumps(found.model_dump(mode="json", exclude={"v", "run", "kind"})))
        return
    print_table(table_of(found.matches))


def table_of(cards: Iterable[MatchCard]) -> Table:
    """Return matches as a table; where it is narrow, other columns fold, so that the name of a task stays whole."""
    table = Table(box=None, pad_edge=False)
    for name in ("match", "task", "owner", "state", "progress", "result"):
        table.add_column(name, overflow="fold", no_wrap=name in ("task", "state"))
    for card in cards:
        progress = f"step {card.step} of episode {card.episode + 1}/{card.episodes}" if card.step else ""
        result = ", ".join(card.outcomes) or card.reason
        state = Text(card.state, STATES.get(card.state, ""))
        table.add_row(card.run, card.task, card.owner, state, progress, result)
    return table


def watch(run: str, connect: list[str] | None, *, tls: Path | None, insecure: bool, as_json: bool) -> None:
    """Show a match live until it is over, and exit as its end says."""
    with Progress(stderr_console()) as progress:
        card = ask(connect, tls, insecure, ("host", "observer"), lambda bus: client.watch(bus, run, progress))
    end(card, as_json=as_json)
    raise typer.Exit(exit_code(card))


def exit_code(card: MatchCard) -> int:
    """Return the exit code for how a match ended."""
    if card.state in ENDINGS_THAT_FAIL:
        return FAILED
    return NOT_VALID if card.reason else DONE  # a match that is done has a reason only if it is not valid


def end(card: MatchCard, *, as_json: bool) -> None:
    """Print how a match stands."""
    if as_json:
        typer.echo(json.dumps(card.model_dump(mode="json")))
    else:
        words = ": ".join(filter(None, (f"{card.run} {card.state}", ", ".join(card.outcomes), card.reason)))
        stderr_console().print(words, soft_wrap=True)


def ask(
    connect: list[str] | None,
    tls: Path | None,
    insecure: bool,  # an option, passed on
    names: tuple[str, ...],
    question: Callable[[Bus], Coroutine[Any, Any, T]],
) -> T:
    """Return what a service answers.

    Raises:
        NoService: there is none.
    """
    config = client_config(connect or (), tls=tls, names=names, insecure=insecure)

    async def connect_and_ask() -> T:
        try:
            bus = await open_bus(config)
        except NoRouter as error:
            raise client.NoService(
                f"{error.found}: `khala serve` starts a service, --connect says where one is"
            ) from None
        try:
            return await question(bus)
        finally:
            await bus.close()

    return asyncio.run(connect_and_ask())
