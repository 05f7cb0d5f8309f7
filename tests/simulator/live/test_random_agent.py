"""PySC2's own random agent presses whatever is there, and nothing breaks."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from absl import logging

from khala_bridge.compat import features, maps, sc2_env

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.game

STEPS = int(os.environ.get("KHALA_RANDOM_STEPS", "2000"))
SHORT = 60


class Random2s3z(maps.Map):  # type: ignore[misc]  # PySC2 has no types
    directory = "llm_smac"
    filename = "2s3z"
    players = 2


class RandomTask6(maps.Map):  # type: ignore[misc]  # PySC2 has no types
    directory = "llm_pysc2"
    filename = "pvz_task6_level1"
    players = 2


class RandomTask8(RandomTask6):
    filename = "pvz_task8_level1"


RACES = sc2_env.Race
MAPS = {
    "Random2s3z": (RACES.protoss, True),
    "RandomTask6": (RACES.protoss, True),
    "RandomTask8": (RACES.protoss, True),
    "Simple64": (RACES.random, True),
    "DefeatZerglingsAndBanelings": (RACES.terran, False),
}


def assert_sane(timestep: Any, size: tuple[int, int]) -> None:
    """Check that every number that an agent gets is finite, and that every unit is on the map."""
    units = np.asarray(timestep.observation.raw_units).reshape(-1, len(features.FeatureUnit))
    assert np.isfinite(np.asarray(units, dtype=np.float64)).all()
    x, y = units[:, features.FeatureUnit.x], units[:, features.FeatureUnit.y]
    inside = units[:, features.FeatureUnit.is_in_cargo] == 0
    assert (x[inside] >= 0).all()
    assert (y[inside] >= 0).all()
    assert (x[inside] <= size[0]).all()
    assert (y[inside] <= size[1]).all()
    assert np.isfinite(np.asarray(timestep.observation.player)).all()


def run_at_random(make_env: Callable[..., Any], name: str, steps: int, capfd: pytest.CaptureFixture[str]) -> None:
    from pysc2.agents.random_agent import RandomAgent

    race, opponent = MAPS[name]
    players = [sc2_env.Agent(race)]
    if opponent:
        players.append(sc2_env.Bot(RACES.zerg, sc2_env.Difficulty.easy))
    np.random.seed(7)  # the agent draws from the global generator
    env, agent = make_env(name, players=players), RandomAgent()
    agent.setup(env.observation_spec()[0], env.action_spec()[0])
    agent.reset()
    timestep = env.reset()[0]
    map_size = env._controllers[0].game_info().start_raw.map_size
    for _ in range(steps):
        timestep = env.step([agent.step(timestep)])[0]
        assert_sane(timestep, (map_size.x, map_size.y))
    env.close()
    assert "Traceback" not in capfd.readouterr().err


@pytest.fixture(autouse=True)
def quiet() -> None:
    logging.set_verbosity(logging.ERROR)


@pytest.mark.filterwarnings("ignore")  # of PySC2
def test_a_random_agent_meets_no_fault(make_env: Callable[..., Any], capfd: pytest.CaptureFixture[str]) -> None:
    run_at_random(make_env, "Simple64", SHORT, capfd)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", MAPS)
@pytest.mark.filterwarnings("ignore")  # of PySC2
def test_a_random_agent_meets_no_fault_in_two_thousand_steps(
    name: str, make_env: Callable[..., Any], capfd: pytest.CaptureFixture[str]
) -> None:
    run_at_random(make_env, name, STEPS, capfd)
