"""The work of `khala calibrate`: list probes, play them, compare two files.

`khala_sc2.calibrate.cli` has the options and imports this module when it runs.
"""

from __future__ import annotations

import json
import platform
from typing import TYPE_CHECKING

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from khala_bridge.calibrate.catalogue import choose
from khala_bridge.calibrate.connection import run_game, version
from khala_bridge.calibrate.record import Calibration, Values, load
from khala_bridge.calibrate.run import play
from khala_orchestrator.console import print_table, stderr_console
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError
from khala_sc2 import __version__
from khala_sc2.calibrate import compare, report
from khala_sc2.calibrate.estimates import estimates
from khala_sc2.commands.exit_codes import FAILED, SIGNALLED
from khala_sc2.experiment.numbers import plain as plain_value
from khala_sc2.playing.environment import plain
from khala_sc2.playing.games import find

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rich.console import Console

    from khala_bridge.calibrate.probe import Probe
    from khala_bridge.calibrate.record import Measured

_SIGINT = 2


def show_probes(patterns: Sequence[str], *, as_json: bool) -> None:
    """Print every probe, what it measures and settles, and how many estimates of the simulator wait for it."""
    waiting: dict[str, list[str]] = {}
    for guess in estimates():
        waiting.setdefault(guess.probe, []).append(f"{guess.where}: {guess.what}")
    probes = choose(patterns)
    if as_json:
        names = ("id", "measures", "settles", "unit", "exact", "resolution")
        rows = [
            {name: getattr(probe, name) for name in names} | {"estimates": waiting.get(probe.id, [])}
            for probe in probes
        ]
        typer.echo(json.dumps(rows))
        return
    table = Table("probe", "measures", "settles", "estimates", box=None, pad_edge=False)
    for probe in probes:
        table.add_row(probe.id, probe.measures, probe.settles, str(len(waiting.get(probe.id, [])) or ""))
    print_table(table)


def show_comparison(a: Path, b: Path, *, as_json: bool) -> None:
    """Print where two files differ."""
    first, other = load(a), load(b)
    found = compare.compare(first, other)
    if as_json:
        typer.echo(json.dumps(plain_value(found), default=Values.model_dump))
    else:
        say(report.write(first, other, found).removesuffix("\n"))


def measure(game: str, out: Path, seed: int, patterns: Sequence[str], *, resume: bool, as_json: bool) -> None:
    """Play probes, and write the file after each.

    Raises:
        ConfigError: the file is there, or is of another game.
        GameError: the game cannot be started.
    """
    probes = choose(patterns)
    earlier = _earlier(out, resume=resume)
    path, name = find(game)
    screen = stderr_console()
    screen.print(f"starting {name} in {path}", soft_wrap=True)
    with run_game(path, plain()) as connection:
        said, build, data = version(connection)
        begun = Calibration(
            khala=__version__, game=name, version=said, build=build, data_version=data,
            platform=f"{platform.system()} {platform.machine()}", seed=seed,
        )  # fmt: skip
        if earlier and not earlier.is_same_game(begun):
            raise ConfigError(f"{out} is of {earlier.game} {earlier.version}, seed {earlier.seed}: give another --out")
        with _progress(screen) as progress:
            watch = _Watch(progress, probes, earlier)
            try:
                done = play(connection, probes, earlier or begun, save=lambda measured: measured.save(out), watch=watch)
            except KeyboardInterrupt:
                screen.print(f"interrupted; what was measured is in {out}, and --resume goes on", soft_wrap=True)
                raise typer.Exit(SIGNALLED + _SIGINT) from None
    done.save(out)
    _end(screen, out, done, as_json=as_json)


def _earlier(out: Path, *, resume: bool) -> Calibration | None:
    if resume:
        return load(out)
    if out.exists():
        raise ConfigError(f"{out} exists already: --resume continues it, --out names another file")
    return None


def _progress(screen: Console) -> Progress:
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=screen)


class _Watch:
    """Moves the bar, and prints each probe when it is done."""

    def __init__(self, progress: Progress, probes: Sequence[Probe], earlier: Calibration | None) -> None:
        done = earlier.probes if earlier else {}
        left = [probe for probe in probes if probe.id not in done or done[probe.id].failed]
        self._progress = progress
        self._bar = progress.add_task("", total=len(left))

    def __call__(self, probe: Probe, found: Measured | None) -> None:
        if found is None:
            self._progress.update(self._bar, description=probe.id)
            return
        count = len(found.values)
        failed = Text.assemble(("failed", "red"), f": {found.failed}")
        said = failed if found.failed else Text(f"{count} values, {found.loops} game loops")
        self._progress.print(Text.assemble(f"{probe.id}: ", said, f", {found.run_s:.1f} s"), soft_wrap=True)
        self._progress.advance(self._bar)


def _end(screen: Console, out: Path, done: Calibration, *, as_json: bool) -> None:
    failed = [name for name, probe in done.probes.items() if probe.failed]
    seconds = sum(probe.run_s for probe in done.probes.values())
    screen.print(f"{len(done.probes)} probes in {seconds:.0f} s: {out}", soft_wrap=True)
    if as_json:
        typer.echo(json.dumps({"file": str(out), "probes": len(done.probes), "failed": failed, "run_s": seconds}))
    if failed:
        screen.print(f"failed: {', '.join(failed)}; --resume tries them again", soft_wrap=True)
        raise typer.Exit(FAILED)
