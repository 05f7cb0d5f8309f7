"""Tables of figures; in a pipe or a file, a row is one line."""

from __future__ import annotations

from typing import TYPE_CHECKING, TextIO

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

WIDEST = 10_000
"""Characters of a line that goes into a pipe or a file, where none is cut; no table is as wide."""


def print_table(
    columns: Iterable[str],
    rows: Iterable[Iterable[object]],
    *,
    left: Collection[str] = (),
    title: str | None = None,
    file: TextIO | None = None,
) -> None:
    """Print rows of cells under the names of their columns.

    Args:
        columns: the first one holds words, the others hold numbers.
        rows: cells in the order of the columns.
        left: further columns that hold words.
        title: of the table.
        file: stdout if not given.
    """
    table = Table(title=title, box=None, pad_edge=False)
    for number, name in enumerate(columns):
        table.add_column(name, justify="left" if not number or name in left else "right")
    for row in rows:
        table.add_row(*map(str, row))
    console = Console(file=file)
    Console(file=file, width=None if console.is_terminal else WIDEST, highlight=False).print(table)


def two_digits(value: float | None) -> str:
    """Return a number with two digits, or nothing for none."""
    return "" if value is None else f"{value:.2f}"
