"""The command `khala actions`: what agents can say, which units carry it out, and which PySC2 function it calls."""

from typing import Annotated, Literal

import typer

from khala_orchestrator.cli import Json

EPILOG = """
Examples:\n
    khala actions --unit Stalker\n
    khala actions --race terran --group macro\n
    khala actions --name storm\n
    khala actions --function Effect_Blink_screen\n
    khala actions --race zerg --json
"""


def actions(
    *,
    race: Annotated[
        Literal["protoss", "terran", "zerg"] | None, typer.Option(help="Only of this race, or of every race.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Only orders for units of this type.", metavar="TYPE")] = None,
    group: Annotated[str | None, typer.Option(help="Only of this group: basic, skill, build, …")] = None,
    name: Annotated[str | None, typer.Option(help="Only with this in the name or an alias.", metavar="TEXT")] = None,
    function: Annotated[
        str | None, typer.Option(help="Only actions that call this function of PySC2, by name or number.")
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="List all actions instead of only the groups.")] = False,
    as_json: Json = False,
) -> None:
    """List what agents can say, with arguments, meaning and an example call.

    Without an option, it lists the groups, and how many actions each group has. A task gives an agent single actions
    or whole groups, as `group:skill` or, for the actions of a side, `group:train/protoss`.

    `generated` actions follow from PySC2's functions: one for every function that has no other action, and
    `Select_Unit_<name>`, which gives one unit an order that a whole team can get.
    """
    from khala_sc2.commands.action_list import print_actions  # noqa: PLC0415  # the catalogue is not for --help

    print_actions(
        race=race, unit=unit, group=group, name=name, function=function, everything=everything, as_json=as_json
    )
