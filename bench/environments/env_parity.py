"""Play random episodes on SMAC's package and on `khala_sc2.env.numeric` at once, and compare everything.

    python -m bench env_parity ~/smac                             23 maps, 500 episodes in all
    python -m bench env_parity ~/smac --maps 3m MMM --episodes 50

The path is a checkout of https://github.com/oxwhirl/smac. SMAC plays through PySC2 on the simulator's server, ours in
this process, with the same seed and actions. Compared after each step, to the bit: observations, state, available
actions, what each agent sees, reward, end and info; when an episode begins and ends, also every other public name that
both have. Every third episode is broken off by a reset. After each episode the worlds have the same digest: SMAC's game
is played again from its replay, since a server does not tell its own.
"""

from __future__ import annotations

import os
import sys
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench.command_line import make_parser
from bench.environments.smac import package_root
from khala_sc2.env.numeric import MAPS, StarCraft2Env
from khala_sc2.playing import games
from khala_simulator.api.game import HostedGame
from khala_simulator.process.replay import Replay
from khala_simulator.tables.versions import DEFAULT_VERSION

EPISODES = 500


class Compared(NamedTuple):
    """The outcome on one map."""

    episodes: int
    steps: int
    differences: int
    """Steps in which something was not the same."""
    worlds: int
    """Episodes after which both worlds had the same digest."""


def compare(theirs: Any, map_name: str, episodes: int, seed: int) -> Compared:
    """Play episodes of one map on both.

    Args:
        theirs: SMAC's class.
        map_name: of the map.
        episodes: how many.
        seed: of the game and of the actions.
    """
    smac = theirs(map_name=map_name, seed=seed)
    ours = StarCraft2Env(map_name, seed=seed)
    rng = np.random.default_rng(seed)
    ends = list[tuple[int, str]]()
    steps = 0
    differences = 0
    for episode in range(episodes):
        smac.reset()
        ours.reset()
        differences += _differ(smac, ours) or _names_differ(smac, ours)
        over = False
        while not over:
            actions = [int(rng.choice(np.flatnonzero(can))) for can in ours.masks()]
            told, own = smac.step(list(actions)), ours.step(actions)
            steps += 1
            differences += told != own or _differ(smac, ours)
            over = own[1] or (episode % 3 == 1 and steps % 20 == 0)
        differences += _names_differ(smac, ours)
        ends.append((ours.battle.loop, ours.battle.digest()))
    differences += smac.get_env_info() != ours.get_env_info() or smac.get_stats() != ours.get_stats()
    replay = Replay.decode(smac._controller.save_replay())  # noqa: SLF001  # SMAC only writes it to a file
    smac.close()
    return Compared(episodes, steps, differences, _same_worlds(replay, ends))


def _differ(smac: Any, ours: StarCraft2Env) -> bool:
    """Return whether anything differs that a learner can ask for."""
    pairs = (
        (np.array(smac.get_obs()), ours.observations()),
        (smac.get_state(), ours.get_state()),
        (np.array(smac.get_avail_actions()), ours.masks()),
        (smac.get_visibility_matrix(), ours.get_visibility_matrix()),
    )
    return not all(np.array_equal(told, own) for told, own in pairs)


SETTINGS = (
    "map_name", "difficulty", "obs_own_health", "obs_all_health", "obs_instead_of_state", "obs_last_action",
    "obs_pathing_grid", "obs_terrain_height", "obs_timestep_number", "state_last_action", "state_timestep_number",
    "reward_sparse", "reward_only_positive", "reward_negative_scale", "reward_death_value", "reward_win",
    "reward_defeat", "reward_scale", "reward_scale_rate", "game_version", "continuing_episode", "heuristic_ai",
    "heuristic_rest", "debug", "window_size", "replay_dir", "replay_prefix", "n_obs_pathing", "n_obs_height",
    "n_actions_no_attack", "n_actions_move", "n_actions", "n_agents", "n_enemies", "episode_limit", "shield_bits_ally",
    "shield_bits_enemy", "unit_type_bits", "map_type", "max_reward", "ally_state_attr_names", "enemy_state_attr_names",
    "battles_won", "battles_game", "timeouts", "force_restarts", "death_tracker_ally", "death_tracker_enemy",
    "last_action", "max_distance_x", "max_distance_y", "map_x", "map_y", "reward", "terrain_height", "pathing_grid",
)  # fmt: skip
SIZES = (
    "get_ally_num_attributes", "get_enemy_num_attributes", "get_obs_move_feats_size", "get_obs_enemy_feats_size",
    "get_obs_ally_feats_size", "get_obs_own_feats_size", "get_unit_types", "get_total_actions", "seed",
)  # fmt: skip
FIELDS = (
    "tag", "unit_type", "owner", "health", "health_max", "shield", "shield_max", "energy", "weapon_cooldown", "pos.x",
    "pos.y",
)  # fmt: skip
OF_UNITS = ("unit_max_cooldown", "unit_max_shield")
OF_PLACES = ("get_surrounding_points", "get_surrounding_pathing", "get_surrounding_height")


def _names_differ(smac: Any, ours: StarCraft2Env) -> bool:
    """Return whether any other public name has another value."""
    return not all(np.array_equal(told, own) for told, own in zip(_values(smac), _values(ours), strict=True))


def _values(env: Any) -> list[Any]:
    values = [getattr(env, name) for name in SETTINGS] + [getattr(env, name)() for name in SIZES]
    values += [env.only_medivac_left(ally=ally) for ally in (True, False)]
    for ally, units in ((True, env.agents), (False, env.enemies)):
        for unit in units.values():
            values.append(attrgetter(*FIELDS)(unit))
            values += [getattr(env, name)(unit) for name in OF_UNITS]
            values += [env.get_unit_type_id(unit, ally)] if env.unit_type_bits else []
    for number in env.agents:
        unit = env.get_unit_by_id(number)
        values += [getattr(env, name)(unit) for name in OF_PLACES]
        values += [env.can_move(unit, way) for way in range(4)]
        values += [env.unit_shoot_range(number), env.unit_sight_range(number)]
    return values


def _same_worlds(replay: Replay, ends: list[tuple[int, str]]) -> int:
    game = HostedGame(replay.setup, DEFAULT_VERSION, replay.log)
    for player, options in replay.interfaces.items():
        game.sit(player, options)
    same = 0
    for loop, digest in ends:
        game.step(loop - game.world.loop)
        same += game.world.digest() == digest
    return same


def main() -> None:
    """Compare what the command line asks for; exit with 1 if anything differs."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("path", type=Path)
    parser.add_argument("--maps", nargs="+", default=list(MAPS))
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of all maps together")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    sys.path.insert(0, str(package_root(options.path)))
    os.environ["SC2PATH"] = str(games.find("simulator")[0])
    from smac.env import StarCraft2Env as Smac  # noqa: PLC0415  # a package that only this measurement needs

    each = -(-options.episodes // len(options.maps))
    wrong = False
    print("| map | episodes | steps | differences | same worlds |\n|---|---:|---:|---:|---:|")
    for map_name in options.maps:
        found = compare(Smac, map_name, each, options.seed)
        wrong |= found.differences > 0 or found.worlds < found.episodes
        print(f"| {map_name} | {found.episodes} | {found.steps} | {found.differences} | {found.worlds} |", flush=True)
    sys.exit(wrong)
