"""What `khala fork` does, when its options are read. It imports what plays a game, for which --help need not wait."""

from __future__ import annotations

import asyncio
import json
import signal
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from khala_orchestrator.console import print_table, stderr_console
from khala_orchestrator.past.fork import Trunk, trunk_of
from khala_protocol.errors import RecordingError
from khala_protocol.signals import cancelled_by_signal
from khala_sc2.commands.exit_codes import FAILED, NOT_VALID, SIGNALLED
from khala_sc2.experiment.engine import Local, slots_of_this_machine
from khala_sc2.fork import scan as scans
from khala_sc2.fork.figures import are_alike, outcomes, plain
from khala_sc2.fork.futures import Plan, play_all
from khala_sc2.fork.players import players_of
from khala_sc2.fork.recorded import play_recorded
from khala_sc2.playing.matches import newest_recording

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable, Iterator, Mapping, Sequence
    from typing import TypeVar

    from rich.table import Table

    from khala_sc2.fork.futures import Fork, Future
    from khala_sc2.playing.minds import Minds

    T = TypeVar("T")


def open_trunk(path: Path, episode: int) -> Trunk:
    """Return an episode of a recording, or of the newest one in the directory of a run."""
    return trunk_of(newest_recording(path), episode)


def make_plan(
    trunk: Trunk,
    out: Path | None,
    common: Minds | None,
    sides: Mapping[str, str],
    agents: Iterable[str],
    advice: Sequence[str],
    memory: str | None,
) -> Plan:
    """Return what is to be forked, and how; the options are those of the command."""
    minds = players_of(trunk.config.task, common, sides, agents)
    return Plan(trunk, minds, out or Path("runs") / f"{trunk.config.run}-forks", advice, memory)


def repeat(trunk: Trunk, step: int, game: str, *, as_json: bool) -> None:
    """Play the recorded future once more, and say whether it was the same."""
    trunk.check(step)
    with tempfile.TemporaryDirectory() as directory:
        again = _until_interrupted(play_recorded(trunk, Path(directory), game=game), "nothing is left of it")
    if again.differences:
        raise RecordingError(
            f"the recorded future could not be repeated: {again.differences[0]}; is this the same version of Khala?"
        )
    if not again.same:
        raise RecordingError(f"{trunk.recording.path} has another result than its game gives when it is played again")
    stderr_console().print("played again with the recorded decisions: no observation differs, and the end is the same")
    _print(plain(trunk, step, []) | _origin(trunk), outcomes(trunk, step, [], ""), as_json=as_json)


def fork_at(
    plan: Plan, step: int, times: int, *, jobs: int | None, budget_usd: float | None, game: str, as_json: bool
) -> None:
    """Play forks at one step, and print what became of them."""
    futures = _play(plan, plan.forks(step, times), jobs, budget_usd, game)
    if are_alike(futures):
        _say(f"all {times} forks ended alike: who decides is deterministic, and --times 1 is enough")
    shown = outcomes(plan.trunk, step, futures, plan.who)
    _print(plain(plan.trunk, step, futures) | _origin(plan.trunk), shown, as_json=as_json)
    _end(futures)


def scan(
    plan: Plan, every: int | None, times: int, *, jobs: int | None, budget_usd: float | None, game: str, as_json: bool
) -> None:
    """Play forks at many steps, and print the steps in the order of how much changes."""
    steps = scans.steps_of(plan.trunk, every, advised=bool(plan.advice))
    forks = [fork for step in steps for fork in plan.forks(step, times)]
    futures = _play(plan, forks, jobs, budget_usd, game)
    points = scans.rank(plan.trunk, futures)
    _print(
        {"steps": scans.plain_points(plan.trunk, points)} | _origin(plan.trunk), scans.table(points), as_json=as_json
    )
    _say(f"`khala replay {plan.trunk.recording.path} --steps {points[0].step}` tells what was decided there")
    _end(futures)


def _play(plan: Plan, forks: Sequence[Fork], jobs: int | None, budget_usd: float | None, game: str) -> Sequence[Future]:
    async def work() -> list[Future]:
        slots = min(jobs or slots_of_this_machine(), len(forks))
        async with Local(slots, game=game, logs=plan.out / "logs") as engine:
            return await play_all(forks, engine, budget_usd=budget_usd, done=done)

    with _progress(len(forks)) as done:
        return _until_interrupted(work(), f"the forks that were played are in {plan.out}")


@contextmanager
def _progress(forks: int) -> Iterator[Callable[[Future], None]]:
    """Show a bar on a terminal, a line for each fork elsewhere; yield what is called with each that is over."""
    screen = stderr_console()
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
               TextColumn("ends in", markup=False), TimeRemainingColumn())  # fmt: skip
    bar = Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal)
    task = bar.add_task("forks", total=forks)

    def done(future: Future) -> None:
        bar.advance(task)
        if future.error or not screen.is_terminal:
            screen.print(f"{future.fork.record.parent.name}: {_ending(future)}", soft_wrap=True)

    with bar:
        yield done


def _ending(future: Future) -> str:
    named = len(future.results) > 1
    return future.error or ", ".join(
        f"{result.side}: {result.outcome}" if named else result.outcome for result in future.results
    )


def _until_interrupted(work: Coroutine[Any, Any, T], what_is_left: str) -> T:
    done = asyncio.run(cancelled_by_signal(work))
    if isinstance(done, signal.Signals):
        _say(f"interrupted; {what_is_left}")
        raise typer.Exit(SIGNALLED + done)
    return done


def _print(data: dict[str, Any], table: Table, *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(data))
    else:
        print_table(table)


def _origin(trunk: Trunk) -> dict[str, Any]:
    return {
        "run": trunk.config.run,
        "recording": str(trunk.recording.path),
        "sha256": trunk.sha256,
        "episode": trunk.episode,
    }


def _say(words: str) -> None:
    stderr_console().print(words, soft_wrap=True)


def _end(futures: Sequence[Future]) -> None:
    """Say what else is to be known of the forks; end with an exit code if some say nothing."""
    if spent_usd := sum(future.spent_usd for future in futures):
        _say(f"spent: {spent_usd:.4f} USD")
    if failed := sum(future.failed for future in futures):
        decisions = sum(future.decisions for future in futures)
        _say(f"{failed} of {decisions} decisions after the step were not made by their agents")
    _say(f"recorded: {futures[0].fork.record.parent.parent}")
    broken = [future for future in futures if future.error]
    if broken:
        _say(f"{len(broken)} of {len(futures)} forks could not be played")
    if len(broken) == len(futures):
        raise typer.Exit(FAILED)
    if broken or not all(result.valid for future in futures for result in future.results):
        raise typer.Exit(NOT_VALID)
