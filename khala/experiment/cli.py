"""`khala experiment …`: begin one, go on with it, look at it, compare, report. `khala.cli` mounts it."""

import asyncio
import dataclasses
import json
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from khala.exit_codes import FAILED, NOT_VALID, SIGNALLED
from khala.experiment.options import OUT, Directory, Out
from khala.experiment.results import COMPARE_EPILOG, compare, export, report
from khala.options import Game
from khala_orchestrator.cli import Json
from khala_orchestrator.console import stderr_console, stdout_console
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from khala.experiment.engine import Engine
    from khala.experiment.plan import PlannedMatch
    from khala.experiment.runner import Estimate, Runner
    from khala.experiment.spec import Experiment
    from khala.experiment.store import Store

app = typer.Typer(
    help="Play a grid of tasks, models and seeds, and turn it into tables with intervals.",
    no_args_is_help=True,
    rich_markup_mode="rich",
)

RUN_EPILOG = """
Examples:\n
    khala experiment run smoke\n
    khala experiment run llm_pysc2 --jobs 4\n
    khala experiment run my_grid.yaml --pilot 2 --budget-usd 20\n
    khala experiment run my_grid.yaml --on ray --address 10.0.0.5:6379
"""
SHIPPED = "experiments"

File = Annotated[
    str, typer.Argument(help="A shipped experiment, see `khala experiment list`, or a .yaml file.", metavar="FILE")
]
On = Annotated[str, typer.Option(help="Where matches are played: local, or ray for a Ray cluster.", metavar="ENGINE")]
Jobs = Annotated[
    int | None,
    typer.Option(min=1, help="Matches at the same time.", show_default="cores, as far as memory lasts", metavar="N"),
]
BudgetUsd = Annotated[
    float | None, typer.Option(min=0, help="Most that all matches may cost.", show_default="as the file says")
]
Pilot = Annotated[
    int, typer.Option(min=0, help="First play so many matches of each cell, and estimate the rest.", metavar="N")
]
Yes = Annotated[bool, typer.Option("--yes", help="Go on after the pilot without a question.")]
Processes = Annotated[
    bool, typer.Option("--processes", help="Give agents processes of their own, for policies that compute or block.")
]
Address = Annotated[str | None, typer.Option(help="Of the Ray cluster.", show_default="a local one", metavar="HOST")]
Url = Annotated[
    str | None, typer.Option("--recordings", help="With --on ray: where nodes write recordings, an fsspec URL.")
]


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
    out: Out = OUT,
    address: Address = None,
    recordings: Url = None,
    as_json: Json = False,
) -> None:
    """Play the matches of an experiment that were not played yet.

    A match is known by the hash of what it plays: started again, or with a larger grid, this plays only what is
    missing. Ctrl-C and SIGKILL lose the matches that are being played.
    """
    from khala.experiment.store import Store  # noqa: PLC0415  # PySC2 takes a second that --help need not wait for
    from khala_protocol.configfile import load  # noqa: PLC0415

    path = path_of(file)
    experiment = load(path, _experiment_model())
    store = Store(out / experiment.name)
    options = {"on": on, "jobs": jobs, "budget_usd": budget_usd, "pilot": pilot, "yes": yes, "processes": processes,
               "game": game, "address": address, "recordings": recordings, "as_json": as_json}  # fmt: skip
    _play(experiment, store, path, **options)


@app.command()
def resume(
    directory: Directory,
    *,
    on: On = "local",
    jobs: Jobs = None,
    budget_usd: BudgetUsd = None,
    processes: Processes = False,
    game: Game = "simulator",
    out: Out = OUT,
    address: Address = None,
    recordings: Url = None,
    as_json: Json = False,
) -> None:
    """Go on with an experiment, as its directory has it: play what is missing, crashed or not valid."""
    store = _opened(directory, out)
    options = {"on": on, "jobs": jobs, "budget_usd": budget_usd, "pilot": 0, "yes": True, "processes": processes,
               "game": game, "address": address, "recordings": recordings, "as_json": as_json}  # fmt: skip
    _play(store.experiment(), store, None, **options)


@app.command(name="list")
def list_(*, as_json: Json = False) -> None:
    """List the shipped experiments."""
    from khala_protocol.configfile import load  # noqa: PLC0415

    found = {name: load(path, _experiment_model()) for name, path in shipped().items()}
    if as_json:
        typer.echo(json.dumps({name: one.description for name, one in found.items()}))
        return
    table = Table(box=None, pad_edge=False)
    for column in ("experiment", "about"):
        table.add_column(column)
    for name, one in found.items():
        table.add_row(name, one.description)
    stdout_console().print(table)


@app.command()
def show(file: File, *, game: Game = "simulator", out: Out = OUT, as_json: Json = False) -> None:
    """Show what an experiment would play: its cells, and how many matches of each were played."""
    from khala.experiment.plan import plan  # noqa: PLC0415
    from khala.experiment.store import Store  # noqa: PLC0415
    from khala_protocol.configfile import load  # noqa: PLC0415

    experiment = load(path_of(file), _experiment_model())
    matches = plan(experiment, game=game)
    _print_cells(experiment, matches, Store(out / experiment.name), as_json=as_json)


@app.command()
def status(directory: Directory, *, game: Game = "simulator", out: Out = OUT, as_json: Json = False) -> None:
    """Show how far an experiment is, what it has cost, and what is not valid or crashed."""
    from khala.experiment.plan import plan  # noqa: PLC0415

    store = _opened(directory, out)
    experiment = store.experiment()
    _print_cells(experiment, plan(experiment, game=game), store, as_json=as_json)


@app.command()
def index(directory: Directory, *, out: Out = OUT) -> None:
    """Make the index of an experiment anew of its recordings."""
    store = _opened(directory, out)
    stderr_console().print(f"{store.rebuild()} matches are in {store.directory / 'index.sqlite'}", soft_wrap=True)


app.command(epilog=COMPARE_EPILOG)(compare)
app.command()(report)
app.command()(export)


def path_of(file: str) -> Path:
    """Return the path of an experiment's file.

    Raises:
        ConfigError: it is neither a shipped experiment nor a file.
    """
    if file.endswith((".yaml", ".yml")):
        return Path(file)
    if file in (found := shipped()):
        return found[file]
    raise ConfigError(f"there is no experiment {file!r}: there are {', '.join(found)}; a .yaml file works too")


def shipped() -> dict[str, Path]:
    """Return the shipped experiments by name."""
    from khala_configs import CONFIGS  # noqa: PLC0415

    return {path.stem: path for path in sorted((CONFIGS / SHIPPED).glob("*.yaml"))}


def _experiment_model() -> "type[Experiment]":
    from khala.experiment.spec import Experiment  # noqa: PLC0415

    return Experiment


def _opened(directory: Path, out: Path) -> "Store":
    from khala.experiment.store import Store  # noqa: PLC0415

    return Store.opened(directory if directory.is_dir() else out / directory)


# --- playing -----------------------------------------------------------------------------------------


def _play(experiment: "Experiment", store: "Store", file: Path | None, **given: Any) -> None:
    from khala.experiment.plan import plan  # noqa: PLC0415
    from khala_protocol.signals import cancelled_by_signal  # noqa: PLC0415

    matches = plan(experiment, game=given["game"])
    if file is not None:
        store.begin(file)
    with store.locked():
        engine = _engine(given, store)
        playing = _until_done(experiment, store, engine, matches, given)
        done = asyncio.run(cancelled_by_signal(playing))
    if isinstance(done, signal.Signals):
        stderr_console().print(f"interrupted: `khala experiment resume {store.directory}` goes on", soft_wrap=True)
        raise typer.Exit(SIGNALLED + done)
    _say_how_it_ended(store, matches, done, as_json=given["as_json"])


async def _until_done(
    experiment: "Experiment", store: "Store", engine: "Engine", matches: "list[PlannedMatch]", given: dict[str, Any]
) -> "Runner":
    from khala.experiment.progress import Watcher  # noqa: PLC0415
    from khala.experiment.runner import Runner, pilot_of  # noqa: PLC0415

    changes = {} if given["budget_usd"] is None else {"usd": given["budget_usd"]}
    budget = experiment.budget.model_copy(update=changes)
    async with engine:
        runner = Runner(experiment, store, engine, budget, processes=given["processes"])
        if given["pilot"]:
            pilot = pilot_of(matches, given["pilot"])
            with Watcher(stderr_console(), runner, pilot, "pilot") as watcher:
                runner.see = watcher
                await runner.play(pilot)
            if runner.stopped or not await asyncio.to_thread(_goes_on, runner, matches, yes=given["yes"]):
                return runner
        with Watcher(stderr_console(), runner, matches, experiment.name) as watcher:
            runner.see = watcher
            await runner.play(matches)
    return runner


def _goes_on(runner: "Runner", matches: "list[PlannedMatch]", *, yes: bool) -> bool:
    estimate = runner.estimate(matches)
    if not runner.knows_anything:
        runner.stopped = "no match of the pilot was valid, so there is nothing to estimate from: `status` says why"
        return False
    stderr_console().print(words_of(estimate), soft_wrap=True)
    limit = runner.budget.usd
    if limit is not None and estimate.usd is not None and runner.spent.usd + estimate.usd > limit:
        runner.stopped = (
            f"with the rest it would cost more than the budget of {limit:g} USD: raise it, or leave out --pilot to "
            f"play as much as it allows"
        )
        return False
    if yes or not estimate.matches or not sys.stdin.isatty():
        return True
    if typer.confirm("Play them?", default=True, err=True):
        return True
    runner.stopped = "you said no after the pilot"
    return False


def words_of(estimate: "Estimate") -> str:
    """Return an estimate as a sentence."""
    money = "" if estimate.usd is None else f"{estimate.usd:.4f} USD, "
    return (
        f"after the pilot: {estimate.matches} matches are left, about {money}{estimate.tokens / 1e6:.3g} M tokens and "
        f"{estimate.hours:.2g} hours"
    )


def _engine(given: dict[str, Any], store: "Store") -> "Engine":
    from khala.experiment.engine import Local, slots_of_this_machine  # noqa: PLC0415

    if given["on"] == "local":
        return Local(given["jobs"] or slots_of_this_machine(), game=given["game"], logs=store.logs)
    if given["on"] == "ray":
        from khala.experiment.ray_engine import Ray  # noqa: PLC0415

        return Ray(given["jobs"], game=given["game"], address=given["address"], recordings=given["recordings"])
    raise ConfigError(f"there is no engine {given['on']!r}: give local or ray", source="--on")


def _say_how_it_ended(store: "Store", matches: "list[PlannedMatch]", runner: "Runner", *, as_json: bool) -> None:
    played = store.played()
    states = [played[match.key].state if match.key in played else "missing" for match in matches]
    counts = {state: states.count(state) for state in ("done", "invalid", "crashed", "missing") if state in states}
    screen = stderr_console()
    if as_json:
        said = {"directory": str(store.directory), "matches": counts, "cost_usd": runner.spent.usd}
        typer.echo(json.dumps(said | {"tokens": runner.spent.tokens, "stopped": runner.stopped}))
    screen.print(f"{', '.join(f'{number} {state}' for state, number in counts.items())}; "
                 f"`khala experiment report {store.directory}` makes the tables", soft_wrap=True)  # fmt: skip
    if runner.stopped:
        screen.print(f"not all were played: {runner.stopped}", style="yellow", soft_wrap=True)
    if counts.get("crashed"):
        raise typer.Exit(FAILED)
    if counts.get("invalid") or counts.get("missing"):
        raise typer.Exit(NOT_VALID)


def _print_cells(experiment: "Experiment", matches: "list[PlannedMatch]", store: "Store", *, as_json: bool) -> None:
    played = store.played()
    rows: dict[tuple[str, ...], dict[str, Any]] = {}
    for match in matches:
        row = rows.setdefault(tuple(match.cell.values()), dict(match.cell) | {"matches": 0, "done": 0, "invalid": 0,
                              "crashed": 0, "cost_usd": 0.0, "causes": []})  # fmt: skip
        row["matches"] += 1
        if (one := played.get(match.key)) is not None:
            row[one.state] += 1
            row["cost_usd"] += one.cost_usd or 0.0
            row["causes"] += [one.cause] if one.cause and one.cause not in row["causes"] else []
    if as_json:
        plain = [dataclasses.asdict(one) for one in played.values() if one.state != "done"]
        typer.echo(json.dumps({"cells": list(rows.values()), "not_done": plain}, default=str))
        return
    table = Table(box=None, pad_edge=False, title=f"{experiment.name}: {len(matches)} matches")
    for column in (*experiment.factors, "done", "not valid", "crashed", "USD", "why"):
        table.add_column(column)
    for row in rows.values():
        names = [str(row.get(factor, "")) for factor in experiment.factors]
        done = f"{row['done']} of {row['matches']}"
        costs = f"{row['cost_usd']:.4f}" if row["cost_usd"] else ""
        numbers = [done, *(str(row[state] or "") for state in ("invalid", "crashed"))]
        table.add_row(*names, *numbers, costs, "; ".join(row["causes"]))
    stdout_console().print(table)
