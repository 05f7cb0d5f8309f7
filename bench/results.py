"""Results of measurements as files: `bench/results/DATE-COMMIT.json`.

A file has the commit, the machine, the date, and every figure with the values of each run. Below it is
`bench.figures`; `bench.compare` and `bench.history` read what this module writes.
"""

from __future__ import annotations

import datetime as dt
import json
import os
import platform
import re
import statistics
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import psutil
from pydantic import BaseModel, ConfigDict, ValidationError

from bench.figures import Better
from bench.paths import RESULTS, ROOT
from khala_protocol.platforms import cores

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bench.figures import Figure

SHORT = 8
"""Characters of a commit in names."""
CPUINFO = Path("/proc/cpuinfo")


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Machine(_Frozen):
    """What was measured on, without its name."""

    cpu: str
    cores: int
    """Those that this process may use."""
    memory_gb: int
    system: str
    python: str

    def __str__(self) -> str:
        return f"{self.cpu}, {self.cores} cores, {self.memory_gb} GB, {self.system}, Python {self.python}"


class Series(_Frozen):
    """One figure, with the values of every run."""

    bench: str
    name: str
    unit: str
    better: Better
    runs: tuple[tuple[float, ...], ...] = ()
    limit: float | None = None
    skipped: str = ""

    @property
    def key(self) -> tuple[str, str, str]:
        """What it is known by in all results."""
        return self.bench, self.name, self.unit

    @property
    def per_run(self) -> list[float]:
        """The median of each run: values inside of a run scatter less than runs do."""
        return [statistics.median(run) for run in self.runs]


class Results(_Frozen):
    """All figures of one commit on one machine."""

    version: Literal[1] = 1
    """Of this format."""
    date: dt.datetime
    """When it began, UTC."""
    commit: str
    """Empty outside of git."""
    changed: bool
    """Whether files differed from the commit."""
    machine: Machine
    load: float
    """Mean number of processes that waited for a core in the minute before it began; a quiet machine has 0."""
    figures: tuple[Series, ...]

    @property
    def title(self) -> str:
        """What it is, for people."""
        changes = " with changes" if self.changed else ""
        return f"{self.date:%Y-%m-%d %H:%M}, {self.commit[:SHORT] or 'no commit'}{changes}"


def join(bench: str, runs: Iterable[Iterable[Figure]]) -> list[Series]:
    """Return the figures of some runs of a measurement, each with its values of every run."""
    found: dict[str, list[Figure]] = {}
    for run in runs:
        for figure in run:
            found.setdefault(figure.name, []).append(figure)
    return [
        Series(
            bench=bench, name=name, unit=figures[0].unit, better=figures[0].better, limit=figures[0].limit,
            runs=tuple(tuple(map(_short, figure.values)) for figure in figures if figure.values),
            skipped=figures[-1].skipped,
        )
        for name, figures in found.items()
    ]  # fmt: skip


def _short(value: float) -> float:
    """Return a value in six digits, which is more than any measurement here is good for."""
    return float(f"{value:.6g}")


def begin() -> Results:
    """Return results without figures: the commit, the machine and the moment."""
    commit = _git("rev-parse", "HEAD")
    return Results(
        date=dt.datetime.now(dt.UTC).replace(microsecond=0),
        commit=commit,
        changed=bool(commit and _git("status", "--porcelain", "--untracked-files=no")),
        machine=this_machine(),
        load=round(os.getloadavg()[0], 2),
        figures=(),
    )


def this_machine() -> Machine:
    """Return what is known of this machine."""
    named = re.search(r"^model name\s*: (.+)$", CPUINFO.read_text() if CPUINFO.exists() else "", re.MULTILINE)
    return Machine(
        cpu=named[1].strip() if named else platform.machine(),
        cores=cores(),
        memory_gb=round(psutil.virtual_memory().total / 2**30),
        system=platform.system(),
        python=platform.python_version(),
    )


def _git(*words: str) -> str:
    """Return what git says, or nothing where this is no checkout."""
    try:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def write(results: Results, path: Path | None = None, *, into: Path = RESULTS) -> Path:
    """Write results to a path, or to a new file that is named after date and commit; return where."""
    if path is None:
        name = f"{results.date:%Y-%m-%d}-{results.commit[:SHORT] or 'unknown'}{'-changed' if results.changed else ''}"
        names = (name, *(f"{name}-{number}" for number in range(2, 1000)))
        path = next(file for each in names if not (file := into / f"{each}.json").exists())
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(_text(results), encoding="utf-8")
    return path


def _text(results: Results) -> str:
    """Return results as JSON with a line for each figure, so that people can read them."""
    whole = results.model_dump(mode="json")
    figures = ",\n".join(f"  {json.dumps(figure)}" for figure in whole.pop("figures"))
    return json.dumps(whole, indent=1).removesuffix("\n}") + f',\n "figures": [\n{figures}\n ]\n}}\n'


def read(path: Path) -> Results:
    """Read a file of results.

    Raises:
        SystemExit: it is none.
    """
    try:
        return Results.model_validate_json(path.read_bytes())
    except OSError as error:
        raise SystemExit(f"{path} cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise SystemExit(f"{path} holds no results: {where}: {first['msg']}; `python -m bench` writes them") from None


def find(name: str, *, among: Path = RESULTS) -> Path:
    """Return the path of results: a path as it is, or the newest file in `bench/results` of a commit or a date.

    Raises:
        SystemExit: there is none.
    """
    if Path(name).is_file():
        return Path(name)
    kept = every(among)
    found = [path for path, results in kept if results.commit.startswith(name) or path.stem.startswith(name)]
    if found and name:
        return found[-1]
    there = ", ".join(path.stem for path, _ in kept) or "none"
    raise SystemExit(f"there are no results {name!r}: give a file, or the beginning of a commit or date of {there}")


def every(among: Path = RESULTS) -> list[tuple[Path, Results]]:
    """Return all results that are kept, oldest first."""
    kept = [(path, read(path)) for path in among.glob("*.json")]
    return sorted(kept, key=lambda entry: (entry[1].date, entry[0]))
