"""One observation as a value: each of its parts shows its own moment, at any later time."""

from __future__ import annotations

import gc
import weakref
from typing import TYPE_CHECKING, Any

from khala_bridge.observe import Feedback, Observer
from khala_orchestrator.config import load_task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from khala_bridge.observe import AgentObservation
    from khala_bridge.state import Snapshot

    Make = Callable[..., Any]
    Snap = Callable[..., Snapshot]

PAIR = ["Stalkers", "Zealots"]


def moments(unit: Make, snapshot: Snap) -> list[Snapshot]:
    """Return three moments of a fight: a unit is hurt, then a unit dies."""
    stalker, zealot = unit(1, "Stalker", 10, 16), unit(2, "Zealot", 14, 16)
    foe, hurt = unit(9, "Zealot", 15, 16, alliance="enemy"), unit(2, "Zealot", 14, 16, health=20)
    return [
        snapshot([stalker, zealot, foe], loop=0),
        snapshot([stalker, hurt, foe], loop=8),
        snapshot([stalker, hurt], loop=16, dead=frozenset({9})),
    ]


def words(agents: Mapping[str, AgentObservation], order: Iterable[str] = PAIR) -> dict[str, str]:
    return {name: agents[name].text for name in order}


def test_agents_are_observed_when_they_are_asked_for_and_once(unit: Make, snapshot: Snap) -> None:
    first, *_ = moments(unit, snapshot)
    seen = Observer(load_task("2s3z_pair")).observe(first)
    assert list(seen.agents) == PAIR
    assert len(seen.agents) == 2
    assert "Nobody" not in seen.agents
    assert seen.agents["Zealots"] is seen.agents["Zealots"]


def test_the_order_of_asking_and_the_moment_of_asking_change_nothing(unit: Make, snapshot: Snap) -> None:
    feedback = {"Zealots": Feedback(accepted=("Zealot-1 <Attack_Unit(0x9)>",))}
    at_once, later = Observer(load_task("2s3z_pair")), Observer(load_task("2s3z_pair"))
    in_order, kept = [], []
    for moment in moments(unit, snapshot):
        in_order.append(words(at_once.observe(moment, feedback).agents))
        kept.append(later.observe(moment, feedback))
        words(kept[-1].agents, reversed(PAIR))
    assert "0:00" in in_order[0]["Stalkers"]
    assert len({text for texts in in_order for text in texts.values()}) == 6
    assert [words(seen.agents) for seen in reversed(kept)] == in_order[::-1]


def test_an_observer_keeps_no_more_than_its_last_observation(unit: Make, snapshot: Snap) -> None:
    observer = Observer(load_task("2s3z_pair"))
    first, second, third = moments(unit, snapshot)
    oldest = weakref.ref(observer.observe(first).agents["Zealots"].view)
    observer.observe(second)
    words(observer.observe(third).agents)
    gc.collect()
    assert oldest() is None
