"""An endpoint that bills, in every kind of trouble: no cent over the cap. `python -m bench money` has the table."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from bench.doors.rows import Row
from bench.survival.money import KINDS, spend

if TYPE_CHECKING:
    from pathlib import Path

CAP_USD: Final = 0.05
JOBS: Final = 4


async def _play(directory: Path, kind: str) -> str:
    spent = await spend(kind, CAP_USD, JOBS, directory)
    if not spent.requests:
        return "nothing was asked"
    return (
        "" if spent.kept else f"billed {spent.billed_usd:.4f}, booked {spent.booked_usd:.4f}, cap {spent.cap_usd:.2f}"
    )


ROWS: Final[tuple[Row, ...]] = tuple(
    Row("endpoint", f"bills, and is in trouble: {kind}", partial(_play, kind=kind), kind="fault") for kind in KINDS
)
