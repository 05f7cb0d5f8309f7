"""Numeric environments: what a step does, what it is worth, and what is refused."""

from __future__ import annotations

import pickle
from functools import partial
from typing import TYPE_CHECKING, Any

import cloudpickle  # type: ignore[import-untyped]  # it has no types
import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

from khala_protocol.errors import ConfigError
from khala_sc2.env import numeric
from khala_sc2.env.numeric import CentralEnv, StarCraft2Env, parallel_env
from khala_simulator.battle import Battle

if TYPE_CHECKING:
    from collections.abc import Callable


STOP, NORTH, SOUTH, EAST, FIRST_ENEMY = 1, 2, 3, 4, 6


def play(env: StarCraft2Env, choose: Callable[[StarCraft2Env], list[int]]) -> tuple[float, dict[str, Any]]:
    """Play an episode; return its reward, and how it ended."""
    env.reset()
    total, over, info = 0.0, False, dict[str, Any]()
    while not over:
        reward, over, info = env.step(choose(env))
        total += reward
    return total, info


def common_target(env: StarCraft2Env) -> list[int]:
    """Attack the weakest enemy of those that most agents reach; wait until one is in reach."""
    reach = env.masks()[:, FIRST_ENEMY:]
    life = env.get_state_dict()["enemies"][:, 0]
    first = int(np.lexsort((life, -reach.sum(0)))[0]) + FIRST_ENEMY
    rest = EAST if reach.any() else STOP
    wishes = [(first, *range(FIRST_ENEMY, env.n_actions), rest, STOP, 0)] * env.n_agents
    return [next(one for one in wish if can[one]) for wish, can in zip(wishes, env.masks(), strict=True)]


def fight(env: StarCraft2Env, rng: np.random.Generator) -> list[int]:
    """Attack what can be attacked, and walk on."""
    return [int(rng.choice(np.flatnonzero(can)[-2:])) for can in env.masks()]


def test_units_walk_where_actions_say_and_stop() -> None:
    env = StarCraft2Env("3m", seed=1)
    env.reset()
    before = env.get_state_dict()["allies"]
    south, middle, north = np.argsort(before[:, 3]).tolist()  # nobody is in another's way
    orders = {south: SOUTH, middle: EAST, north: NORTH}
    env.step([orders[agent] for agent in range(3)])
    env.step([1, 1, 1])
    moved = (env.get_state_dict()["allies"] - before)[:, 2:4]
    assert moved[north, 1] > 0 > moved[south, 1]
    assert moved[middle, 0] > 0


def test_a_win_is_worth_20_in_all() -> None:
    env = StarCraft2Env("8m", seed=4, difficulty="1")
    total, info = play(env, common_target)
    assert info == {"battle_won": True, "dead_allies": info["dead_allies"], "dead_enemies": 8}
    assert env.max_reward == 8 * 10 + 200 + 8 * 45
    assert total == pytest.approx(20)  # Marines regain nothing
    assert (env.battles_won, env.battles_game, env.timed_out) == (1, 1, False)


def test_who_only_walks_loses_and_is_worth_nothing() -> None:
    env = StarCraft2Env("3m", seed=1, reward_only_positive=False, reward_defeat=-200)
    total, info = play(env, lambda env: [EAST if can[EAST] else STOP if can[STOP] else 0 for can in env.masks()])
    assert info == {"battle_won": False, "dead_allies": 3, "dead_enemies": 0}
    lost = 0.5 * 3 * (45 + 10) + 200
    assert total == pytest.approx(-lost / env.max_reward * 20, rel=0.1)  # stopped Marines fire back a little


def test_the_dead_do_nothing_and_see_nothing() -> None:
    env = StarCraft2Env("3m", seed=2)
    env.reset()
    rng = np.random.default_rng(2)
    while env.masks()[:, STOP].all():
        env.step(fight(env, rng))
    dead = int(np.flatnonzero(env.masks()[:, 0])[0])
    assert env.get_avail_agent_actions(dead) == [1] + [0] * 8
    assert not env.get_obs_agent(dead).any()
    assert not env.get_visibility_matrix()[dead].any()


@pytest.mark.parametrize("name", ["MMM", *(pytest.param(n, marks=pytest.mark.slow) for n in ("MMM2", "bane_vs_bane"))])
def test_sizes_are_those_that_are_told(name: str) -> None:
    env = StarCraft2Env(name, seed=1)
    obs, state = env.reset()
    info = env.get_env_info()
    assert [len(one) for one in obs] == [info["obs_shape"]] * info["n_agents"]
    assert state.shape == (info["state_shape"],)
    parts = env.get_state_dict()
    assert parts["allies"].shape == (info["n_agents"], len(info["agent_features"]))
    assert parts["enemies"].shape == (env.n_enemies, len(info["enemy_features"]))


def test_a_medivac_heals_and_does_not_attack() -> None:
    env = StarCraft2Env("MMM", seed=1)
    env.reset()
    healers = [
        agent
        for agent, kind in enumerate(env.get_unit_types()[: env.n_agents])
        if kind == max(env.get_unit_types()[:10])
    ]
    reach = env.masks()[healers[0], FIRST_ENEMY:]
    assert reach.any()
    assert not reach[healers].any()


def test_the_same_seed_is_the_same_game_and_another_is_another() -> None:
    worlds = []
    for seed in (1, 1, 2):
        env = StarCraft2Env("2s3z", seed=seed)
        rng = np.random.default_rng(0)
        env.reset()
        for _ in range(20):
            env.step(fight(env, rng))
        worlds.append(env.battle.digest())
    assert worlds[0] == worlds[1] != worlds[2]


def test_a_seed_begins_a_new_game_and_none_goes_on() -> None:
    env = CentralEnv("3m", max_cycles=2)
    first, _ = env.reset(seed=3)
    for _ in range(2):
        env.step(np.array([EAST, EAST, EAST]))
    assert env.battles.battle.loop == 16
    env.reset()
    assert env.battles.battle.loop == 18
    again, _ = env.reset(seed=3)
    assert env.battles.battle.loop == 0
    np.testing.assert_array_equal(first["state"], again["state"])


def test_a_reset_in_the_middle_of_an_episode_goes_on_in_the_same_game() -> None:
    env = CentralEnv("3m", seed=3)
    first, _ = env.reset()
    again = first
    for episode in range(1, 4):
        env.step(np.array([EAST, EAST, EAST]))
        again, _ = env.reset()
        assert env.battles.battle.loop == episode * 10  # a step of eight loops, and two for the new units
        assert env.battles.masks()[:, 1:].any(axis=1).all()
        assert env.battles.get_stats()["battles_game"] == 0
    assert not np.array_equal(first["state"], again["state"])  # chance goes on as well


def played_on(made: Any) -> str:
    """Play six steps with fixed chance, and return the world's digest."""
    battles, dice = made.unwrapped.battles, np.random.default_rng(5)
    for _ in range(6):
        battles.step(fight(battles, dice))
    digest: str = battles.battle.digest()
    return digest


MAKERS: dict[str, Callable[[], Any]] = {
    "parallel": lambda: parallel_env("3m"),
    "aec": lambda: numeric.env("3m"),
    "central": lambda: CentralEnv("3m"),
    "gymnasium": lambda: gymnasium.make("khala_sc2.env.numeric:khala-smac/3m-v0"),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
@pytest.mark.parametrize("library", [pickle, cloudpickle], ids=["pickle", "cloudpickle"])
def test_an_environment_is_pickled_before_and_in_an_episode(make: Callable[[], Any], library: Any) -> None:
    fresh = library.loads(library.dumps(make()))
    fresh.reset(seed=2)
    one = make()
    one.reset(seed=2)
    assert one.unwrapped.battles.battle.digest() == fresh.unwrapped.battles.battle.digest()
    copy = library.loads(library.dumps(one))
    before = one.unwrapped.battles.battle.digest()
    ends = [played_on(game) for game in (one, copy)]
    assert ends[0] == ends[1] != before


@pytest.mark.slow
def test_environments_play_in_processes_that_share_no_memory_with_this_one() -> None:
    envs = AsyncVectorEnv([partial(CentralEnv, "3m")] * 2, context="spawn")
    try:
        seen, _ = envs.reset(seed=4)
    finally:
        envs.close()
    np.testing.assert_array_equal(seen["state"][1], CentralEnv("3m").reset(seed=5)[0]["state"])


def test_an_action_that_is_not_available_is_replaced_by_stop() -> None:
    one, other = parallel_env("3m"), parallel_env("3m")
    for env, action in ((one, FIRST_ENEMY), (other, 1)):
        seen, _ = env.reset(seed=1)
        assert not seen["agent_0"]["action_mask"][FIRST_ENEMY:].any()
        env.step(dict.fromkeys(env.agents, action))
    np.testing.assert_array_equal(one.state(), other.state())


def test_an_episode_that_ends_at_its_limit_is_truncated() -> None:
    env = parallel_env("3m", max_cycles=1)
    env.reset(seed=1)
    _, _, terminated, truncated, _ = env.step(dict.fromkeys(env.agents, 1))
    assert (set(terminated.values()), set(truncated.values()), env.agents) == ({False}, {True}, [])
    assert env.step({}) == ({}, {}, {}, {}, {})


def test_a_picture_shows_where_the_units_are() -> None:
    env = parallel_env("3m", render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    assert before is not None
    assert before.shape == (512, 512, 3)
    for _ in range(4):
        env.step(dict.fromkeys(env.agents, EAST))
    after = env.render()
    assert after is not None
    assert not np.array_equal(after, before)
    assert parallel_env("3m").render() is None


def test_smacs_own_interface_refuses_what_is_not_available() -> None:
    env = StarCraft2Env("3m", seed=1)
    with pytest.raises(ValueError, match="the episode is over: call reset"):
        env.step([1, 1, 1])
    with pytest.raises(RuntimeError, match="no episode has begun"):
        _ = env.battle
    env.reset()
    with pytest.raises(ValueError, match=r"agent 1 cannot perform action 6: it can perform \[1, 2, 3, 4, 5\]"):
        env.step([1, 6, 1])
    with pytest.raises(ValueError, match="there are 2 actions for 3 agents"):
        env.step([1, 1])
    with pytest.raises(ValueError, match="there is no window"):
        env.render("human")


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("3s_vs_6z", {}, "SMAC has no map '3s_vs_6z': did you mean 3s_vs_"),
        ("3m", {"difficulty": "B"}, "difficulty 'B' is not a level: give one of 1, 2, 3"),
        ("3m", {"step_mul": 0}, "step_mul is 0: a step has at least one game loop"),
        ("3m", {"heuristic_ai": True}, r"heuristic_ai is True and can only be False: step\(\) takes the actions"),
        ("3m", {"replay_dir": "replays"}, "replay_dir is 'replays' and can only be '': no replay is written"),
        ("3m", {"window_size_x": 640}, "window_size_x is 640 and can only be 1920: there is no window"),
        ("3m", {"debug": True}, "debug is True and can only be False: nothing is logged"),
        ("3m", {"game_version": "4.6.2"}, "no tables of game_version '4.6.2', only of 4.10 and 5.0.13: leave it out"),
        ("3m", {"reward_scal": True}, "there is no option 'reward_scal': did you mean reward_scale"),
        ("3m", {"use_unit_ranges": True}, "use_unit_ranges is an option of SMACv2: play its own package"),
    ],
)
def test_what_cannot_be_played_is_said(name: str, options: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        StarCraft2Env(name, **options)


def test_files_of_settings_that_name_every_option_of_smac_are_taken() -> None:
    defaults: dict[str, Any] = {"game_version": None, "replay_dir": None, "replay_prefix": "", "window_size_x": 1920,
                "window_size_y": 1200, "heuristic_ai": False, "heuristic_rest": True, "debug": False}  # fmt: skip
    env = StarCraft2Env("3m", seed=1, **defaults)
    np.testing.assert_array_equal(env.reset()[1], StarCraft2Env("3m", seed=1).reset()[1])
    newer = StarCraft2Env("3m", seed=1, game_version="5.0.13")
    newer.reset()
    assert newer.battle.digest() != env.battle.digest()


def test_names_of_smac_tell_of_an_observations_parts_the_units_and_the_map() -> None:
    env = StarCraft2Env("MMM", seed=1, obs_last_action=True, obs_pathing_grid=True, obs_terrain_height=True)
    with pytest.raises(RuntimeError, match="no episode has begun"):
        _ = env.agents
    with pytest.raises(AttributeError, match="no attribute 'n_allies'"):
        _ = env.n_allies
    env.reset()
    assert env.obs_terrain_height
    assert (env.n_actions_no_attack, env.unit_type_bits, env.map_type, env.shield_bits_enemy) == (6, 3, "MMM", 0)
    many = [rows * width for rows, width in (env.get_obs_enemy_feats_size(), env.get_obs_ally_feats_size())]
    assert env.get_obs_move_feats_size() + sum(many) + env.get_obs_own_feats_size() == env.get_obs_size()
    healer = max(env.agents.values(), key=lambda unit: unit.unit_type)
    assert (healer.health_max, env.get_unit_type_id(healer, ally=True), env.unit_max_cooldown(healer)) == (150, 2, 200)
    assert env.unit_max_shield(healer) is None
    around = env.get_surrounding_pathing(healer)
    first = next(number for number, unit in env.agents.items() if unit == healer)
    np.testing.assert_array_equal(env.get_obs_agent(first)[4:12], np.array(around, dtype=np.float32))
    env.battle.kill([unit.tag for unit in env.agents.values() if unit != healer])
    env.step([1] * env.n_agents)
    assert env.death_tracker_ally.sum() == env.n_agents - 1
    assert [unit.health > 0 for unit in env.agents.values()].count(True) == 1
    assert (env.only_medivac_left(ally=True), env.only_medivac_left(ally=False)) == (True, False)


def test_a_battle_without_messages_needs_a_map_without_fog() -> None:
    with pytest.raises(ValueError, match="Melee/Simple64 has fog"):
        Battle("Melee/Simple64", seed=1)
