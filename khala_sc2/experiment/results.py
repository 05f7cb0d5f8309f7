"""The work of `khala experiment compare`, `report` and `export`, which read what was played.

`khala_sc2.experiment.cli` above has the options.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from khala_orchestrator.console import print_table, stderr_console, stdout_console
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError
from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from khala_sc2.experiment.compare import Compared, Findings


TO_SHOW_IT = (
    "To show it: with so many games more, a difference in wins that is as large as it seems here would be found in four"
    " of five experiments."
)


def compare(a: str, b: str, *, allow: Sequence[str], measures: Sequence[str], out: Path, as_json: bool) -> None:
    """Print how two selections of matches compare."""
    from khala_sc2.experiment.compare import compare as compared  # noqa: PLC0415  # scipy takes a second
    from khala_sc2.experiment.numbers import plain  # noqa: PLC0415
    from khala_sc2.experiment.selection import select  # noqa: PLC0415

    findings = compared(select(a, out), select(b, out), measures=measures, allow=allow)
    if as_json:
        typer.echo(json.dumps(plain(findings)))
        return
    screen = stdout_console()
    print_table(_table(findings))
    for line in _remarks(findings):
        screen.print(visible_line(line), soft_wrap=True)


def report(directory: Path, *, formats: str, into: Path | None, by: str, out: Path, as_json: bool) -> None:
    """Write tables and figures of an experiment."""
    from khala_sc2.experiment.numbers import plain  # noqa: PLC0415
    from khala_sc2.experiment.report import FORMATS, write  # noqa: PLC0415
    from khala_sc2.experiment.report import report as make_report  # noqa: PLC0415
    from khala_sc2.experiment.store import Store  # noqa: PLC0415

    store = Store.open(directory, out)
    made = make_report(store, [name.strip() for name in by.split(",") if name.strip()])
    files = write(made.document, into or store.directory / "report", list(FORMATS) if formats == "all" else [formats])
    for warning in made.document.warnings:
        stderr_console().print(visible_line(warning), style="yellow", soft_wrap=True)
    if as_json:
        typer.echo(json.dumps(plain(made.data()) | {"files": list(map(str, files))}))
        return
    for path in files:
        say(str(path))


def export(directory: Path, *, parquet: Path | None, csv: Path | None, out: Path) -> None:
    """Write a row for each episode and side."""
    from khala_sc2.experiment.export import write_csv, write_parquet  # noqa: PLC0415
    from khala_sc2.experiment.store import Store  # noqa: PLC0415

    if parquet is None and csv is None:
        raise ConfigError("name a file to write: --parquet FILE or --csv FILE")
    store = Store.open(directory, out)
    for path, write in ((parquet, write_parquet), (csv, write_csv)):
        if path is not None:
            stderr_console().print(f"{write(store, path)} rows are in {path}", soft_wrap=True)


# --- the comparison in words --------------------------------------------------------------------------


def _table(findings: Findings) -> Table:
    table = Table(box=None, pad_edge=False, title=f"A {visible_line(findings.a)}, B {visible_line(findings.b)}")
    for i, column in enumerate(("task", "measure", "A", "B", "A against B", "p", "corrected", "games", "to show it")):
        table.add_column(column, justify="left" if i < 2 else "right", no_wrap=i < 2)
    for comparison in findings.compared:
        table.add_row(*map(visible_line, _cells(comparison)))
    return table


def _cells(comparison: Compared) -> tuple[str, ...]:
    from khala_sc2.experiment import numbers  # noqa: PLC0415

    estimate = {"win": numbers.share_with, "kd": numbers.ratio_with}.get(comparison.measure, numbers.number_with)
    games = f"{comparison.games} {'pairs' if comparison.paired else 'each'}"
    p = (numbers.p_value(comparison.test.p if comparison.test else None), numbers.p_value(comparison.p_holm))
    return (
        comparison.task,
        comparison.measure,
        estimate(comparison.a),
        estimate(comparison.b),
        _effect(comparison),
        *p,
        games,
        _more(comparison),
    )


def _effect(comparison: Compared) -> str:
    from khala_sc2.experiment import numbers  # noqa: PLC0415

    if comparison.test is None:
        return "needs pairs"
    if comparison.measure == "kd":
        return f"\N{MULTIPLICATION SIGN} {numbers.ratio_with(comparison.test.effect)}"
    return (numbers.points_with if comparison.measure == "win" else numbers.difference_with)(comparison.test.effect)


def _more(comparison: Compared) -> str:
    return f"{max(1, comparison.games_for_power - comparison.games)} more" if comparison.games_for_power else ""


def _remarks(findings: Findings) -> list[str]:
    tests = list(dict.fromkeys(comparison.test.test for comparison in findings.compared if comparison.test))
    lines = [f"Intervals of 95 %. {', '.join(tests)}; corrected for {len(findings.compared)} tests after Holm."]
    if any(comparison.games_for_power for comparison in findings.compared):
        lines.append(TO_SHOW_IT)
    if any(findings.unpaired):
        lines.append(f"Games without a partner: {findings.unpaired[0]} of A, {findings.unpaired[1]} of B.")
    for name, left_out in zip("AB", findings.left_out, strict=True):
        if left_out:
            counts = ", ".join(f"{number} {state}" for state, number in left_out.items())
            lines.append(f"Matches of {name} that are not used: {counts}.")
    if findings.not_shared:
        lines.append(f"Only one of the two has {', '.join(findings.not_shared)}.")
    return lines + [f"They differ, which was allowed: {difference}." for difference in findings.allowed]
