"""The work of `khala experiment run`, `resume`, `list`, `show`, `status` and `index`.

`khala_sc2.experiment.cli` above has the options. It imports this module only to run a command: tasks and PySC2's names take
a second to import, and `--help` need not wait for that.
"""

from __future__ import annotations

import asyncio
import dataclasses
import json
import re
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table

from khala_agents.config import load_model
from khala_configs import CONFIGS
from khala_orchestrator.console import print_table, stderr_console, stdout_console
from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError
from khala_protocol.signals import cancelled_by_signal
from khala_protocol.visible import visible_line
from khala_sc2.commands.exit_codes import FAILED, NOT_VALID, SIGNALLED
from khala_sc2.experiment.plan import check_playable, plan
from khala_sc2.experiment.spec import Experiment
from khala_sc2.experiment.store import Store
from khala_sc2.playing.minds import groups_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_sc2.experiment.engine import Engine
    from khala_sc2.experiment.plan import PlannedMatch
    from khala_sc2.experiment.played import PlayedMatch
    from khala_sc2.experiment.runner import CostEstimate, Runner
    from khala_sc2.experiment.spec import ExperimentBudget

SHIPPED = "experiments"
_PART = re.compile(r"(?P<file>.+?):(?P<where>\w+=.+)")
"""Cells of an experiment: `table3:model=gpt-4o,task=pvz_task1_level1`."""


def run(file: str, out: Path, options: dict[str, Any]) -> None:
    """Play the matches of an experiment that were not played yet."""
    path, experiment = _load(file)
    _play(experiment, Store(out / experiment.name), path, **options)


def resume(directory: Path, out: Path, options: dict[str, Any]) -> None:
    """Go on with an experiment, as its directory has it."""
    store = Store.open(directory, out)
    _play(store.experiment(), store, None, **options)


def list_shipped(*, as_json: bool) -> None:
    """List the shipped experiments."""
    found = {name: load(path, Experiment) for name, path in shipped_experiments().items()}
    if as_json:
        typer.echo(json.dumps({name: experiment.description for name, experiment in found.items()}))
        return
    table = Table(box=None, pad_edge=False)
    for column in ("experiment", "about"):
        table.add_column(column)
    for name, experiment in found.items():
        table.add_row(name, experiment.description)
    print_table(table)


def show(file: str, *, game: str, out: Path, as_json: bool) -> None:
    """Show what an experiment would play."""
    _, experiment = _load(file)
    matches = plan(experiment, game=game)
    _print_cells(experiment, matches, Store(out / experiment.name), as_json=as_json)


def status(directory: Path, *, game: str, out: Path, as_json: bool) -> None:
    """Show how far an experiment is."""
    store = Store.open(directory, out)
    experiment = store.experiment()
    _print_cells(experiment, plan(experiment, game=game), store, as_json=as_json, with_added=True)


def index(directory: Path, *, out: Path) -> None:
    """Make the index of an experiment again."""
    store = Store.open(directory, out)
    stderr_console().print(f"{store.rebuild()} matches are in {store.directory / 'index.sqlite'}", soft_wrap=True)


def _load(text: str) -> tuple[Path, Experiment]:
    """Return the file of an experiment, and the part of it that a text names: `FILE`, or `FILE:factor=value`."""
    found = _PART.fullmatch(text)
    path = path_of(found["file"] if found else text)
    experiment = load(path, Experiment)
    if found is None:
        return path, experiment
    where = dict(part.partition("=")[::2] for part in re.split(r",(?=\w+=)", found["where"]))
    try:
        return path, experiment.only(where)
    except ValueError as error:
        raise ConfigError(str(error), source=text) from None


def path_of(file: str) -> Path:
    """Return the path of an experiment's file.

    Raises:
        ConfigError: it is neither a shipped experiment nor a file.
    """
    if file.endswith((".yaml", ".yml")):
        return Path(file)
    if file in (found := shipped_experiments()):
        return found[file]
    raise ConfigError(f"there is no experiment {file!r}: there are {', '.join(found)}; a .yaml file works too")


def shipped_experiments() -> dict[str, Path]:
    """Return the shipped experiments by name."""
    return {path.stem: path for path in sorted((CONFIGS / SHIPPED).glob("*.yaml"))}


# --- playing -----------------------------------------------------------------------------------------


def _play(experiment: Experiment, store: Store, file: Path | None, **given: Any) -> None:
    matches = plan(experiment, game=given["game"])
    _tell_retired(matches)
    check_playable(matches, _budget(experiment, given["budget_usd"]).usd)
    if file is not None:
        store.begin(file)
    with store.lock():
        engine = engine_of(given, store)
        playing = _until_done(experiment, store, engine, matches, given)
        done = asyncio.run(cancelled_by_signal(playing))
    if isinstance(done, signal.Signals):
        stderr_console().print(f"interrupted: `khala experiment resume {store.directory}` goes on", soft_wrap=True)
        raise typer.Exit(SIGNALLED + done)
    _say_how_it_ended(store, matches, done, as_json=given["as_json"])


async def _until_done(
    experiment: Experiment, store: Store, engine: Engine, matches: list[PlannedMatch], given: dict[str, Any]
) -> Runner:
    from khala_sc2.experiment.progress import Watcher  # noqa: PLC0415
    from khala_sc2.experiment.runner import Runner, pilot_of  # noqa: PLC0415

    budget = _budget(experiment, given["budget_usd"])
    async with engine:
        runner = Runner(experiment, store, engine, budget, processes=given["processes"])
        if given["pilot"]:
            pilot = pilot_of(matches, given["pilot"])
            with Watcher(stderr_console(), runner, pilot, "pilot") as watcher:
                runner.see = watcher
                await runner.play(pilot)
            if not await asyncio.to_thread(_goes_on, runner, matches, yes=given["yes"]):
                return runner
        with Watcher(stderr_console(), runner, matches, experiment.name) as watcher:
            runner.see = watcher
            await runner.play(matches)
    return runner


def _budget(experiment: Experiment, usd: float | None) -> ExperimentBudget:
    return experiment.budget if usd is None else experiment.budget.model_copy(update={"usd": usd})


def _goes_on(runner: Runner, matches: list[PlannedMatch], *, yes: bool) -> bool:
    if runner.knows_anything:
        estimate = runner.estimate(matches)
        stderr_console().print(words_of(estimate, len(matches)), soft_wrap=True)
        runner.stopped = runner.stopped or _why_not_go_on(runner, estimate, yes=yes)
    else:
        nothing = "no match of the pilot was valid, so there is nothing to estimate from: `status` says why"
        runner.stopped = runner.stopped or nothing
    return not runner.stopped


def _why_not_go_on(runner: Runner, estimate: CostEstimate, *, yes: bool) -> str:
    """Return why the matches after a pilot are not played; "" if they are."""
    limit = runner.budget.usd
    if limit is not None and estimate.usd is not None and runner.spent.usd + estimate.usd > limit:
        return (
            f"with the rest it would cost more than the budget of {limit:g} USD: raise it, or leave out --pilot to "
            f"play as much as it allows"
        )
    if yes or not estimate.matches:
        return ""
    if not sys.stdin.isatty():
        return "nobody was there to say yes after the pilot: --yes plays the rest"
    return "" if typer.confirm("Play them?", default=True, err=True) else "you said no after the pilot"


def words_of(estimate: CostEstimate, planned: int) -> str:
    """Return an estimate as a sentence, with the number of all planned matches."""
    money = "" if estimate.usd is None else f"{estimate.usd:.4f} USD, "
    return (
        f"after the pilot: {estimate.matches} of {planned} matches are left, about {money}"
        f"{estimate.tokens / 1e6:.3g} M tokens and {estimate.hours:.2g} hours"
    )


def engine_of(given: dict[str, Any], store: Store) -> Engine:
    """Return the engine that the options `on`, `jobs`, `game`, `address`, `head` and `recordings` ask for.

    Raises:
        ConfigError: there is no such engine.
    """
    from khala_sc2.experiment.engine import Local, slots_of_this_machine  # noqa: PLC0415

    if given["on"] == "local":
        return Local(given["jobs"] or slots_of_this_machine(), game=given["game"], logs=store.logs)
    if given["on"] == "ray":
        from khala_sc2.experiment.ray_engine import Ray  # noqa: PLC0415

        where = {name: given[name] for name in ("address", "head", "recordings")}
        return Ray(given["jobs"], game=given["game"], **where)
    raise ConfigError(f"there is no engine {given['on']!r}: give local or ray", source="--on")


def _say_how_it_ended(store: Store, matches: list[PlannedMatch], runner: Runner, *, as_json: bool) -> None:
    played = store.matches()
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


def _print_cells(
    experiment: Experiment, matches: list[PlannedMatch], store: Store, *, as_json: bool, with_added: bool = False
) -> None:
    """Print a line for each cell; those of models that are not in the file, but were added to its grid, too."""
    played = store.matches()
    rows: dict[tuple[str, ...], dict[str, Any]] = {}
    planned = {match.key for match in matches}
    added = [match for match in played.values() if match.key not in planned] if with_added else []
    shown: list[PlannedMatch | PlayedMatch] = [*matches, *added]
    for match in shown:
        row = rows.setdefault(tuple(match.cell.values()), dict(match.cell) | {"matches": 0, "done": 0, "invalid": 0,
                              "crashed": 0, "cost_usd": 0.0, "causes": []})  # fmt: skip
        row["matches"] += 1
        if (became := played.get(match.key)) is not None:
            row[became.state] += 1
            row["cost_usd"] += became.cost_usd or 0.0
            row["causes"] += [became.cause] if became.cause and became.cause not in row["causes"] else []
    if as_json:
        plain = [dataclasses.asdict(match) for match in played.values() if match.state != "done"]
        typer.echo(json.dumps({"cells": list(rows.values()), "not_done": plain}, default=str))
        return
    table = Table(box=None, pad_edge=False, title=f"{experiment.name}: {len(matches)} matches")
    for column in (*experiment.factors, "done", "not valid", "crashed", "USD"):
        table.add_column(column)
    for row in rows.values():
        names = [str(row.get(factor, "")) for factor in experiment.factors]
        done = f"{row['done']} of {row['matches']}"
        costs = f"{row['cost_usd']:.4f}" if row["cost_usd"] else ""
        numbers = [done, *(str(row[state] or "") for state in ("invalid", "crashed"))]
        table.add_row(*names, *numbers, costs)
    print_table(table)
    for row in rows.values():
        for cause in row["causes"]:
            where = ", ".join(str(row.get(factor, "")) for factor in experiment.factors)
            stdout_console().print(visible_line(f"{where}: {cause}"), soft_wrap=True, markup=False, highlight=False)
    _tell_retired(matches)


def _tell_retired(matches: Iterable[PlannedMatch]) -> None:
    """Say which models their providers end, and what takes their place."""
    some = {tuple(map(str, match.minds.values())): match for match in matches}.values()
    minds = [mind for match in some for _, mind, _ in groups_of(match.config.task, match.minds)]
    for name in dict.fromkeys(mind.full_name for mind in minds if mind.policy is None):
        if retired := load_model(name).retired:
            stderr_console().print(f"{name} is retired {retired}", style="yellow", soft_wrap=True)
