"""Results of measurements that nobody made."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING

import pytest

from bench.results import Machine, Results, Series

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

MACHINE = Machine(cpu="a quick one", cores=2, memory_gb=8, system="Linux", python="3.11.9")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave the rows of the doors out where no long test is asked for: to list them takes each worker five seconds."""
    is_short = config.getoption("markexpr") == "not slow"
    return True if is_short and collection_path.name == "test_door_rows.py" else None


@pytest.fixture
def made() -> Callable[..., Results]:
    """Return a function that makes results of some figures."""

    def make(*figures: Series, commit: str = "a" * 40, day: int = 1, load: float = 0.0, cpu: str = "a quick one",
             changed: bool = False) -> Results:  # fmt: skip
        return Results(
            date=dt.datetime(2026, 11, day, 12, tzinfo=dt.UTC), commit=commit, changed=changed,
            machine=MACHINE.model_copy(update={"cpu": cpu}), load=load, figures=figures,
        )  # fmt: skip

    return make


@pytest.fixture
def step() -> Callable[..., Series]:
    """Return a function that makes a figure of some runs, in ms."""

    def make(*runs: float, name: str = "a step", better: str = "less", limit: float | None = None) -> Series:
        values = tuple((value,) for value in runs)
        return Series.model_validate(
            {"bench": "turn", "name": name, "unit": "ms", "better": better, "runs": values, "limit": limit}
        )

    return make
