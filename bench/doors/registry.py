"""All rows, in the order in which they are played."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bench.doors import worlds

if TYPE_CHECKING:
    from bench.doors.rows import Row

ROWS: Final[tuple[Row, ...]] = (*worlds.ROWS,)
