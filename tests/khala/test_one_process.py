"""Matches with their agents in this process."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

import pytest

from khala_bridge.game.processes import IdleGames
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.messages import Observation
from khala_protocol.recording import Recording
from khala_sc2.playing import one_process
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from pathlib import Path

    from khala_bridge.game.processes import Processes

pytestmark = [pytest.mark.game, pytest.mark.slow]


@pytest.mark.parametrize(
    ("task", "steps"),
    [("pvz_task6_level1", 30), ("2c_vs_64zg", 20), ("simple64_eceb_zerg", 120), ("simple64_sceb_terran", 80)],
)
async def test_a_match_in_a_process_that_has_played_is_that_of_a_new_process(
    task: str, steps: int, tmp_path: Path
) -> None:
    async def observed(name: str, seed: int, processes: Processes | None = None) -> list[Observation]:
        config = MatchConfig(
            task=change(load_task(task), max_steps=steps), run="match", seed=seed, record=tmp_path / f"{name}.mcap"
        )
        await one_process.play(config, {"blue": Minds().with_name("skilled")}, game="simulator", processes=processes)
        assert config.record is not None
        return list(Recording.open(config.record).of(Observation))

    new = await observed("new", 7)
    with closing(IdleGames()) as games:
        other = await observed("other", 8, games)
        again = await observed("again", 7, games)
    assert new == again
    assert new != other
