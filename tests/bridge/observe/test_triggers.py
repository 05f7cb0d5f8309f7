"""What calls an agent that is not asked at every step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.observe import Observer
from khala_bridge.observe.triggers import triggers, vitals
from khala_orchestrator.config import load_task

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.state import Snapshot

    Make = Callable[..., Any]
    Snap = Callable[..., Snapshot]

BUSY: dict[str, Any] = {"orders": [23]}


@pytest.mark.parametrize(
    ("now", "dead", "expected"),
    [
        ({"health": 100} | BUSY, (), []),
        ({"health": 99.5} | BUSY, (), []),
        ({"health": 98} | BUSY, (), ["attacked"]),
        ({"health": 100}, (), ["idle"]),
        ({"health": 60}, (), ["attacked", "idle"]),
        (None, (1,), ["attacked"]),
    ],
    ids=["nothing", "a rounding", "a hit", "no order", "both", "a death"],
)
def test_what_happened_to_an_agents_units(
    unit: Make, snapshot: Snap, now: dict[str, Any] | None, dead: Sequence[int], expected: list[str]
) -> None:
    observer = Observer(load_task("2s3z_pair"))
    others = unit(2, "Zealot", 14, 16, health=5)
    before = vitals(observer.observe(snapshot([unit(1, "Stalker", 10, 16, health=100), others], loop=0)), "Stalkers")
    left = [others] if now is None else [unit(1, "Stalker", 10, 16, **now), others]
    seen = observer.observe(snapshot(left, loop=8, dead=frozenset(dead)))
    assert list(triggers(seen, "Stalkers", before)) == expected
