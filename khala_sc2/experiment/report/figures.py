"""Summaries of cells as pictures: a dot for each cell with its interval, in colours that everyone can tell apart.

Cells of a task stand together. The values of the last factor share a row, in colours and marks of their own.
"""

from __future__ import annotations

import io
import itertools
import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from khala_protocol.visible import visible_line
from khala_sc2.experiment.report.document import Figure

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

    from khala_sc2.experiment.report.summary import CellSummary
    from khala_sc2.experiment.statistics import Interval

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Of Okabe and Ito, Color Universal Design, 2008."""
MARKS = "osD^vP"
INK, FAINT = "#1c2430", "#8a94a3"
"""Words and lines; `khala_sc2.experiment.report.html` replaces them by the colours of its page."""
WIDTH, ROW, EDGE = 7.6, 0.27, 1.15
"""Inches: of the picture, of a row, and of what is above and below all rows."""
LONGEST = 40
"""Characters of a name."""
LEAST_KD = 1 / 32
MOST_KD = 32
"""K/D outside of these stands at the edge, with an arrow."""
WINS_CAPTION = "Games won, with Wilson intervals of 95 %."
KD_CAPTION = (
    "K/D: value killed / value lost, with bootstrap intervals of 95 %. Dotted: nothing was killed or nothing lost, so "
    "that the games do not say how much more it might be."
)
STYLE: Any = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.5,
    "svg.fonttype": "none",  # words can be searched, and take the font of the page
    "svg.hashsalt": "khala",  # the same numbers give the same file
    "text.parse_math": False,  # a name may hold dollars
    "axes.facecolor": "none",
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "xtick.color": INK,
    "ytick.color": INK,
}


@dataclass(frozen=True, slots=True)
class _Row:
    """A row of dots, or a heading."""

    name: str
    y: float
    dots: tuple[tuple[int, CellSummary], ...]
    """Each with the number of its colour."""
    heading: bool = False


def figures(summaries: Sequence[CellSummary]) -> list[Figure]:
    """Return the pictures of cells that have games."""
    played = [summary for summary in summaries if summary.games]
    killed = [summary for summary in played if summary.kd.value is not None]
    wins = Figure("win_rate", WINS_CAPTION, partial(_draw_figure, played, _win_rate_axis, lambda summary: summary.won))
    kd = Figure("kd", KD_CAPTION, partial(_draw_figure, killed, _kd_axis, lambda summary: summary.kd))
    return [figure for figure, cells in ((wins, played), (kd, killed)) if cells]


def _draw_figure(
    summaries: Sequence[CellSummary],
    axis: Callable[[Axes, Sequence[Interval]], tuple[float, float]],
    value: Callable[[CellSummary], Interval],
    kind: str,
) -> bytes:
    import matplotlib as mpl  # noqa: PLC0415  # half a second, for reports alone
    from matplotlib.figure import Figure as Canvas  # noqa: PLC0415

    colours = _colours(summaries)
    rows = _rows(summaries, colours)
    with mpl.rc_context(STYLE):
        canvas = Canvas(figsize=(WIDTH, EDGE + ROW * (rows[-1].y + 1)), layout="constrained")
        axes = canvas.add_subplot()
        low, high = axis(axes, [value(summary) for summary in summaries])
        for row in rows:
            _draw(axes, row, value, low, high, len(colours))
        _finish(axes, rows)
        _legend(canvas, colours)
        return _bytes(canvas, kind)


def _colours(summaries: Sequence[CellSummary]) -> list[str]:
    """Return the values that have colours: those of the last factor, unless they are the tasks or too many."""
    *first, last = summaries[0].where
    values = list(dict.fromkeys(summary.where[last] for summary in summaries))
    return values if first and 1 < len(values) <= len(COLOURS) else []


def _rows(summaries: Sequence[CellSummary], colours: list[str]) -> list[_Row]:
    """Return rows by task; a task of one row has no heading of its own."""
    keys = list(summaries[0].where)[: -1 if colours else None]
    task = "task" if "task" in keys else keys[0]
    groups: dict[str, dict[str, list[tuple[int, CellSummary]]]] = {}
    for summary in summaries:
        rest = ", ".join(summary.where[name] for name in keys if name != task)
        dot = (colours.index(list(summary.where.values())[-1]) if colours else 0, summary)
        groups.setdefault(summary.where[task], {}).setdefault(rest, []).append(dot)
    rows: list[_Row] = []
    y = 0.0
    for name, inner in groups.items():
        if len(inner) > 1:
            rows.append(_Row(name, y, (), heading=True))
            y += 0.9
        for rest, dots in inner.items():
            rows.append(_Row(rest if len(inner) > 1 else ", ".join(filter(None, (name, rest))), y, tuple(dots)))
            y += max(1.0, 0.42 * max(len(colours), 1) + 0.4)
        y += 0.35 if len(inner) > 1 else 0
    return rows


def _draw(
    axes: Axes, row: _Row, value: Callable[[CellSummary], Interval], low: float, high: float, colours: int
) -> None:
    for number, summary in row.dots:
        interval = value(summary)
        y = row.y + (number - (colours - 1) / 2) * 0.42 if colours else row.y
        left = max(low, interval.low)
        right = min(high, interval.high)
        colour = COLOURS[number]
        assert interval.value is not None
        known = math.isfinite(interval.high)
        axes.plot([left, right], [y, y], color=colour, linewidth=1.4 if known else 1.0, alpha=0.75 if known else 0.4,
                  linestyle="-" if known else ":", solid_capstyle="round")  # fmt: skip
        mark = "<" if interval.value < low else ">" if interval.value > high else MARKS[number]
        axes.plot([min(high, max(low, interval.value))], [y], mark, color=colour, markersize=4.8, markeredgewidth=0,
                  clip_on=False, zorder=3)  # fmt: skip


def _win_rate_axis(axes: Axes, intervals: Sequence[Interval]) -> tuple[float, float]:
    del intervals
    axes.set_xlim(0, 1)
    axes.set_xticks([0, 0.25, 0.5, 0.75, 1], ["0", "25", "50", "75", "100 %"])
    axes.set_xlabel("games won")
    return 0, 1


def _kd_axis(axes: Axes, intervals: Sequence[Interval]) -> tuple[float, float]:
    """Set a scale on which twice as many and half as many are as far from 1."""
    bounds = [
        bound
        for interval in intervals
        for bound in (interval.low, interval.value, interval.high)
        if bound and math.isfinite(bound)
    ]
    most = max((abs(math.log2(bound)) for bound in bounds), default=1)
    powers = min(math.ceil(most + 1e-9), round(math.log2(MOST_KD)))
    low, high = 2.0**-powers, 2.0**powers
    axes.set_xscale("log", base=2)
    axes.set_xlim(low, high)
    ticks = [2.0**power for power in range(-powers, powers + 1)]
    axes.set_xticks(ticks, [f"1/{1 / tick:g}" if tick < 1 else f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.axvline(1, color=FAINT, linewidth=1, zorder=0)
    axes.set_xlabel("K/D")
    return low, high


def _finish(axes: Axes, rows: Sequence[_Row]) -> None:
    axes.set_ylim(rows[-1].y + 0.8, -0.8)
    axes.set_yticks([row.y for row in rows], [_short(row.name) for row in rows])
    for label, row in zip(axes.get_yticklabels(), rows, strict=True):
        label.set_fontweight("bold" if row.heading else "normal")
    axes.tick_params(axis="both", length=0, pad=6)
    axes.grid(visible=True, axis="x", color=FAINT, alpha=0.25, linewidth=0.7)
    axes.set_axisbelow(True)
    for row in itertools.compress(rows, [not row.heading for row in rows]):
        axes.axhline(row.y, color=FAINT, alpha=0.12, linewidth=0.7, zorder=0)
    for name in ("top", "left", "right"):
        axes.spines[name].set_visible(False)


def _legend(canvas: Canvas, colours: Sequence[str]) -> None:
    from matplotlib.lines import Line2D  # noqa: PLC0415

    handles = [
        Line2D([], [], color=COLOURS[i], marker=MARKS[i], markersize=4.8, linewidth=1.4, label=_short(name))
        for i, name in enumerate(colours)
    ]
    if handles:
        canvas.legend(handles=handles, loc="outside upper right", ncols=3, frameon=False, handlelength=1.8)


def _short(name: str) -> str:
    """Return a name that any font has."""
    words = visible_line(name).encode("latin-1", "backslashreplace").decode("latin-1")
    return words if len(words) <= LONGEST else f"{words[: LONGEST - 1]}…"


def _bytes(canvas: Canvas, kind: str) -> bytes:
    file = io.BytesIO()
    dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}
    canvas.savefig(file, format=kind, dpi=170, metadata=dates[kind], facecolor="none" if kind == "svg" else "white")
    return file.getvalue()
