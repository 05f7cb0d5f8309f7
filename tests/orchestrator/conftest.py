from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.roster import Seat
from khala_orchestrator.turn import Question
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.messages import Observation, View

if TYPE_CHECKING:
    from collections.abc import Callable

RUN = "test"
ZEALOTS, STALKERS = Seat("p1", "Zealots"), Seat("p1", "Stalkers")


@pytest.fixture
def broker() -> MemoryBroker:
    return MemoryBroker()


@pytest.fixture
def observe() -> Callable[..., list[Question]]:
    def make(*seats: Seat, step: int = 0, within_s: float | None = None) -> list[Question]:
        return [
            Question(
                Observation(
                    run=RUN,
                    side=seat.side,
                    agent=seat.agent,
                    episode=0,
                    step=step,
                    game_loop=8 * step,
                    answer_within_s=within_s,
                    text="",
                    view=View(time_s=0.0),
                )
            )
            for seat in seats
        ]

    return make
