"""The commands of the service: `khala serve` is one, the others ask it. `khala_sc2.cli` mounts them."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from khala_agents.cli import Trust
from khala_orchestrator.cli import Insecure, Json, Listen, Tls
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError
from khala_sc2.commands.run_options import Game, MatchOptions, MindOptions, Out, RunName, Task, with_options

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
    spares: Annotated[int, typer.Option(min=0, help="Processes for agents in each worker.", metavar="N")] = 1,
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
    """Play matches on request, several at once, until SIGTERM; running matches then play to their end.

    `khala submit` requests a match, `khala matches` lists all, `khala watch` shows one, `khala stop` ends one. With
    --tls, only a host's certificate may submit and stop matches; an observer's certificate may list and watch them.
    """
    from khala_sc2.service import commands  # noqa: PLC0415  # see there

    commands.serve(
        listen=listen or (), tls=tls, insecure=insecure, matches=matches, memory_gb=memory_gb, warm=warm, spares=spares,
        queue=queue, game=game, out=out, trust=trust, metrics=metrics, otlp=otlp, drain_s=drain_s, log_json=log_json,
        as_json=as_json,
    )  # fmt: skip


@with_options
def submit(
    task: Task = None,
    *,
    resume: Annotated[
        str | None,
        typer.Option(help="Instead of a task: resume a match that the service has recorded.", metavar="RUN"),
    ] = None,
    connect: Connect = None,
    tls: Tls = None,
    insecure: Insecure = False,
    minds: MindOptions,
    match: MatchOptions,
    run: RunName = None,
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    as_json: Json = False,
) -> None:
    """Ask a service to play a task, see `khala serve`, and print the name of the match.

    The options are those of `khala run`; keys, policies and model files come from the service's machine.
    """
    from khala_protocol.service import Submit  # noqa: PLC0415
    from khala_sc2.playing.matches import new, refuse_others  # noqa: PLC0415
    from khala_sc2.playing.minds import Minds  # noqa: PLC0415
    from khala_sc2.service import client, commands  # noqa: PLC0415  # see there

    if task is None and resume is None:
        raise ConfigError("give a task, such as 2s3z_pair (`khala tasks` lists them), or a match with --resume")
    if resume is not None:
        refuse_others(None, task=task, run=None if run == resume else run, **asdict(match))
    config = None if task is None else new(task, run, Path(), **asdict(match))
    order = Submit(
        run=config.run if config else str(resume),
        number=client.new_number(),
        owner=client.owner(),
        match=config.model_dump(mode="json", exclude={"record", "run"}) if config else {},
        minds=asdict(Minds(**minds.of_all())),
        sides=minds.of_sides(),
        resume=resume is not None,
    )
    card = commands.ask(connect, tls, insecure, ("host",), lambda bus: client.submit(bus, order))
    say(json.dumps(card.model_dump(mode="json")) if as_json else card.run)


def matches(*, connect: Connect = None, tls: Tls = None, insecure: Insecure = False, as_json: Json = False) -> None:
    """List the matches of a service: waiting, running, and recently ended."""
    from khala_sc2.service import commands  # noqa: PLC0415  # see there

    commands.matches(connect, tls=tls, insecure=insecure, as_json=as_json)


def watch(
    run: Name, *, connect: Connect = None, tls: Tls = None, insecure: Insecure = False, as_json: Json = False
) -> None:
    """Show a match of a service live, until it is over."""
    from khala_sc2.service import commands  # noqa: PLC0415  # see there

    commands.watch(run, connect, tls=tls, insecure=insecure, as_json=as_json)


def stop(
    run: Name, *, connect: Connect = None, tls: Tls = None, insecure: Insecure = False, as_json: Json = False
) -> None:
    """Stop a match of a service; its recording stays, and `khala submit --resume` continues it."""
    from khala_protocol.service import Stop  # noqa: PLC0415
    from khala_sc2.service import client, commands  # noqa: PLC0415  # see there

    order = Stop(run=run, number=client.new_number())
    card = commands.ask(connect, tls, insecure, ("host",), lambda bus: client.stop(bus, order))
    commands.end(card, as_json=as_json)
