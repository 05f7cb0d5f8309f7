"""Every row of `python -m bench doors`, one test each. To list them takes the imports of all doors: see `conftest`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.doors import playing
from bench.doors.registry import DOORS, load_rows

if TYPE_CHECKING:
    from bench.doors.rows import Row

pytestmark = pytest.mark.slow
ALL = load_rows()


def test_the_table_of_doors_is_that_of_the_rows() -> None:
    assert {row.door for row in ALL} == {door for doors in DOORS.values() for door in doors}
    assert len({(row.door, row.what) for row in ALL}) == len(ALL), "two rows of one name"
    assert {row.door for row in load_rows("khala keys")} == {"khala keys show"}


@pytest.mark.game
@pytest.mark.timeout(120)
@pytest.mark.parametrize("tried", [pytest.param(row, id=f"{row.door}: {row.what}") for row in ALL])
def test_a_row_is_held(tried: Row) -> None:
    outcome = playing.play(tried)
    assert outcome.through == "", outcome.noise
