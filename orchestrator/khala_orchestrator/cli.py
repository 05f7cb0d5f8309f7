"""The commands `khala router`, `khala tasks` and `khala replay`, as plain functions that `khala_sc2.cli` mounts.

A mistake of the user is raised as a `khala_protocol.errors.KhalaError` of one sentence; `khala_sc2.cli` prints it.
"""

from pathlib import Path
from typing import Annotated

import typer

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

ROUTER_EPILOG = """
Examples:\n
    khala router\n
    khala router --tls keys --task 2s3z_pair --listen tls/0.0.0.0:7447\n
    khala router --listen tcp/0.0.0.0:7447 --insecure\n
    khala router --check --connect tcp/10.0.0.5:7447
"""
REPLAY_EPILOG = """
Examples:\n
    khala replay\n
    khala replay 2s3z-20260101-120000-ab12\n
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

    You need it if host and agents are on several machines; `khala run` has its own. With --tls it admits only holders
    of a certificate, and each may read and write only what the task gives to its name.
    """
    from khala_orchestrator import commands  # noqa: PLC0415  # see there

    if check:
        commands.check_router(connect, tls=tls, insecure=insecure, as_json=as_json)
    else:
        commands.route(listen or (), tls=tls, names_of_tasks=task or (), run=run, insecure=insecure, as_json=as_json)


def tasks(*, as_json: Json = False) -> None:
    """List what can be played."""
    from khala_orchestrator import commands  # noqa: PLC0415  # see there

    commands.list_tasks(as_json=as_json)


def replay(
    given: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A recording, a run below runs/, or a directory, of which the newest recording counts.",
            metavar="[RUN|RECORDING|DIR]...",
            show_default="runs",
        ),
    ] = None,
    *,
    agent: Annotated[
        str | None, typer.Option(help="Only what this agent saw, said and did; red/NAME is an agent of side red.")
    ] = None,
    steps: Annotated[str | None, typer.Option(help="Only these steps: 7, or 10-20.", metavar="STEPS")] = None,
    text: Annotated[bool, typer.Option("--text", help="Show observations and replies word for word.")] = False,
    images: Annotated[
        Path | None, typer.Option(help="Write the pictures that agents were shown into this directory.", metavar="DIR")
    ] = None,
    new: Annotated[
        Path | None,
        typer.Option(
            "--recover", help="Write the readable part into this new recording, as a whole file.", metavar="NEW"
        ),
    ] = None,
    pace: Annotated[
        bool, typer.Option("--pace", help="Print how fast the models were, as `pace` for their model files.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show what was said and done in a recorded run, or in several, one after the other."""
    from khala_orchestrator import commands  # noqa: PLC0415  # see there

    commands.replay(
        tuple(given or ()), agent=agent, steps=steps, text=text, images=images, new=new, pace=pace, as_json=as_json
    )
