"""Unmodified PySC2 plays on an install of the simulator."""

import hashlib
import random
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.compat import actions, features, sc2_env
from khala_simulator.process.client import command

pytestmark = pytest.mark.game

MakeEnv = Callable[..., Any]
ALLIANCE, TAG = features.FeatureUnit.alliance, features.FeatureUnit.tag


def tags(timestep: Any, alliance: int) -> list[int]:
    units = timestep.observation.raw_units
    return [int(tag) for tag in units[units[:, ALLIANCE] == alliance][:, TAG]]


def focus(timestep: Any) -> sc.Action:
    """Return an attack of all own units on the first enemy that is left."""
    enemies = tags(timestep, features.PlayerRelative.ENEMY)
    return command(3674, tags(timestep, features.PlayerRelative.SELF), target=enemies[0]) if enemies else sc.Action()


def test_the_first_observation_is_there_soon(make_env: MakeEnv) -> None:
    started_s = time.monotonic()
    timestep = make_env().reset()[0]
    duration_s = time.monotonic() - started_s
    assert timestep.first()
    assert len(timestep.observation.feature_units) == 10
    assert duration_s < 10.0  # 1.1 s on an idle machine, of which PySC2 waits 1 s; 4.5 s on a busy slow one


@pytest.mark.slow
def test_a_battle_is_played_to_its_end_by_raw_actions(make_env: MakeEnv, no_process_left: None) -> None:
    env = make_env()
    timestep = env.reset()[0]
    steps = 0
    while not timestep.last():
        timestep = env.step([focus(timestep)])[0]
        steps += 1
    assert timestep.reward in {-1, 0, 1}
    assert 10 < steps <= 180
    assert timestep.observation.score_cumulative.killed_value_units > 0
    env.close()


def test_two_resets_begin_anew(make_env: MakeEnv) -> None:
    env = make_env()
    for _ in range(3):
        timestep = env.reset()[0]
        assert timestep.first()
        assert timestep.observation.game_loop == [0]
        for _ in range(5):
            timestep = env.step([sc.Action()])[0]
        assert timestep.observation.game_loop == [40]


def fingerprints(make_env: MakeEnv, seed: int) -> list[str]:
    env = make_env("Map3s5z", random_seed=seed)
    timestep = env.reset()[0]
    found = []
    for _ in range(25):
        timestep = env.step([focus(timestep)])[0]
        found.append(hashlib.sha256(env._obs[0].SerializeToString(deterministic=True)).hexdigest())
    env.close()
    return found


@pytest.mark.slow
def test_the_same_seed_gives_the_same_observations_in_another_process(make_env: MakeEnv) -> None:
    first, again, other = (fingerprints(make_env, seed) for seed in (5, 5, 6))
    assert first == again
    assert first != other


@pytest.mark.parametrize(
    ("map_name", "screen", "minimap", "steps"),
    [
        ("Map2s3z", (84, 87), (64, 67), 60),
        pytest.param("Map2s3z", 84, 64, 300, marks=pytest.mark.slow),
        pytest.param("Map2cVs64zg", 32, 32, 60, marks=pytest.mark.slow),
    ],
)
def test_a_random_agent_never_breaks_the_game(
    make_env: MakeEnv, map_name: str, screen: Any, minimap: Any, steps: int
) -> None:
    layers = sc2_env.AgentInterfaceFormat(
        feature_dimensions=sc2_env.Dimensions(screen=screen, minimap=minimap), use_feature_units=True
    )
    env = make_env(map_name, agent_interface_format=layers)
    spec = env.action_spec()[0]
    draw = random.Random(3)
    timestep = env.reset()[0]
    for _ in range(steps):
        function = draw.choice(list(timestep.observation.available_actions))
        arguments = [[draw.randrange(size) for size in argument.sizes] for argument in spec.functions[function].args]
        timestep = env.step([actions.FunctionCall(function, arguments)])[0]
    assert np.isfinite(timestep.observation.feature_units).all()


def test_clicks_on_units_command_them(make_env: MakeEnv) -> None:
    env = make_env()
    timestep = env.reset()[0]
    unit = next(u for u in timestep.observation.feature_units if u.alliance == features.PlayerRelative.SELF)
    timestep = env.step([actions.FUNCTIONS.select_point("select_all_type", [unit.x, unit.y])], step_mul=1)[0]
    assert list(timestep.observation.last_actions) == [actions.FUNCTIONS.select_point.id]
    assert (timestep.observation.multi_select[:, 0] == unit.unit_type).all()
    assert actions.FUNCTIONS.Attack_screen.id in timestep.observation.available_actions
    timestep = env.step([actions.FUNCTIONS.Attack_screen("now", [100, 64])], step_mul=1)[0]
    assert list(timestep.observation.last_actions) == [actions.FUNCTIONS.Attack_screen.id]
    timestep = env.step([actions.FUNCTIONS.select_army("select")], step_mul=1)[0]
    assert len(timestep.observation.multi_select) == 5


@pytest.mark.filterwarnings("ignore:datetime.datetime.utcnow:DeprecationWarning")  # PySC2 names the file by it
def test_a_replay_is_written_where_pysc2_wants_it(make_env: MakeEnv, tmp_path: Path) -> None:
    env = make_env(save_replay_episodes=1, replay_dir=str(tmp_path), game_steps_per_episode=40)
    timestep = env.reset()[0]
    while not timestep.last():
        timestep = env.step([focus(timestep)])[0]
    (replay,) = tmp_path.glob("*.SC2Replay")
    assert replay.stat().st_size > 100
