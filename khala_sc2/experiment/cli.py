"""`khala experiment …`: begin one, go on with it, look at it, compare, report. `khala_sc2.cli` mounts it."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from khala_agents.cli import Trust
from khala_orchestrator.cli import Json
from khala_sc2.commands.run_options import Game

app = typer.Typer(
    help="Play a grid of tasks, models and seeds, and turn it into tables with intervals.",
    no_args_is_help=True,
    rich_markup_mode="rich",
)

RUN_EPILOG = """
Examples:\n
    khala experiment run smoke\n
    khala experiment run table2 --pilot 1 --jobs 4\n
    khala experiment run table3:model=openai/gpt-5\n
    khala experiment run my_grid.yaml --pilot 2 --budget-usd 20\n
    khala experiment run my_grid.yaml --on ray --address 10.0.0.5:6379\n
    khala experiment run my_grid.yaml --on ray --head 10.0.0.5:6379
"""
JOIN_EPILOG = """
Examples:\n
    khala experiment join 10.0.0.5:6379\n
    khala experiment join 10.0.0.5:6379 --jobs 4
"""
COMPARE_EPILOG = """
Examples:\n
    khala experiment compare smoke:player=skilled smoke:player=focus-fire\n
    khala experiment compare monday tuesday --allow code\n
    khala experiment compare pair:clock=frozen pair:clock=realtime --allow clock --measure win --measure tokens
"""
OUT = Path("experiments")
USUAL_MEASURES = ["win", "kd"]

Directory = Annotated[Path, typer.Argument(help="Directory of an experiment, or its name below --out.", metavar="DIR")]
Out = Annotated[Path, typer.Option(help="Directory in which each experiment gets its own.", metavar="DIR")]
File = Annotated[
    str,
    typer.Argument(
        help="A shipped experiment, see `khala experiment list`, or a .yaml file; with :factor=value,… a part of it, "
        "or a row for a model of yours.",
        metavar="FILE",
    ),
]
On = Annotated[str, typer.Option(help="Where matches are played: local, or ray for a Ray cluster.", metavar="ENGINE")]
Jobs = Annotated[
    int | None,
    typer.Option(min=1, help="Matches at the same time.", show_default="by cores and memory", metavar="N"),
]
BudgetUsd = Annotated[
    float | None, typer.Option(min=0, help="Most that all matches may cost.", show_default="as the file says")
]
Pilot = Annotated[
    int, typer.Option(min=0, help="First play this many matches of each cell, and estimate the rest.", metavar="N")
]
Yes = Annotated[bool, typer.Option("--yes", help="Continue after the pilot without asking.")]
Processes = Annotated[
    bool, typer.Option("--processes", help="Give agents processes of their own, for policies that compute or block.")
]
Address = Annotated[
    str | None, typer.Option(help="Address of the Ray cluster.", show_default="a local one", metavar="HOST")
]
Head = Annotated[
    str | None,
    typer.Option(
        help="With --on ray: start a cluster here, which others reach at this address and join with `join`.",
        metavar="HOST:PORT",
    ),
]
Url = Annotated[
    str | None, typer.Option("--recordings", help="With --on ray: where nodes write recordings, an fsspec URL.")
]

One = Annotated[str, typer.Argument(help="DIR, or DIR:factor=value,factor=value.", show_default=False)]
Allow = Annotated[
    list[str] | None, typer.Option(help="A field in which the two may differ, such as clock.", metavar="FIELD")
]
Measure = Annotated[list[str], typer.Option(help="Measure to compare: win, or a column of the export.", metavar="NAME")]
Format = Annotated[Literal["markdown", "latex", "html", "all"], typer.Option("--format", help="Format of the report.")]
Into = Annotated[
    Path | None,
    typer.Option("--into", help="Directory of the report.", show_default="report, in the experiment's directory"),
]
By = Annotated[
    str, typer.Option(help="Factors whose values get a line each, separated by commas.", show_default="all factors")
]
Parquet = Annotated[Path | None, typer.Option(help="File to write; needs the extra `data`.", metavar="FILE")]
Csv = Annotated[Path | None, typer.Option(help="File to write.", metavar="FILE")]


@app.command(epilog=RUN_EPILOG)
def run(
    file: File,
    *,
    on: On = "local",
    jobs: Jobs = None,
    budget_usd: BudgetUsd = None,
    pilot: Pilot = 0,
    yes: Yes = False,
    processes: Processes = False,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    out: Out = OUT,
    address: Address = None,
    head: Head = None,
    recordings: Url = None,
    as_json: Json = False,
) -> None:
    """Play the matches of an experiment that were not played yet.

    A hash of its settings identifies each match: started again, or with a larger grid, this plays only the missing
    matches. Ctrl-C and SIGKILL lose only the matches that are being played.
    """
    from khala_sc2.experiment import commands  # noqa: PLC0415  # see there

    options = {"on": on, "jobs": jobs, "budget_usd": budget_usd, "pilot": pilot, "yes": yes, "processes": processes,
               "game": game, "address": address, "head": head, "recordings": recordings,
               "as_json": as_json}  # fmt: skip
    commands.run(file, out, options)


@app.command()
def resume(
    directory: Directory,
    *,
    on: On = "local",
    jobs: Jobs = None,
    budget_usd: BudgetUsd = None,
    processes: Processes = False,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    out: Out = OUT,
    address: Address = None,
    head: Head = None,
    recordings: Url = None,
    as_json: Json = False,
) -> None:
    """Continue the experiment in a directory: play the matches that are missing, crashed or not valid."""
    from khala_sc2.experiment import commands  # noqa: PLC0415  # see there

    options = {"on": on, "jobs": jobs, "budget_usd": budget_usd, "pilot": 0, "yes": True, "processes": processes,
               "game": game, "address": address, "head": head, "recordings": recordings,
               "as_json": as_json}  # fmt: skip
    commands.resume(directory, out, options)


@app.command(epilog=JOIN_EPILOG)
def join(
    address: Annotated[str, typer.Argument(help="Where `khala experiment run --head` plays.", metavar="HOST:PORT")],
    *,
    jobs: Jobs = None,
) -> None:
    """Play matches of an experiment that runs on another machine, until it is over.

    Waits for the experiment to begin. Machines may join and go at any time: the matches of a machine that goes are
    played on another one. Keys of models come from this machine's environment.
    """
    from khala_sc2.experiment.ray_node import join as join_cluster  # noqa: PLC0415  # see `commands`

    join_cluster(address, jobs)


@app.command(name="list")
def list_(*, as_json: Json = False) -> None:
    """List the shipped experiments."""
    from khala_sc2.experiment import commands  # noqa: PLC0415  # see there

    commands.list_shipped(as_json=as_json)


@app.command()
def show(file: File, *, game: Game = "simulator", out: Out = OUT, as_json: Json = False) -> None:
    """Show what an experiment would play: its cells, and how many matches of each were played."""
    from khala_sc2.experiment import commands  # noqa: PLC0415  # see there

    commands.show(file, game=game, out=out, as_json=as_json)


@app.command()
def status(directory: Directory, *, game: Game = "simulator", out: Out = OUT, as_json: Json = False) -> None:
    """Show the progress and cost of an experiment, and which matches crashed or are not valid."""
    from khala_sc2.experiment import commands  # noqa: PLC0415  # see there

    commands.status(directory, game=game, out=out, as_json=as_json)


@app.command()
def index(directory: Directory, *, out: Out = OUT) -> None:
    """Rebuild the index of an experiment from its recordings."""
    from khala_sc2.experiment import commands  # noqa: PLC0415  # see there

    commands.index(directory, out=out)


@app.command(epilog=COMPARE_EPILOG)
def compare(
    a: One,
    b: One,
    *,
    allow: Allow = None,
    measure: Measure = USUAL_MEASURES,
    out: Out = OUT,
    as_json: Json = False,
) -> None:
    """Compare two selections of matches, paired by seed. Refuse unlike matches, and name the fields that differ."""
    from khala_sc2.experiment import results  # noqa: PLC0415  # see `commands`

    results.compare(a, b, allow=allow or (), measures=measure, out=out, as_json=as_json)


@app.command()
def report(
    directory: Directory,
    *,
    formats: Format = "all",
    into: Into = None,
    by: By = "",
    out: Out = OUT,
    as_json: Json = False,
) -> None:
    """Make the tables and figures of an experiment, and say how it was played."""
    from khala_sc2.experiment import results  # noqa: PLC0415  # see `commands`

    results.report(directory, formats=formats, into=into, by=by, out=out, as_json=as_json)


@app.command()
def export(directory: Directory, *, parquet: Parquet = None, csv: Csv = None, out: Out = OUT) -> None:
    """Write a row for each episode and side: its factors, and everything that was measured."""
    from khala_sc2.experiment import results  # noqa: PLC0415  # see `commands`

    results.export(directory, parquet=parquet, csv=csv, out=out)
