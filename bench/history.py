"""Write the page of all kept results, with a picture of each figure over time.

It reads `bench/results` and writes `docs/measurements-over-time.md` and `docs/images/measurements`. Results of code
that differed from its commit are left out. Machines have colours of their own: values of two say nothing of the code.
"""

from __future__ import annotations

import io
import itertools
import re
import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

from bench.command_line import make_parser
from bench.paths import RESULTS, ROOT
from bench.results import SHORT, every
from docs.pages import markdown
from khala_sc2.experiment.report.figures import COLOURS, FAINT, MARKS, STYLE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from bench.figures import Better
    from bench.results import Machine, Results

PAGE: Final = ROOT / "docs" / "measurements-over-time.md"
PICTURES: Final = ROOT / "docs" / "images" / "measurements"
SIZE: Final = (7.6, 2.3)
"""Inches of a picture."""
BETTER: Final[dict[Better, str]] = {"less": "less is better", "more": "more is better"}
HEAD = """<!-- Written by `python -m bench history` from bench/results: change those, not this page. -->

# Measurements over time

Figures that were measured with `make bench` and kept, a picture each: the median of every run, and a line from the
least to the most of them. A dashed line is a limit that `make limits` checks. Tables have the newest value, and the one
before on the same machine. What the figures are, and where goals are missed, is on the page of
[measurements](measurements.md).

`python -m bench compare A B` says by which factors two of them differ, and how sure that is. `make bench` on a quiet
machine, the file that it writes into `bench/results`, and `python -m bench history` add a point to each picture.
"""
NOTHING = "Nothing is kept yet."

Key: TypeAlias = tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class Point:
    """A figure in one of the results."""

    at: int
    """Place of the results among all, from 0."""
    values: list[float]
    """One of each run."""
    machine: Machine


@dataclass(frozen=True, slots=True)
class Line:
    """A figure over time."""

    bench: str
    name: str
    unit: str
    better: Better
    limit: float | None
    points: list[Point]

    @property
    def file(self) -> str:
        """Name of its picture."""
        return re.sub(r"[^a-z0-9]+", "-", f"{self.bench} {self.name}".lower()).strip("-") + ".svg"


def lines(kept: Sequence[Results]) -> list[Line]:
    """Return all figures over time, by measurement, each as its newest results describe it."""
    points: dict[Key, list[Point]] = {}
    newest = {series.key: series for entry in kept for series in entry.figures}
    for at, entry in enumerate(kept):
        for series in entry.figures:
            if values := series.per_run:
                points.setdefault(series.key, []).append(Point(at, values, entry.machine))
    found = [(newest[key], those) for key, those in points.items()]
    every_line = [
        Line(series.bench, series.name, series.unit, series.better, series.limit, those) for series, those in found
    ]
    order = list(dict.fromkeys(line.bench for line in every_line))
    return sorted(every_line, key=lambda line: order.index(line.bench))


def page(kept: Sequence[Results]) -> str:
    """Return the page."""
    if not kept:
        return markdown.join(HEAD, NOTHING)
    rows = [
        (
            f"{entry.date:%Y-%m-%d}",
            markdown.code(entry.commit[:SHORT]),
            entry.machine,
            max((len(series.runs) for series in entry.figures), default=0),
            entry.load,
        )
        for entry in kept
    ]
    results = markdown.table(("date", "commit", "machine", "runs", "load before"), rows)
    return markdown.join(HEAD, results, *_sections(lines(kept)))


def _sections(found: Sequence[Line]) -> Iterator[str]:
    for bench, group in itertools.groupby(found, key=lambda line: line.bench):
        each = list(group)
        yield f"## {bench}"
        rows = [(line.name, *_newest(line.points), line.unit, BETTER[line.better]) for line in each]
        yield markdown.table(("figure", "before", "newest", "unit", ""), rows)
        for line in each:
            yield f"![{line.name}, {line.unit}, {BETTER[line.better]}](images/{PICTURES.name}/{line.file})"


def _newest(points: Sequence[Point]) -> tuple[str, str]:
    """Return the newest value, after the one before it on the same machine."""
    same = [f"{statistics.median(point.values):.4g}" for point in points if point.machine == points[-1].machine]
    return "".join(same[-2:-1]), same[-1]


def picture(line: Line, titles: Sequence[str], colours: Mapping[Machine, int]) -> bytes:
    """Return the picture of a figure as SVG; `titles` are those of all results, in the order of their places."""
    import matplotlib as mpl  # noqa: PLC0415  # half a second, for this page alone
    from matplotlib.figure import Figure as Canvas  # noqa: PLC0415

    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=SIZE, layout="constrained")
        axes = canvas.add_subplot()
        for machine, number in colours.items():
            here = [point for point in line.points if point.machine == machine]
            if not here:
                continue
            colour = COLOURS[number % len(COLOURS)]
            at = [point.at for point in here]
            axes.vlines(at, [min(p.values) for p in here], [max(p.values) for p in here], color=colour, alpha=0.4)
            middles = [statistics.median(point.values) for point in here]
            axes.plot(at, middles, color=colour, marker=MARKS[number % len(MARKS)], markersize=4.8, linewidth=1.2,
                      label=str(machine))  # fmt: skip
        if line.limit is not None:
            axes.axhline(line.limit, color=FAINT, linestyle="--", linewidth=1)
        axes.set_title(f"{line.bench}: {line.name}", loc="left", fontsize=9.5)
        axes.set_ylabel(f"{line.unit}\n{BETTER[line.better]}")
        axes.set_ylim(bottom=min(0.0, *(value for point in line.points for value in point.values)))
        axes.set_xlim(-0.5, max(len(titles) - 0.5, 0.5))
        step = -(-len(titles) // 8)
        axes.set_xticks(range(0, len(titles), step), [titles[at] for at in range(0, len(titles), step)])
        axes.grid(visible=True, axis="y", color=FAINT, alpha=0.25, linewidth=0.7)
        for name in ("top", "right"):
            axes.spines[name].set_visible(False)
        if len(colours) > 1:
            canvas.legend(loc="outside lower center", frameon=False, fontsize=7)
        file = io.BytesIO()
        canvas.savefig(file, format="svg", metadata={"Date": None}, facecolor="white")
    return file.getvalue()


def write(kept: Sequence[Results], page_path: Path = PAGE, pictures: Path = PICTURES) -> list[Path]:
    """Write the page and its pictures, take away pictures of figures that are gone, and return what was written."""
    found = lines(kept)
    titles = [f"{entry.date:%Y-%m-%d}\n{entry.commit[:SHORT]}" for entry in kept]
    colours = {machine: number for number, machine in enumerate(dict.fromkeys(entry.machine for entry in kept))}
    wanted = {pictures / line.file: line for line in found}
    for old in set(pictures.glob("*.svg")) - set(wanted):
        old.unlink()
    for path, line in wanted.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(picture(line, titles, colours))
    page_path.write_text(page(kept), encoding="utf-8")
    return [page_path, *wanted]


def kept_results(among: Path = RESULTS) -> list[Results]:
    """Return the results of a commit, oldest first."""
    return [entry for _, entry in every(among) if entry.commit and not entry.changed]


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page."""
    make_parser(__doc__, json=False).parse_args(arguments)
    kept = kept_results()
    first, *rest = write(kept)
    print(f"{first.relative_to(ROOT)}: {len(kept)} results, {len(rest)} pictures")
