"""All rows, in the order in which they are played."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bench.doors import endpoints, files, http_doors, money, trust, validity, worlds

if TYPE_CHECKING:
    from bench.doors.rows import Row

ROWS: Final[tuple[Row, ...]] = (
    *trust.ROWS, *money.ROWS, *validity.ROWS, *endpoints.ROWS, *http_doors.ROWS, *files.ROWS, *worlds.ROWS,
)  # fmt: skip
