"""The commands `khala router`, `khala tasks` and `khala replay`, as plain functions that `khala.cli` mounts.

A mistake of the user is raised as a `khala_protocol.errors.KhalaError` of one sentence; `khala.cli` prints it.
"""

import asyncio
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.padding import Padding
from rich.text import Text

from khala_bridge.task.config import TaskConfig
from khala_orchestrator.config import all_tasks, load_task
from khala_orchestrator.console import stderr_console, stdout_console
from khala_protocol.bus.config import BusConfig
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.joining import client_config, router_config
from khala_protocol.signals import stop_on_signal

if TYPE_CHECKING:
    from khala_protocol.recording import Recording

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout, everything else on stderr.")]
Listen = Annotated[
    list[str] | None,
    typer.Option(
        help="Endpoint to listen on; may be given several times.",
        show_default="tcp/127.0.0.1:7447, with --tls tls/127.0.0.1:7447",
    ),
]
Tls = Annotated[
    Path | None,
    typer.Option(
        envvar="KHALA_TLS", help="Encrypt, with the certificates in this directory, see `khala keys`.", metavar="DIR"
    ),
]
Insecure = Annotated[
    bool, typer.Option("--insecure", help="Allow links to other machines without TLS: in your own network only.")
]

CHECK_S = 2.0

ROUTER_EPILOG = """
Examples:\n
    khala router\n
    khala router --tls keys --task 2s3z_pair --listen tls/0.0.0.0:7447\n
    khala router --listen tcp/0.0.0.0:7447 --insecure\n
    khala router --check --connect tcp/10.0.0.5:7447
"""
REPLAY_EPILOG = """
Examples:\n
    khala replay runs/2s3z-20260101-120000-ab12/recording.mcap\n
    khala replay recording.mcap --agent Stalkers --steps 10-20 --text\n
    khala replay recording.mcap --steps 7 --images pictures\n
    khala replay recording.mcap --pace\n
    khala replay torn.mcap --recover whole.mcap
"""


def router(
    *,
    listen: Listen = None,
    tls: Tls = None,
    task: Annotated[
        list[str] | None,
        typer.Option(help="With --tls: a task whose agents may join; may be given several times.", metavar="TASK"),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option(envvar="KHALA_RUN", help="With --tls: the only run that may be played.", metavar="NAME"),
    ] = None,
    insecure: Insecure = False,
    check: Annotated[bool, typer.Option("--check", help="Ask whether a router answers, and end.")] = False,
    connect: Annotated[
        str | None,
        typer.Option(
            help="With --check: the endpoint to ask.",
            metavar="ENDPOINT",
            show_default="tcp/127.0.0.1:7447, with --tls tls/127.0.0.1:7447",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Join hosts and agents: a Zenoh router, until Ctrl-C.

    It is needed when host and agents are on several machines; `khala run` has its own. With --tls it lets in who has
    a certificate, and each may read and write only what its name stands for in the task.
    """
    if check:
        config = client_config([connect] if connect else [], tls=tls, insecure=insecure, timeout_s=CHECK_S)
        routers = asyncio.run(_probe(config))
        (endpoint,) = config.connect_to
        _out({"endpoint": endpoint, "routers": routers}, f"a router answers at {endpoint}", as_json=as_json)
        return
    if tls and not task:
        raise ConfigError("with --tls the agents that may join are those of a task: give --task TASK")
    rules = access_rules([load_task(name) for name in task or ()], run) if tls else None
    config = router_config(listen or (), tls=tls, insecure=insecure, rules=rules)
    asyncio.run(_route(config, as_json=as_json))


def access_rules(tasks: Sequence[TaskConfig], run: str | None) -> dict[str, Any]:
    """Return the settings of a router that the agents and advisers of these tasks may join."""
    from khala_protocol.access import router_settings  # noqa: PLC0415  # 60 ms, which links without TLS do without

    sides = [side for task in tasks for side in task.per_side()]
    agents = {(side.side, agent.name) for side in sides for agent in side.agents}
    advisers = {(side.side, adviser.name) for side in sides for adviser in side.advisers}
    return router_settings(agents, run, advisers=advisers)


def tasks(*, as_json: Json = False) -> None:
    """List what can be played."""
    found = list(all_tasks())
    if as_json:
        rows = [
            {
                "name": t.name,
                "map": t.map_spec.name,
                "agents": [card.name for card in t.cards()],
                "opponent": t.against,
                "description": t.description,
            }
            for t in found
        ]
        typer.echo(json.dumps({"tasks": rows}))
        return
    console = stdout_console()
    for task in found:
        names = dict.fromkeys(card.name for card in task.cards())  # those of two sides may have the same
        console.print(Text.assemble((task.name, "bold"), "  ", (people(list(names)), "dim")))
        console.print(Padding(task.description, (0, 0, 0, 4), expand=False))


def people(names: Sequence[str]) -> str:
    """Return the names of agents, grouping those that only differ by a number: `Commander, CombatGroup1 2 5`."""
    groups: dict[str, list[str]] = {}
    for name in names:
        stem = name.rstrip("0123456789")
        groups.setdefault(stem, []).append(name.removeprefix(stem))
    return ", ".join(f"{stem}{' '.join(numbers)}" for stem, numbers in groups.items())


def replay(
    file: Annotated[Path, typer.Argument(help="A recording, for example of `khala run`.")],
    *,
    agent: Annotated[
        str | None, typer.Option(help="Only what this agent saw, said and did; red/NAME is the one of side red.")
    ] = None,
    steps: Annotated[str | None, typer.Option(help="Only these steps: 7, or 10-20.", metavar="STEPS")] = None,
    text: Annotated[bool, typer.Option("--text", help="Show observations and replies word for word.")] = False,
    images: Annotated[
        Path | None, typer.Option(help="Write the pictures that agents were shown into this directory.", metavar="DIR")
    ] = None,
    new: Annotated[
        Path | None,
        typer.Option(
            "--recover", help="Write what can be read into this new recording, as a whole one.", metavar="NEW"
        ),
    ] = None,
    pace: Annotated[
        bool, typer.Option("--pace", help="Print how fast the models were, as `pace` of their model files.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show what was said and done in a recorded run."""
    from khala_orchestrator.transcript import (  # noqa: PLC0415  # zstd is not for --help
        StepSelection,
        save_pictures,
        summary,
        transcript,
    )
    from khala_protocol.recording import Recording, recover  # noqa: PLC0415

    selection = StepSelection.of(agent, steps)
    recording = Recording.open(file)
    if not recording.complete:
        stderr_console().print(Text(_damage(recording)), style="yellow", soft_wrap=True)
    for key, words in recording.left_out.items():
        stderr_console().print(Text(f"left out of {key}: {words}"), style="yellow", soft_wrap=True)
    if new is not None:
        whole = recover(file, new)
        data = {"recording": str(new), "samples": whole.samples, "complete": recording.complete}
        _out(data, f"{new} holds the {whole.samples} samples of {file} that can be read", as_json=as_json)
        return
    if images is not None:
        saved = save_pictures(file, selection, images)
        data = {"pictures": [str(path) for path in saved]}
        _out(data, f"{len(saved)} pictures are in {images}", as_json=as_json)
        return
    if pace:
        _paces(recording, as_json=as_json)
        return
    if as_json:
        typer.echo(
            json.dumps(summary(file, selection) | {"complete": recording.complete, "left_out": recording.left_out})
        )
        return
    console = stdout_console()
    for part in transcript(file, selection, whole=text):
        console.print(part, soft_wrap=isinstance(part, Text))


def _paces(recording: "Recording", *, as_json: bool) -> None:
    from khala_orchestrator.measured_pace import measured_paces, yaml  # noqa: PLC0415  # numpy is not for --help
    from khala_protocol.messages import ModelCall  # noqa: PLC0415

    found = list(measured_paces(recording.of(ModelCall)))
    if not found:
        raise RecordingError(f"{recording.path} has no answer of a model: a pace is measured from answers")
    if as_json:
        typer.echo(json.dumps({"paces": [one._asdict() | {"pace": one.pace.model_dump()} for one in found]}))
        return
    typer.echo("\n".join(map(yaml, found)), nl=False)


async def _probe(config: BusConfig) -> list[str]:
    from khala_protocol.bus.zenoh import probe  # noqa: PLC0415  # loads the native library, which --help need not wait for

    return list(await probe(config))


async def _route(config: BusConfig, *, as_json: bool) -> None:
    from khala_protocol.bus.zenoh import open_bus  # noqa: PLC0415

    stop = stop_on_signal()
    bus = await open_bus(config)
    try:
        _out({"endpoints": bus.endpoints}, f"router at {', '.join(bus.endpoints)}; Ctrl-C ends it", as_json=as_json)
        await stop.wait()
    finally:
        await bus.close()


def _damage(recording: "Recording") -> str:
    where = f"after its sample {recording.samples}" if recording.samples else "before its first sample"
    return f"{recording.path} is torn or damaged {where}; --recover NEW writes what can be read as a whole recording"


def _out(data: dict[str, Any], sentence: str, *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(data))
    else:
        stderr_console().print(sentence)
