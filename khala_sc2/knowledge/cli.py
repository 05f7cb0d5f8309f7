"""`khala knowledge`: look up the facts that agents read of the game, and rebuild them from the simulator's tables."""

import json
from typing import Annotated, Literal

import typer

from khala_orchestrator.cli import Json
from khala_protocol.commandline import say
from khala_protocol.errors import KhalaError

SHOW_EPILOG = """
Examples:\n
    khala knowledge show Stalker\n
    khala knowledge show "siege tank" --version 5.0.13\n
    khala knowledge show Effect_Blink\n
    khala knowledge show 1442 --json
"""
WRITE_EPILOG = """
Examples:\n
    khala knowledge write\n
    khala knowledge write --check
"""

app = typer.Typer(
    help="Look up what agents read about unit types, abilities and upgrades, or rebuild it.",
    no_args_is_help=True,
    add_completion=False,
)

Version = Annotated[
    Literal["4.10", "5.0.13"], typer.Option(help="Version of the game: PySC2's names and numbers are those of 4.10.")
]


@app.command(epilog=SHOW_EPILOG)
def show(
    name: Annotated[str, typer.Argument(help="A unit type, an upgrade or an ability, or an ability's number.")],
    *,
    version: Version = "4.10",
    as_json: Json = False,
) -> None:
    """Show all that is known of NAME.

    Names are PySC2's; upper case, blanks and underscores do not matter. Agents read a shorter form in their
    observations.
    """
    from khala_bridge.knowledge.lookup import find, long  # noqa: PLC0415  # the facts are not for --help

    found = find(name, version)
    if as_json:
        typer.echo(json.dumps([entry.model_dump(mode="json", exclude_defaults=True) for entry in found]))
    else:
        say("\n".join(long(entry, version) for entry in found).removesuffix("\n"))


@app.command(epilog=WRITE_EPILOG)
def write(
    *,
    version: Annotated[
        Literal["4.10", "5.0.13"] | None, typer.Option(help="Only of this version of the game.", show_default="all")
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Write nothing; fail if a file is out of date.")] = False,
) -> None:
    """Rebuild the facts in bridge/khala_bridge/data/knowledge from the simulator's tables.

    Run it after a change of the tables. Each line is one unit type, ability, upgrade or buff. Words about them, in
    bridge/khala_bridge/data/knowledge/words, are written by hand; the numbers in them follow the facts automatically.
    """
    from khala_bridge.knowledge.facts import VERSIONS  # noqa: PLC0415
    from khala_sc2.knowledge import files  # noqa: PLC0415  # the tables and PySC2's names: seconds that --help need not wait

    versions = [version] if version else VERSIONS
    if not check:
        for path in (path for version in versions for path in files.write(version)):
            say(f"wrote {path}")
    elif old := [f"{version}/{name}" for version in versions for name in files.outdated_files(version)]:
        names = ", ".join(old)
        raise OutOfDate(
            f"out of date in bridge/khala_bridge/data/knowledge: {names}; `khala knowledge write` makes them"
        )


class OutOfDate(KhalaError):
    """Files of facts differ from the tables."""
