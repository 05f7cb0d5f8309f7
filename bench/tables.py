"""Tables of figures on a terminal, wide enough for their names where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Literal

LEAST_WIDTH = 140
"""Characters of a line that goes into a file."""


def print_table(columns: Mapping[str, Literal["left", "right"]], rows: Iterable[Sequence[str]]) -> None:
    """Print rows of cells under the names of their columns."""
    table = Table(box=None, pad_edge=False)
    for name, side in columns.items():
        table.add_column(name, justify=side)
    for row in rows:
        table.add_row(*row)
    console = Console()
    Console(width=None if console.is_terminal else LEAST_WIDTH, highlight=False).print(table)
