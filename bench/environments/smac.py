"""Play SMAC's own environments, as its package makes them, on the simulator: every map, two agents, many episodes.

    python -m bench smac ~/smac                                    23 maps, random and heuristic agents, 3 episodes
    python -m bench smac ~/smac --episodes 50 --maps MMM MMM2
    python -m bench smac ~/smac --json                             one JSON object a line on stdout

The path is a checkout of https://github.com/oxwhirl/smac, or where pip has put the package; it is no dependency of this
project. Each map has a process of its own that may take so many seconds an episode, so that a hang is seen. Checked
are the sizes of observations and states, that no game was started again, and that no episode is worth more than 20. It
may be worth more by what enemies regain: SMAC takes the absolute value of what a step is worth, so life and shields
that grow count as much as those that fall, and count again when they fall.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bench.command_line import make_parser
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

AGENTS = ("random", "heuristic")
MOST_REWARD = 20.0
"""What SMAC scales the best episode to, if enemies regain nothing."""
START_S = 30.0


@dataclasses.dataclass(frozen=True, slots=True)
class Played:
    """The episodes of one agent on one map, and what is wrong with them."""

    map: str
    agent: str
    episodes: int = 0
    won: int = 0
    reward: float = 0.0
    """Mean of the episodes."""
    most: float = 0.0
    """Reward of the best one."""
    steps: float = 0.0
    """Mean of the episodes."""
    obs: int = 0
    state: int = 0
    actions: int = 0
    wall_s: float = 0.0
    trouble: str = ""


def package_root(path: Path, package: str = "smac") -> Path:
    """Return the directory from which the package can be imported.

    Raises:
        SystemExit: there is no such package.
    """
    for root in (path, path.parent):
        if (root / package / "env" / "starcraft2").is_dir():
            return root.absolute()
    raise SystemExit(
        f"{path} holds no package {package}: clone https://github.com/oxwhirl/{package} and give the path of that"
    )


def play(map_name: str, agent: str, episodes: int, seed: int) -> Played:
    """Play one map in this process; `smac` must be importable."""
    from smac.env import StarCraft2Env  # noqa: PLC0415  # a package that only this measurement needs

    env = StarCraft2Env(map_name=map_name, seed=seed, heuristic_ai=agent == "heuristic")
    return play_episodes(env, map_name, agent, episodes, seed)


def play_episodes(
    env: Any, map_name: str, agent: str, episodes: int, seed: int, begun: Callable[[], Iterable[str]] = tuple
) -> Played:
    """Play episodes and close the environment; `begun` says what is wrong with the one that begins."""
    begun_s = time.monotonic()
    rng = np.random.default_rng(seed)
    facts = env.get_env_info()
    trouble = list[str]()
    results = []
    for _ in range(episodes):
        env.reset()
        trouble += begun()
        sizes = {len(obs) for obs in env.get_obs()}, len(env.get_state())
        if sizes != ({facts["obs_shape"]}, facts["state_shape"]):
            trouble.append(f"sizes {sizes}")
        results.append(_episode(env, agent, rng))
    if env.force_restarts:
        trouble.append(f"{env.force_restarts} games started again")
    env.close()
    rewards = [result.reward for result in results]
    trouble += [f"an episode worth {result.reward:.2f}" for result in results if result.reward > result.most + 1e-6]
    return Played(
        map_name, agent, episodes, won=sum(result.won for result in results), reward=float(np.mean(rewards)),
        most=max(rewards), steps=float(np.mean([result.steps for result in results])), obs=facts["obs_shape"],
        state=facts["state_shape"], actions=facts["n_actions"], wall_s=time.monotonic() - begun_s,
        trouble="; ".join(dict.fromkeys(trouble)),
    )  # fmt: skip


class Episode(NamedTuple):
    """The end of one episode."""

    reward: float
    most: float
    """What it may be worth at most."""
    won: bool
    steps: int


def _episode(env: Any, agent: str, rng: np.random.Generator) -> Episode:
    """Play one episode to its end."""
    total = 0.0
    regained = 0.0
    vitals = sum(enemy.health_max + enemy.shield_max for enemy in env.enemies.values())
    worth = env.n_enemies * env.reward_death_value + env.reward_win + vitals
    over = False
    info = {}
    steps = 0
    while not over:
        actions = [0] * env.n_agents
        if agent == "random":
            actions = [int(rng.choice(np.flatnonzero(env.get_avail_agent_actions(i)))) for i in range(env.n_agents)]
        reward, over, info = env.step(actions)
        total, regained, steps = total + reward, regained + _gains(env), steps + 1
    most = MOST_REWARD * (worth + 2 * regained) / env.max_reward
    return Episode(total, most, bool(info.get("battle_won")), steps)


def _gains(env: Any) -> float:
    """Return the life and shields that living enemies gained in the last step."""
    both = ((enemy, env.previous_enemy_units.get(number)) for number, enemy in env.enemies.items() if enemy.health > 0)
    return float(sum(max(0.0, now.health + now.shield - old.health - old.shield) for now, old in both if old))


def play_apart(
    root: Path, sc2path: Path, map_name: str, agent: str, options: argparse.Namespace, benchmark: str = "smac"
) -> Played:
    """Play one map in a process of its own, and end it when it takes too long."""
    command = [sys.executable, "-m", "bench", benchmark, str(root), "--one", "--maps", map_name, "--agents", agent]
    command += ["--episodes", str(options.episodes), "--seed", str(options.seed)]
    environment = {**os.environ, "SC2PATH": str(sc2path), "PYTHONPATH": str(root)}
    limit_s = START_S + options.patience_s * options.episodes
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=limit_s, check=False)
    except subprocess.TimeoutExpired:
        return Played(map_name, agent, trouble=f"not over after {limit_s:.0f} s")
    if done.returncode:
        return Played(map_name, agent, trouble=(done.stderr.strip().splitlines() or ["it failed"])[-1])
    return Played(**json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Play what the command line asks for; exit with 1 if anything was wrong."""
    main_of("smac", __doc__ or "", play, _maps)


def _maps() -> Iterable[str]:
    from smac.env.starcraft2.maps.smac_maps import get_smac_map_registry  # noqa: PLC0415  # see above

    return [*get_smac_map_registry()]


def main_of(
    package: str, text: str, play: Callable[[str, str, int, int], Played], maps: Callable[[], Iterable[str]]
) -> None:
    """Play what the command line asks for with one package; exit with 1 if anything was wrong."""
    parser = make_parser(text)
    parser.add_argument("path", type=Path)
    parser.add_argument("--maps", nargs="+")
    parser.add_argument("--agents", nargs="+", choices=AGENTS, default=AGENTS)
    parser.add_argument("--episodes", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--patience-s", type=float, default=120.0, help="for one episode")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    root = package_root(options.path, package)
    sys.path.insert(0, str(root))
    if options.one:
        print(json.dumps(dataclasses.asdict(play(options.maps[0], options.agents[0], options.episodes, options.seed))))
        return
    if not options.json:
        print("| map | agent | won | reward | best | steps | obs | state | actions | s | |")
        print("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---|")
    wrong = False
    with tempfile.TemporaryDirectory() as directory:
        sc2path = install(directory)
        for map_name in options.maps or maps():
            for agent in options.agents:
                played = play_apart(root, sc2path, map_name, agent, options, package)
                wrong |= bool(played.trouble)
                print(json.dumps(dataclasses.asdict(played)) if options.json else _row(played), flush=True)
    sys.exit(wrong)


def _row(p: Played) -> str:
    return (
        f"| {p.map} | {p.agent} | {p.won} of {p.episodes} | {p.reward:.1f} | {p.most:.1f} | {p.steps:.0f} | {p.obs} | "
        f"{p.state} | {p.actions} | {p.wall_s:.0f} | {p.trouble} |"
    )
