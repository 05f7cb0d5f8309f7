"""The work of `khala arena run`, `show` and `export`.

`khala_sc2.arena.cli` above has the options; it imports this module only to run a command.
"""

from __future__ import annotations

import asyncio
import json
import signal
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from khala_configs import CONFIGS
from khala_orchestrator.console import stderr_console, stdout_console
from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError
from khala_protocol.files import make_private, write_private
from khala_protocol.signals import cancelled_by_signal
from khala_sc2.arena.leaderboard import basis_of, remarks_of, table_of
from khala_sc2.arena.matches import count_meetings, plan_round, pool_of
from khala_sc2.arena.ratings import rate, rate_by_group
from khala_sc2.arena.results import RESULTS, pool_results, results_of, write_results
from khala_sc2.arena.site import make_site
from khala_sc2.arena.spec import Arena
from khala_sc2.commands.exit_codes import FAILED, NOT_VALID, SIGNALLED
from khala_sc2.experiment.commands import engine_of
from khala_sc2.experiment.plan import check_playable
from khala_sc2.experiment.progress import Watcher
from khala_sc2.experiment.runner import Runner
from khala_sc2.experiment.store import Store

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_sc2.experiment.plan import PlannedMatch

SHIPPED = "arenas"
FILE = "arena.yaml"


def run(file: str, out: Path, options: dict[str, Any], *, as_json: bool) -> None:
    """Play the matches of an arena that were not played yet."""
    path = path_of(file)
    arena = load(path, Arena)
    usd = options["budget_usd"]
    if usd is not None:
        arena = arena.model_copy(update={"budget": arena.budget.model_copy(update={"usd": usd})})
    everybody = arena.model_copy(update={"pairing": "round-robin"})
    check_playable(plan_round(everybody, 1, met={}, ratings={}, game=options["game"]), arena.budget.usd)
    store = Store(out / arena.name)
    make_private(store.directory)
    if path.resolve() != (store.directory / FILE).resolve():
        write_private(store.directory / FILE, path.read_bytes())
    with store.lock():
        done = asyncio.run(cancelled_by_signal(_play(arena, store, options)))
    if isinstance(done, signal.Signals):
        stderr_console().print(f"interrupted: `khala arena run {file}` goes on", soft_wrap=True)
        raise typer.Exit(SIGNALLED + done)
    show([store.directory], as_json=as_json)
    if done:
        stderr_console().print(f"not all were played: {done}", style="yellow", soft_wrap=True)
    _exit(store, is_whole=not done)


def show(paths: Sequence[Path], *, as_json: bool) -> None:
    """Print the ratings of results."""
    pool = pool_results(paths)
    board = rate(pool)
    if as_json:
        typer.echo(json.dumps(asdict(board) | {"remarks": [*board.remarks, *pool.remarks]}))
        return
    screen = stdout_console()
    for column in board.columns:
        screen.print(column, style="bold", highlight=False, markup=False)
        screen.print(f"{basis_of(board, column)}.", soft_wrap=True, highlight=False, markup=False)
        screen.print(table_of(board, column))
        screen.print()
    for remark in remarks_of(board, pool.remarks):
        screen.print(remark, soft_wrap=True, highlight=False)


def export(paths: Sequence[Path], into: Path) -> None:
    """Make the site of results."""
    pool = pool_results(paths)
    number = make_site(pool, rate(pool), into)
    pages = f"{number} of {len(pool.games)} matches have a page"
    stderr_console().print(f"{into / 'index.html'}: open it in a browser; {pages}", soft_wrap=True)


def path_of(file: str) -> Path:
    """Return the path of an arena's file.

    Raises:
        ConfigError: it is neither a shipped arena nor a file.
    """
    if file.endswith((".yaml", ".yml")):
        return Path(file)
    found = {path.stem: path for path in sorted((CONFIGS / SHIPPED).glob("*.yaml"))}
    if file in found:
        return found[file]
    raise ConfigError(f"there is no arena {file!r}: there is {', '.join(found)}; a .yaml file works too")


# --- playing -----------------------------------------------------------------------------------------


async def _play(arena: Arena, store: Store, options: dict[str, Any]) -> str:
    """Play the missing matches; return why some were not begun, "" if all were."""
    players = pool_of(arena)
    screen = stderr_console()
    async with engine_of(options, store) as engine:
        runner = Runner(arena, store, engine, arena.budget, processes=options["processes"])
        try:
            for title, matches in _batches(arena, store, options["game"]):
                with Watcher(screen, runner, matches, title) as watcher:
                    runner.see = watcher
                    await runner.play(matches)
                if runner.stopped:
                    break
        finally:
            write_results(results_of(arena.name, arena.anchors, players, store), store.directory / RESULTS)
    return runner.stopped


def _batches(arena: Arena, store: Store, game: str) -> Iterator[tuple[str, list[PlannedMatch]]]:
    """Yield matches that can be played at the same time: all of a round robin, or a round of the Swiss system."""
    if arena.pairing == "round-robin":
        rounds = (plan_round(arena, number, met={}, ratings={}, game=game) for number in range(1, arena.rounds + 1))
        yield arena.name, [match for matches in rounds for match in matches]
        return
    players = pool_of(arena)
    planned: list[PlannedMatch] = []
    for number in range(1, arena.rounds + 1):
        met = count_meetings(match.cell for match in planned)
        keys = {match.key for match in planned}
        played = results_of(arena.name, arena.anchors, players, store).games
        ratings = rate_by_group((game for game in played if game.match in keys), arena.anchors)
        matches = plan_round(arena, number, met=met, ratings=ratings, game=game)
        planned += matches
        yield f"{arena.name}, round {number}", matches


def _exit(store: Store, *, is_whole: bool) -> None:
    states = {match.state for match in store.matches().values()}
    if "crashed" in states:
        raise typer.Exit(FAILED)
    if "invalid" in states or not is_whole:
        raise typer.Exit(NOT_VALID)
