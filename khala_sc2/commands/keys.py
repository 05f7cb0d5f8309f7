"""`khala keys`: the certificates with which machines join the bus; see `khala_protocol.certificates`."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from khala_orchestrator.cli import Json
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError

INIT_EPILOG = """
Examples:\n
    khala keys init keys --host 10.0.0.5 --host router.example.org\n
    khala keys agent Stalkers keys\n
    khala keys adviser Coach keys\n
    khala keys show keys
"""

app = typer.Typer(
    help="Make keys and certificates, by which hosts, agents and routers identify each other.",
    no_args_is_help=True,
    add_completion=False,
)

Directory = Annotated[Path, typer.Argument(help="Directory of the keys.", metavar="DIR")]
Days = Annotated[int, typer.Option(min=1, max=3650, help="How many days the new certificates are valid.")]


@app.command(epilog=INIT_EPILOG)
def init(
    directory: Directory,
    *,
    host: Annotated[
        list[str] | None,
        typer.Option(
            help="Name or address at which the router can be reached; may be given several times.",
            show_default="as the last time, or those of this machine",
            metavar="NAME",
        ),
    ] = None,
    days: Days = 365,
) -> None:
    """Make an authority, and certificates for a router and for the host.

    An existing authority stays; router and host get new certificates, and copies of the old ones stay valid. The
    folder `ca` should not leave this machine: anyone who holds its key can
    impersonate any agent.
    """
    from khala_protocol.certificates import make_authority  # noqa: PLC0415  # the library is not for --help

    _make(directory, lambda: make_authority(directory, host or (), days=days))


@app.command()
def agent(
    name: Annotated[str, typer.Argument(help="The agent, as the task file names it.")],
    directory: Directory,
    *,
    side: Annotated[str, typer.Option(help="Side of the agent, as the task file names it.")] = "blue",
    days: Days = 365,
) -> None:
    """Make a certificate for one agent, in a folder of its own to copy to the agent's machine."""
    from khala_protocol.certificates import certify_agent  # noqa: PLC0415

    _make(directory, lambda: [certify_agent(directory, side, name, days=days)])


@app.command()
def adviser(
    name: Annotated[str, typer.Argument(help="The adviser, as the task file names it.")],
    directory: Directory,
    *,
    side: Annotated[str, typer.Option(help="Side whose agents it advises, as the task file names it.")] = "blue",
    days: Days = 365,
) -> None:
    """Make a certificate for one adviser, who may read reports and write to agents; see `khala advise`."""
    from khala_protocol.certificates import certify_adviser  # noqa: PLC0415

    _make(directory, lambda: [certify_adviser(directory, side, name, days=days)])


@app.command()
def observer(
    name: Annotated[str, typer.Argument(help="Who it is for; only the folder has this name.")],
    directory: Directory,
    *,
    days: Days = 365,
) -> None:
    """Make a certificate for a program that may read everything and write nothing."""
    from khala_protocol.certificates import certify_observer  # noqa: PLC0415

    _make(directory, lambda: [certify_observer(directory, name, days=days)])


@app.command()
def show(directory: Directory, *, as_json: Json = False) -> None:
    """Show which certificates there are, and how long they are valid."""
    from rich.table import Table  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    from khala_orchestrator.console import print_table  # noqa: PLC0415
    from khala_protocol.certificates import certificates  # noqa: PLC0415

    found = certificates(directory)
    if not found:
        raise ConfigError("holds no certificates: `khala keys init DIR` makes them", source=str(directory))
    if as_json:
        rows = [
            {
                "name": certificate.name,
                "ends": certificate.ends.isoformat(),
                "days_left": certificate.days_left,
                "hosts": certificate.hosts,
            }
            for certificate in found
        ]
        typer.echo(json.dumps({"certificates": rows}))
        return
    table = Table(box=None, pad_edge=False)
    for column in ("name", "folder", "valid until", "days", "listens at"):
        table.add_column(column, overflow="fold")
    for certificate in found:
        days = Text(str(certificate.days_left), "red" if certificate.warning else "")
        ends = f"{certificate.ends:%Y-%m-%d}"
        table.add_row(certificate.name, certificate.path.parent.name, ends, days, ", ".join(certificate.hosts))
    print_table(table)
    for certificate in found:
        if certificate.warning:
            say(certificate.warning, err=True)
        if certificate.is_open:
            say(f"others can read {certificate.key}: chmod 600 {certificate.key}", err=True)


def _make(directory: Path, make: Callable[[], list[Path]]) -> None:
    """Make certificates, and say which ones, where their holders listen, and what they replace."""
    from khala_protocol.bus.certificate import read  # noqa: PLC0415
    from khala_protocol.certificates import certificates  # noqa: PLC0415

    before = {certificate.path: certificate for certificate in certificates(directory) if not certificate.has_expired}
    for place in make():
        made = read(place / "certificate.pem")
        at = f", which listens at {', '.join(made.hosts)}" if made.hosts else ""
        old = before.get(made.path)
        instead = f"; copies of the one before are good until {old.ends:%Y-%m-%d}" if old else ""
        say(f"made {place}{at}{instead}", err=True)
