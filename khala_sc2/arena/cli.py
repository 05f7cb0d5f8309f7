"""`khala arena …`: play one, look at its ratings, make its site. `khala_sc2.cli` mounts it."""

from pathlib import Path
from typing import Annotated

import typer

from khala_agents.cli import Trust
from khala_orchestrator.cli import Json
from khala_sc2.commands.run_options import Game
from khala_sc2.experiment.cli import Address, BudgetUsd, Head, Jobs, On, Processes, Url

app = typer.Typer(
    help="Rate models, scripted players, levels of the computer and bots by matches against each other.",
    no_args_is_help=True,
    rich_markup_mode="rich",
)

RUN_EPILOG = """
Examples:\n
    khala arena run first\n
    khala arena run my_arena.yaml --budget-usd 20 --jobs 4
"""
SHOW_EPILOG = """
Examples:\n
    khala arena show arenas/first\n
    khala arena show results/*.json\n
    khala arena show results/*.json --json
"""
EXPORT_EPILOG = """
Examples:\n
    khala arena export arenas/first\n
    khala arena export results/*.json --into public
"""

Out = Annotated[Path, typer.Option(help="Directory in which each arena gets its own.", metavar="DIR")]
File = Annotated[str, typer.Argument(help="A shipped arena, or a .yaml file.", metavar="FILE")]
Results = Annotated[
    list[Path],
    typer.Argument(help="Files of results, or directories of arenas, to rate together.", metavar="RESULTS"),
]
Into = Annotated[Path, typer.Option("--into", help="Directory of the site.", metavar="DIR")]


@app.command(epilog=RUN_EPILOG)
def run(
    file: File,
    *,
    on: On = "local",
    jobs: Jobs = None,
    budget_usd: BudgetUsd = None,
    processes: Processes = False,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    out: Out = Path("arenas"),
    address: Address = None,
    head: Head = None,
    recordings: Url = None,
    as_json: Json = False,
) -> None:
    """Play the matches of an arena that were not played yet, and print the ratings.

    The file names players, tasks in groups, anchors and a budget. Started again, or with more players, tasks or rounds,
    this plays only the missing matches. The results are in results.json in the directory of the arena.
    """
    from khala_sc2.arena import commands  # noqa: PLC0415  # see there

    options = {"on": on, "jobs": jobs, "budget_usd": budget_usd, "processes": processes, "game": game,
               "address": address, "head": head, "recordings": recordings}  # fmt: skip
    commands.run(file, out, options, as_json=as_json)


@app.command(epilog=SHOW_EPILOG)
def show(results: Results, *, as_json: Json = False) -> None:
    """Print the ratings of one arena or several together: overall and for each group of tasks, with intervals."""
    from khala_sc2.arena import commands  # noqa: PLC0415  # see there

    commands.show(results, as_json=as_json)


@app.command(epilog=EXPORT_EPILOG)
def export(results: Results, *, into: Into = Path("site")) -> None:
    """Make a static site: the ratings, the matches of each cell, and the page of each match.

    A match has a page if its recording is beside the file of results; see `khala view --export`.
    """
    from khala_sc2.arena import commands  # noqa: PLC0415  # see there

    commands.export(results, into)
