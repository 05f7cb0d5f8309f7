"""Tables that others published, to print beside ours: a file of `configs/published`, or written into an experiment.

    source: LLM-PySC2 (arXiv 2411.05348), table 2
    where: {model: "{row}", task: "{column}"}    # which of our cells stands at a row and a column
    games: {others: 20, gpt-3.5-turbo: 50}       # of a cell, by row
    columns: [2s3z, 3s5z]
    rows:
      gpt-4o-mini: [0.66 (20), 0.39 (0)]         # K/D by value (win rate in percent)
      gpt-4o: [inf (100), null]                  # nothing was lost; not played

A cell with a win rate alone is a number.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from khala_configs import CONFIGS
from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError
from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from pathlib import Path

FOLDER = "published"
OTHERS = "others"
"""The key of `games` for rows that have none of their own."""
_CELL = re.compile(r"(?:(?P<kd>inf|\d+(?:\.\d+)?) )?\((?P<win_percent>\d+(?:\.\d+)?)\)")


class PublishedCell(Frozen):
    """What was published of one cell."""

    win_rate: float = Field(ge=0, le=1)
    kd: float | None = Field(default=None, ge=0, allow_inf_nan=True)
    """By value; infinite if nothing was lost. None if only wins were published."""


def _read(cell: object) -> object:
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return {"win_rate": cell / 100}
    if not isinstance(cell, str):
        return cell
    if (found := _CELL.fullmatch(cell)) is None:
        raise ValueError(f"write K/D and the win rate in percent, as 0.66 (20), or the win rate alone: {cell!r:.40}")
    kd = found["kd"]
    return {"win_rate": float(found["win_percent"]) / 100, "kd": None if kd is None else float(kd)}


class PublishedTable(Frozen):
    """One table, in the layout in which it was published."""

    source: str
    differs: str = ""
    """How it was played, as far as that differs from our matches."""
    where: dict[str, str] = Field(default_factory=dict)
    """Values of our factors, in which `{row}` and `{column}` stand for their names; empty for a table that none of our
    matches belongs to."""
    games: dict[str, Annotated[int, Field(gt=0)]] = Field(default_factory=dict)
    """Games of a cell, by row, and under `others`; empty if it is not known."""
    columns: tuple[str, ...] = Field(min_length=1)
    rows: dict[str, tuple[Annotated[PublishedCell | None, BeforeValidator(_read)], ...]] = Field(min_length=1)

    @model_validator(mode="after")
    def _whole(self) -> Self:
        for row, cells in self.rows.items():
            if len(cells) != len(self.columns):
                raise ValueError(f"the row {row} has {len(cells)} cells for {len(self.columns)} columns")
        for row in self.games:
            if row != OTHERS and row not in self.rows:
                raise ValueError(f"games names the row {row!r}; the rows are {', '.join(self.rows)}")
        return self

    def games_of(self, row: str) -> int | None:
        """Return how many games each cell of a row has; None if it is not known."""
        return self.games.get(row, self.games.get(OTHERS))

    def cell(self, row: str, column: str) -> PublishedCell | None:
        """Return what was published at a row and a column, if anything."""
        return self.rows[row][self.columns.index(column)] if row in self.rows else None

    def values_at(self, row: str, column: str) -> dict[str, str]:
        """Return the values of our factors at a row and a column."""
        return {name: text.replace("{row}", row).replace("{column}", column) for name, text in self.where.items()}

    @property
    def only_wins(self) -> bool:
        """Whether no cell has a K/D."""
        return all(cell is None or cell.kd is None for cells in self.rows.values() for cell in cells)


def published_tables() -> dict[str, Path]:
    """Return the shipped tables by name."""
    return {path.stem: path for path in sorted((CONFIGS / FOLDER).glob("*.yaml"))}


def table_named(value: Any) -> Any:
    """Return the shipped table of a name; what is no name stays as it is.

    Raises:
        ValueError: there is no such table.
    """
    if not isinstance(value, str):
        return value
    if value not in (tables := published_tables()):
        raise ValueError(f"there is no published table {value!r}: there are {', '.join(tables)}")
    try:
        return load(tables[value], PublishedTable)
    except (ConfigError, ValidationError) as error:
        raise ValueError(str(error)) from None
