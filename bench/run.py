"""Run benchmarks: in this process, or each in a process of its own; keep their figures.

Below it are `bench.registry` and the benchmarks: `--json` prints what they found, `measures` makes figures of that.
"""

from __future__ import annotations

import itertools
import json
import statistics
import subprocess
import sys
from typing import TYPE_CHECKING

from bench import results
from bench.paths import ROOT
from bench.registry import BENCHMARKS
from bench.tables import print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from bench.figures import Figure


def show(name: str) -> None:
    """Run a benchmark, which prints what it found.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    print(f"\n== python -m bench {name}", flush=True)
    subprocess.run(_command(name), check=True, cwd=ROOT)


def figures_of(name: str, options: Sequence[str] = ()) -> list[Figure]:
    """Run a benchmark once, and return its figures.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    said = subprocess.run(_command(name, *options, "--json"), check=True, cwd=ROOT, stdout=subprocess.PIPE).stdout
    return list(BENCHMARKS[name].load().measures(json.loads(said)))


def _command(name: str, *options: str) -> list[str]:
    return [sys.executable, "-m", "bench", name, *options]


def keep(names: Sequence[str], options: Sequence[str], times: int, out: Path | None) -> int:
    """Measure in turns, so that hours of a busy machine fall on all; print the figures, and write them.

    Return 1 if a run failed, else 0.
    """
    found = results.begin()
    runs: dict[str, list[list[Figure]]] = {name: [] for name in names}
    failed: list[str] = []
    for number, name in itertools.product(range(times), names):
        print(f"\n== python -m bench {name} ({number + 1} of {times})", flush=True)
        try:
            runs[name].append(figures_of(name, options))
        except subprocess.CalledProcessError as error:  # what took an hour is kept nevertheless
            failed.append(f"{name} ({number + 1} of {times}): exit code {error.returncode}")
    figures = tuple(series for name in names for series in results.join(name, runs[name]))
    columns = ("measurement", "figure", "median", "least", "most", "unit")
    print_table(columns, rows(figures), left=("figure", "unit"))
    print(f"written to {results.write(found.model_copy(update={'figures': figures}), out)}")
    for run in failed:
        print(f"failed, and without figures: {run}", file=sys.stderr)
    return 1 if failed else 0


def rows(figures: Sequence[results.Series]) -> Iterator[tuple[str, ...]]:
    """Yield the cells of each figure: the median of the runs, the least and the most."""
    for series in figures:
        of_runs = series.per_run
        cells = [f"{of(of_runs):.4g}" if of_runs else "" for of in (statistics.median, min, max)]
        yield series.bench, series.name, *cells, series.unit if of_runs else series.skipped
