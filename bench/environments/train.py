"""Train a team on a SMAC map through `khala_sc2.env.numeric`, and draw how its win rate grows.

    python -m bench train                                           3m, one seed, ten minutes
    python -m bench train 3m --minutes 10 --seeds 1 2 3
    python -m bench train 2s3z --minutes 30 --envs 16 --out curve.svg

The learner is PPO with shared weights (`ppo.py`), in this process, with all environments in turn. It prints the win
rate of the last 200 episodes as they were sampled and, at the end, that of 100 new battles in which each agent takes
its most likely action. Minutes are those of the processor, so that a busy machine changes nothing. Ctrl-C ends the
training, and draws the curve so far.
"""

from __future__ import annotations

import json
import time
from collections import deque
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.command_line import make_parser
from bench.environments.ppo import Learner, Rollout
from khala_sc2.env.numeric import CentralEnv

if TYPE_CHECKING:
    from collections.abc import Callable

STEPS = 32
"""Of each environment between two updates."""
RECENT = 200
TESTED = 100
TEST_SEED = 1_000_000


@dataclass(slots=True)
class Run:
    """What became of one seed."""

    map: str
    seed: int
    minutes: list[float] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    """Of all environments, at the same moments."""
    won: list[float] = field(default_factory=list)
    """Part of the episodes before."""
    episodes: int = 0
    greedy: float | None = None
    """Part of the battles that were won at the end, with the most likely actions; None if it was interrupted."""


class Team:
    """Several environments that are played by one learner."""

    def __init__(self, map_name: str, envs: int, seed: int) -> None:
        self.envs = [CentralEnv(map_name) for _ in range(envs)]
        self.seen = [env.reset(seed=seed * 1000 + number)[0] for number, env in enumerate(self.envs)]
        self.won: deque[bool] = deque(maxlen=RECENT)
        self.episodes = 0

    def play(self, learner: Learner, steps: int) -> Rollout:
        """Play some steps of each environment."""
        return Rollout(*map(np.stack, zip(*(self._step(learner) for _ in range(steps)), strict=True)))

    def states(self) -> np.ndarray[Any, Any]:
        """Return [envs, size] the states now."""
        return np.stack([step["state"] for step in self.seen])

    def _step(self, learner: Learner) -> tuple[Any, ...]:
        seen = np.stack([step["observation"] for step in self.seen])
        states = self.states()
        masks = np.stack([step["action_mask"] for step in self.seen]).astype(np.bool_)
        actions, chance = learner.act(seen, masks)
        rewards, ended = [], []
        for number, env in enumerate(self.envs):
            self.seen[number], reward, over, cut, info = env.step(actions[number])
            rewards.append(reward)
            ended.append(over or cut)
            if over or cut:
                self.won.append(bool(info["battle_won"]))
                self.episodes += 1
                self.seen[number], _ = env.reset()
        return seen, masks, actions, chance, states, np.array(rewards), np.array(ended)


def train(map_name: str, seed: int, envs: int, minutes: float, tell: Callable[[Run], None]) -> tuple[Run, Learner]:
    """Train one team; `tell` is called with the run each minute or so."""
    team = Team(map_name, envs, seed)
    first = team.seen[0]
    (agents, size), (state_size,) = first["observation"].shape, first["state"].shape
    learner = Learner(agents, size, state_size, team.envs[0].battles.n_actions, seed)
    run = Run(map_name, seed)
    begun_s = time.process_time()
    told = 0.0
    steps = 0
    with suppress(KeyboardInterrupt):
        while (spent := (time.process_time() - begun_s) / 60) < minutes:
            learner.learn(team.play(learner, STEPS), team.states())
            steps += STEPS * envs
            if spent >= told and team.won:
                told = spent + min(0.25, minutes / 40)
                run.minutes.append(spent)
                run.steps.append(steps)
                run.won.append(sum(team.won) / len(team.won))
                run.episodes = team.episodes
                tell(run)
        run.greedy = win_rate(map_name, learner)
    return run, learner


def win_rate(map_name: str, learner: Learner) -> float:
    """Return the part of new battles that are won with the most likely actions."""
    env = CentralEnv(map_name)
    won = 0
    for number in range(TESTED):
        seen, _ = env.reset(seed=TEST_SEED + number)
        over = cut = False
        info: dict[str, Any] = {}
        while not (over or cut):
            masks = seen["action_mask"].astype(np.bool_)
            actions, _ = learner.act(seen["observation"][None], masks[None], greedy=True)
            seen, _, over, cut, info = env.step(actions[0])
        won += info["battle_won"]
    return won / TESTED


def draw(runs: list[Run], path: Path) -> None:
    """Draw the win rates over the minutes."""
    import matplotlib as mpl  # noqa: PLC0415  # loads fonts, which only a picture needs
    from matplotlib.figure import Figure  # noqa: PLC0415  # see above

    mpl.rcParams["svg.hashsalt"] = "khala"
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    for run in runs:
        greedy = "" if run.greedy is None else f", greedy {run.greedy:.2f}"
        axes.plot(run.minutes, run.won, label=f"seed {run.seed}: {run.steps[-1] / 1000:.0f} 000 steps{greedy}")
    axes.set(xlabel="minutes of one processor core", ylabel=f"won of the last {RECENT}", ylim=(0, 1), title=runs[0].map)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Train as the command line asks."""
    parser = make_parser(__doc__)
    parser.add_argument("map", nargs="?", default="3m")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--envs", type=int, default=16)
    parser.add_argument("--out", type=Path, help="where to draw the curve: .svg or .png")
    options = parser.parse_args()
    runs = []
    for seed in options.seeds:
        run, _ = train(
            options.map, seed, options.envs, options.minutes, lambda run: None if options.json else _tell(run)
        )
        runs.append(run)
        if options.json:
            print(json.dumps(asdict(run)))
        elif run.greedy is not None:
            print(f"seed {seed}: greedy {run.greedy:.2f} of {TESTED} battles")
        if options.out:
            draw(runs, options.out)
        if run.greedy is None:
            break


def _tell(run: Run) -> None:
    print(
        f"seed {run.seed}  {run.minutes[-1]:5.2f} min  {run.steps[-1]:8d} steps  {run.episodes:6d} episodes  "
        f"won {run.won[-1]:.2f}", flush=True,
    )  # fmt: skip
