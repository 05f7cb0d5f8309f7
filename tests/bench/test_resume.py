"""How long the bench of resumed matches takes a host to need."""

from __future__ import annotations

import pytest

from bench.survival.resume import Watch
from khala_protocol.bus.memory import MemoryBroker


@pytest.mark.parametrize(("asked_s", "replay_s"), [(105.0, 5.0), (0.0, 8.0)])
def test_a_host_is_back_when_it_asks_or_ends_a_step_without_a_question(asked_s: float, replay_s: float) -> None:
    watch = Watch(MemoryBroker().session())
    watch.card_s, watch.asked_s, watch.over_s = 100.0, asked_s, 108.0
    kill = watch.kill("token", 16, killed_s=90.0)
    assert (kill.replay_s, kill.away_s) == (replay_s, 18.0)
