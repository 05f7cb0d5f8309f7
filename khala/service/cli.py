"""The commands of the service: `khala serve` is one, the others ask it. `khala.cli` mounts them."""

import asyncio
import contextlib
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer
from rich.table import Table
from rich.text import Text

from khala.exit_codes import DONE, FAILED, NOT_VALID
from khala.options import (
    Assemble,
    BaseUrl,
    BudgetUsd,
    Episodes,
    ExecutorName,
    Fallback,
    Game,
    Grace,
    Images,
    Latency,
    MaxSteps,
    MaxWait,
    Memory,
    Mind,
    Model,
    ModelName,
    Out,
    PolicyName,
    Rule,
    RunName,
    Seed,
    SideModel,
    Speed,
    StepLoops,
    Task,
    ThinkingLoops,
)
from khala_orchestrator.cli import Insecure, Json, Listen, Tls
from khala_orchestrator.console import Progress, stderr_console, stdout_console
from khala_protocol.bus.config import BusConfig
from khala_protocol.errors import ConfigError, NoRouter
from khala_protocol.joining import client_config, router_config
from khala_protocol.service import MatchCard, Stop, Submit
from khala_protocol.signals import stop_on_signal

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from khala.service.daemon import Listener
    from khala_protocol.bus import Bus

T = TypeVar("T")

ENDINGS_THAT_FAIL = frozenset({"failed", "refused", "stopped"})
STATES = {"running": "cyan", "done": "green", "failed": "bold red", "refused": "red", "stopped": "yellow"}

SERVE_EPILOG = """
Examples:\n
    khala serve\n
    khala serve --matches 4 --memory-gb 6 --warm 2 --metrics 9464\n
    khala serve --listen tls/0.0.0.0:7447 --tls keys --log-json\n
    khala serve --otlp http://127.0.0.1:4318
"""
SUBMIT_EPILOG = """
Examples:\n
    khala submit 2s3z_pair\n
    khala submit 2s3z_pair --model deepseek --episodes 5 --connect tls/10.0.0.5:7447 --tls keys\n
    khala submit my_task.yaml --run first && khala watch first\n
    khala submit simple64_duel --blue openai --red anthropic\n
    khala submit --resume first
"""

Connect = Annotated[
    list[str] | None,
    typer.Option(help="Endpoint of the service.", show_default="tcp/127.0.0.1:7447, with --tls tls/127.0.0.1:7447"),
]
Name = Annotated[str, typer.Argument(help="Name of the match, as `khala submit` printed it.", metavar="RUN")]


def serve(
    *,
    listen: Listen = None,
    tls: Tls = None,
    insecure: Insecure = False,
    matches: Annotated[
        int | None, typer.Option(min=1, help="Matches at once.", show_default="number of cores", metavar="N")
    ] = None,
    memory_gb: Annotated[
        float | None,
        typer.Option(min=0.1, help="Memory of all matches together.", show_default="80 % of the machine", metavar="X"),
    ] = None,
    warm: Annotated[int, typer.Option(min=0, help="Workers that wait, ready to play at once.", metavar="N")] = 1,
    spares: Annotated[
        int, typer.Option(min=0, help="Processes for agents and the scripted model in each of them.", metavar="N")
    ] = 3,
    queue: Annotated[int, typer.Option(min=0, help="Matches that may wait; more are refused.", metavar="N")] = 100,
    game: Game = "simulator",
    out: Out = Path("runs"),
    trust: Annotated[
        bool, typer.Option("--trust", help="Let matches name code and addresses: policies, base URLs, model files.")
    ] = False,
    metrics: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Port for Prometheus, on this machine.", metavar="PORT")
    ] = None,
    otlp: Annotated[
        str | None,
        typer.Option(help="Send traces to this OpenTelemetry collector, over HTTP.", metavar="URL"),
    ] = None,
    drain_s: Annotated[
        float, typer.Option(min=0, help="After SIGTERM, seconds until matches that still run are stopped.")
    ] = 600.0,
    log_json: Annotated[bool, typer.Option("--log-json", help="Log JSON, one object a line.")] = False,
    as_json: Json = False,
) -> None:
    """Play matches on order, several at once, until SIGTERM: then those that run come to their end.

    `khala submit` orders a match, `khala matches` lists them, `khala watch` shows one, `khala stop` ends one. With
    --tls only the certificate of a host may order and stop; one of an observer lists and watches.
    """
    from khala.service import logs, memory  # noqa: PLC0415  # PySC2 takes a second that --help need not wait for
    from khala.service.book import Limits  # noqa: PLC0415
    from khala_protocol.access import service_settings  # noqa: PLC0415

    logs.set_up(as_json=log_json)
    memory_mb = int(memory_gb * 1024) if memory_gb else memory.machine_mb() * 8 // 10
    limits = Limits(matches or os.cpu_count() or 1, memory_mb, queue, trusts=trust)
    config = router_config(listen or (), tls=tls, insecure=insecure, rules=service_settings() if tls else None)
    arguments = ["--game", game, "--spares", str(spares), *(["--log-json"] if log_json else [])]
    traced = otlp is not None or any(name.startswith("OTEL_EXPORTER_OTLP") for name in os.environ)
    asyncio.run(_serve(config, limits, out, drain_s, warm, arguments, metrics, otlp, traced=traced, as_json=as_json))


async def _serve(
    config: BusConfig,
    limits: Any,
    out: Path,
    drain_s: float,
    warm: int,
    arguments: list[str],
    metrics: int | None,
    otlp: str | None,
    *,
    traced: bool,
    as_json: bool,
) -> None:
    from khala.local_bus import local_endpoint  # noqa: PLC0415
    from khala.service import memory  # noqa: PLC0415
    from khala.service.daemon import Service  # noqa: PLC0415
    from khala.service.pool import Pool, Worker  # noqa: PLC0415
    from khala_protocol.bus.zenoh import open_bus  # noqa: PLC0415

    stop = stop_on_signal()
    async with contextlib.AsyncExitStack() as stack:
        socket = stack.enter_context(local_endpoint())
        bus = await open_bus(config.model_copy(update={"listen": (*config.listen_on, socket)}))
        stack.push_async_callback(bus.close)
        listeners, port = _listeners(stack, metrics, otlp, traced=traced)
        pool = await stack.enter_async_context(Pool(warm, lambda: Worker.start(arguments)))
        service = Service(
            bus, BusConfig(connect=(socket,)), pool.take, out, limits, drain_s, listeners, exchanges=traced,
            used_mb=lambda: memory.rss_mb(os.getpid()),
        )  # fmt: skip
        endpoints = [one for one in bus.endpoints if one != socket]
        about = {"endpoints": endpoints, "matches": limits.matches, "memory_mb": limits.memory_mb, "metrics_port": port}
        if as_json:
            typer.echo(json.dumps(about))
        words = f"service at {', '.join(endpoints)}: {limits.matches} matches at once; Ctrl-C ends it"
        stderr_console().print(words, soft_wrap=True)
        await service.run(stop)


def _listeners(
    stack: contextlib.AsyncExitStack, metrics: int | None, otlp: str | None, *, traced: bool
) -> "tuple[list[Listener], int | None]":
    listeners: list[Listener] = []
    port = None
    if metrics is not None:
        from khala.service.metrics import Metrics  # noqa: PLC0415

        counted = Metrics()
        port = counted.serve(metrics)
        listeners.append(counted)
    if traced:
        from khala.service import traces  # noqa: PLC0415  # 0.2 s

        spans = traces.Traces(traces.otlp(otlp))
        stack.callback(spans.close)
        listeners.append(spans)
    return listeners, port


def submit(
    task: Task = None,
    *,
    resume: Annotated[
        str | None,
        typer.Option(help="Instead of a task: go on with a match that the service has a recording of.", metavar="RUN"),
    ] = None,
    connect: Connect = None,
    tls: Tls = None,
    insecure: Insecure = False,
    model: Model = "scripted",
    model_name: ModelName = None,
    base_url: BaseUrl = None,
    policy: PolicyName = None,
    fallback: Fallback = None,
    blue: Mind = None,
    red: Mind = None,
    side_model: SideModel = None,
    budget_usd: BudgetUsd = None,
    latency: Latency = 0.2,
    seed: Seed = None,
    episodes: Episodes = None,
    executor: ExecutorName = None,
    clock: Rule = None,
    max_wait: MaxWait = None,
    step_loops: StepLoops = None,
    thinking_loops: ThinkingLoops = None,
    speed: Speed = None,
    grace: Grace = None,
    max_steps: MaxSteps = None,
    memory: Memory = None,
    images: Images = None,
    run: RunName = None,
    assemble: Assemble = 60.0,
    as_json: Json = False,
) -> None:
    """Have a service play a task, see `khala serve`, and print the name of the match.

    Options are those of `khala run`; keys, policies and model files are those of the service's machine.
    """
    from khala.matches import new, refuse_others  # noqa: PLC0415
    from khala.minds import Minds, named_sides  # noqa: PLC0415
    from khala.service import client  # noqa: PLC0415

    if task is None and resume is None:
        raise ConfigError("give a task, such as 2s3z_pair (`khala tasks` lists them), or a match with --resume")
    given: dict[str, Any] = {
        "seed": seed, "episodes": episodes, "executor": executor, "rule": clock, "max_wait_s": max_wait,
        "step_loops": step_loops, "thinking_loops": thinking_loops, "speed": speed, "grace_s": grace,
        "max_steps": max_steps, "memory": memory, "images": images,
    }  # fmt: skip
    if resume is not None:
        refuse_others(None, task=task, run=None if run == resume else run, **given)
    config = None if task is None else new(task, run, Path(), assemble_s=assemble, **given)
    order = Submit(
        run=config.run if config else str(resume),
        number=client.new_number(),
        owner=client.owner(),
        match=config.model_dump(mode="json", exclude={"record", "run"}) if config else {},
        minds=asdict(Minds(model, model_name, base_url, policy, budget_usd, latency, fallback)),
        sides=named_sides(side_model or (), blue=blue, red=red),
        resume=resume is not None,
    )
    card = _ask(connect, tls, insecure, ("host",), lambda bus: client.submit(bus, order))
    typer.echo(json.dumps(card.model_dump(mode="json")) if as_json else card.run)


def matches(*, connect: Connect = None, tls: Tls = None, insecure: Insecure = False, as_json: Json = False) -> None:
    """List the matches of a service: those that wait, those that run, and the last that are over."""
    from khala.service import client  # noqa: PLC0415

    found = _ask(connect, tls, insecure, ("host", "observer"), client.listed)
    if as_json:
        typer.echo(json.dumps(found.model_dump(mode="json", exclude={"v", "run", "kind"})))
        return
    table = Table(box=None, pad_edge=False)
    for name in ("match", "task", "owner", "state", "progress", "result"):
        table.add_column(name, overflow="fold")
    for card in found.matches:
        progress = f"step {card.step} of episode {card.episode + 1}/{card.episodes}" if card.step else ""
        result = ", ".join(card.outcomes) or card.reason
        state = Text(card.state, STATES.get(card.state, ""))
        table.add_row(*map(Text, (card.run, card.task, card.owner)), state, progress, Text(result))
    stdout_console().print(table)


def watch(
    run: Name, *, connect: Connect = None, tls: Tls = None, insecure: Insecure = False, as_json: Json = False
) -> None:
    """Show a match of a service live, until it is over."""
    from khala.service import client  # noqa: PLC0415

    with Progress(stderr_console()) as progress:
        card = _ask(connect, tls, insecure, ("host", "observer"), lambda bus: client.watch(bus, run, progress))
    _end(card, as_json=as_json)
    raise typer.Exit(_exit_code(card))


def _exit_code(card: MatchCard) -> int:
    if card.state in ENDINGS_THAT_FAIL:
        return FAILED
    return NOT_VALID if card.reason else DONE  # a match that is done has a reason only if it is not valid


def stop(
    run: Name, *, connect: Connect = None, tls: Tls = None, insecure: Insecure = False, as_json: Json = False
) -> None:
    """Stop a match of a service; its recording stays, and `khala submit --resume` goes on with it."""
    from khala.service import client  # noqa: PLC0415

    order = Stop(run=run, number=client.new_number())
    _end(_ask(connect, tls, insecure, ("host",), lambda bus: client.stop(bus, order)), as_json=as_json)


def _end(card: MatchCard, *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(card.model_dump(mode="json")))
    else:
        words = ": ".join(filter(None, (f"{card.run} {card.state}", ", ".join(card.outcomes), card.reason)))
        stderr_console().print(words, soft_wrap=True)


def _ask(
    connect: list[str] | None,
    tls: Path | None,
    insecure: bool,  # an option, passed on
    names: tuple[str, ...],
    ask: "Callable[[Bus], Coroutine[Any, Any, T]]",
) -> T:
    from khala.service.client import NoService  # noqa: PLC0415
    from khala_protocol.bus.zenoh import open_bus  # noqa: PLC0415  # loads the native library

    config = client_config(connect or (), tls=tls, names=names, insecure=insecure)

    async def asked() -> T:
        try:
            bus = await open_bus(config)
        except NoRouter as error:
            raise NoService(f"{error.found}: `khala serve` starts a service, --connect says where one is") from None
        try:
            return await ask(bus)
        finally:
            await bus.close()

    return asyncio.run(asked())
