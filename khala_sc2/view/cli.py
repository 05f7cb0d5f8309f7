"""The command `khala view`; `khala_sc2.cli` mounts it."""

from pathlib import Path
from typing import Annotated

import typer

from khala_orchestrator.cli import Insecure, Tls

VIEW_EPILOG = """
Examples:\n
    khala view\n
    khala view 2s3z-20260101-120000-ab12\n
    khala view runs/first/recording.mcap runs/second/recording.mcap\n
    khala view my_experiment\n
    khala view first --connect tls/10.0.0.5:7447 --tls keys --adviser Adviser\n
    khala view first --export match.html --steps 0-400
"""


def view(
    given: Annotated[
        list[str] | None,
        typer.Argument(
            help="A recording, a run below runs/, or a directory; two recordings or runs to see them side by side.",
            metavar="[RUN|RECORDING|DIR]...",
            show_default="runs",
        ),
    ] = None,
    *,
    connect: Annotated[
        list[str] | None,
        typer.Option(help="Follow a match on the bus at this endpoint; RUN names it if there are several."),
    ] = None,
    tls: Tls = None,
    insecure: Insecure = False,
    adviser: Annotated[
        str | None, typer.Option(help="Let the page write to agents, as this adviser of the task.", metavar="NAME")
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address to serve on; an address that other machines reach needs --password or --https.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to serve on.", show_default="a free one")
    ] = 0,
    password: Annotated[
        bool,
        typer.Option(
            "--password", help="Ask for a password that opens the page without the token; or set KHALA_VIEW_PASSWORD."
        ),
    ] = False,
    password_file: Annotated[
        Path | None, typer.Option(help="Read that password from the first line of a file.", metavar="FILE")
    ] = None,
    https: Annotated[
        tuple[Path, Path] | None, typer.Option(help="Serve HTTPS with this certificate.", metavar="CERT KEY")
    ] = None,
    published: Annotated[
        str | None,
        typer.Option(
            help="Address on this machine at which a container's port is published, instead of a password.",
            metavar="127.0.0.1:PORT",
        ),
    ] = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Print the address, and open no browser.")] = False,
    export: Annotated[
        Path | None, typer.Option(help="Write one file that opens without a server, and end.", metavar="FILE.html")
    ] = None,
    steps: Annotated[str | None, typer.Option(help="Steps to export: 10-20, 10- or -20.", show_default="all")] = None,
    agents: Annotated[
        list[str] | None,
        typer.Option(help="Agents whose long texts an export contains.", show_default="all", metavar="NAME"),
    ] = None,
) -> None:  # fmt: skip
    """Look at matches in the browser: the map, what each agent saw, said and did, and what became of it.

    The page follows a running match. It is served on this machine alone, behind a token in its address, and loads
    nothing from elsewhere. An index in the cache directory makes long recordings open at once.
    """
    from khala_sc2.view.serve import ViewOptions, run_export, run_view  # noqa: PLC0415  # a web server, which --help can do without

    options = ViewOptions(
        given=tuple(given or ()), connect=tuple(connect or ()), tls=tls, insecure=insecure, adviser=adviser or "",
        host=host, port=port, asks_password=password, password_file=password_file, https=https,
        published=published or "", opens=not no_open,
    )  # fmt: skip
    if export is not None:
        run_export(options, export, steps=steps, agents=agents or ())
    else:
        run_view(options)
