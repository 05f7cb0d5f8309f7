"""Play two scripts on SMAC's maps that were also played on StarCraft II: attack the closest or the weakest enemy.

    python -m bench scripts                                        22 maps, both scripts, 10 episodes
    python -m bench scripts --episodes 50 --scripts closest --maps 3s5z corridor

Figures of the real game are those that https://github.com/caiyangcy/SCMM (3c44e89) has drawn in its folder `plots`, ten
episodes each. As there, each agent chooses its target anew every two loops of the game, Medivacs heal the ally with the
least share of its health, and a battle ends only with a side; here it is not won after 4000 choices. Its maps are
SMAC's with a trigger that gives all enemies their order to attack again whenever an agent dies.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from s2clientprotocol import sc2api_pb2 as sc

from bench.command_line import make_parser
from khala_sc2.env.numeric.forces import fighters_of
from khala_sc2.env.numeric.maps import smac_map
from khala_simulator.abilities import commands
from khala_simulator.api.abilities import UnitCommand, judge
from khala_simulator.api.giving import carry_out
from khala_simulator.battle import PLAYER, Battle
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import ATTACK

if TYPE_CHECKING:
    from khala_simulator.world.orders import Order

HEAL: Final = 386
WEIGHTS: Final = {"closest": 0.0, "weakest": 1.0}
"""How much an enemy's health counts in the choice of a target; its distance is the rest."""
LOOPS: Final = 2
"""Of the game, between two choices."""
LONGEST: Final = 4000
"""Choices in a battle."""
REAL: Final = {
    "3m": (2, 5), "8m": (10, 3), "25m": (10, 0), "5m_vs_6m": (0, 0), "8m_vs_9m": (1, 0), "10m_vs_11m": (3, 0),
    "27m_vs_30m": (7, 0), "MMM": (10, 1), "MMM2": (0, 0), "2s3z": (8, 0), "3s5z": (9, 0), "3s5z_vs_3s6z": (0, 0),
    "3s_vs_3z": (0, 0), "3s_vs_4z": (0, 0), "3s_vs_5z": (0, 0), "1c3s5z": (10, 0), "2m_vs_1z": (0, 0),
    "corridor": (1, 0), "2s_vs_1sc": (0, 0), "so_many_baneling": (0, 0), "bane_vs_bane": (2, 4), "2c_vs_64zg": (0, 0),
}  # fmt: skip
"""Of ten episodes on StarCraft II, those that `closest` and `weakest` won."""


class Side(NamedTuple):
    """The units of a side at the begin of a battle."""

    tags: np.ndarray[Any, np.dtype[np.int64]]
    heals: np.ndarray[Any, np.dtype[np.bool_]]
    """(units,) Medivacs, which neither attack nor count at the end."""


def play(map_name: str, weight: float, episodes: int, seed: int) -> int:
    """Return how many of some episodes in one game the agents win."""
    battle = Battle(f"SMAC_Maps/{map_name}", seed=seed, difficulty=sc.CheatInsane)
    won = 0
    for _ in range(episodes):
        agents, enemies = _begin(battle, map_name)
        won += _fight(battle, agents, enemies, weight)
        battle.kill(np.concatenate(battle.tags()).tolist())
        battle.advance(LOOPS)
        battle.forget_past()
    return won


def _begin(battle: Battle, map_name: str) -> tuple[Side, Side]:
    """Wait until both sides are there."""
    while (fighters := fighters_of(battle, smac_map(map_name))) is None:
        battle.advance(1)
    n = fighters.agents
    return Side(fighters.tag[:n], fighters.medivac[:n]), Side(fighters.tag[n:], fighters.medivac[n:])


def _fight(battle: Battle, agents: Side, enemies: Side, weight: float) -> bool:
    """Fight until a side is dead; return whether the agents live."""
    slots = map(battle.world.slot_of, enemies.tags.tolist())
    given = {battle.world.tag_of(slot): battle.world.orders_of(slot) for slot in slots}  # by the map's trigger
    living = len(agents.tags)
    for _ in range(LONGEST):
        _choose(battle, agents, enemies, weight)
        for _ in range(LOOPS):
            battle.advance(1)
            before, living = living, int(battle.look(agents.tags)[0].sum())
            if living < before:
                _give_again(battle, given)
        alive = [bool((battle.look(side.tags)[0] & ~side.heals).any()) for side in (agents, enemies)]
        if not all(alive):
            return alive == [True, False]
    return False


def _give_again(battle: Battle, given: dict[int, list[Order]]) -> None:
    """Give each living enemy its order again."""
    for tag, orders in given.items():
        slot = battle.world.slot_of(tag)
        if slot != NOBODY:
            for order in orders:
                commands.give(battle.world, [slot], order, queue=False)


def _choose(battle: Battle, agents: Side, enemies: Side, weight: float) -> None:
    """Give every living agent an order."""
    lives, own = battle.look(agents.tags)
    there, seen = battle.look(enemies.tags)
    health = np.where(lives & (own.life < own.life_max), own.life / np.maximum(own.life_max, 1.0), np.inf)
    for i in np.flatnonzero(lives):
        if agents.heals[i]:
            scores = np.where(agents.heals, np.inf, health)
            ability = HEAL
            targets = agents.tags
        else:
            far = np.hypot(seen.x - own.x[i], seen.y - own.y[i])
            scores = np.where(there, weight * seen.life + (1.0 - weight) * far, np.inf)
            ability = ATTACK
            targets = enemies.tags
        best = int(np.argmin(scores))
        if scores[best] < np.inf:
            order = UnitCommand(ability, (int(agents.tags[i]),), int(targets[best]), None)
            carry_out(battle.world, judge(battle.world, PLAYER, order))


def main() -> None:
    """Play what the command line asks for."""
    parser = make_parser(__doc__ or "")
    parser.add_argument("--maps", nargs="+", choices=REAL, default=list(REAL), metavar="MAP")
    parser.add_argument("--scripts", nargs="+", choices=WEIGHTS, default=list(WEIGHTS))
    parser.add_argument("--episodes", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if not options.json:
        print("| map | script | won | real game |\n|---|---|---:|---:|")
    for map_name in options.maps:
        for script in options.scripts:
            real = REAL[map_name][list(WEIGHTS).index(script)]
            won = play(map_name, WEIGHTS[script], options.episodes, options.seed)
            if options.json:
                row = {"map": map_name, "script": script, "episodes": options.episodes, "won": won, "real": real}
                print(json.dumps(row), flush=True)
            else:
                print(f"| {map_name} | {script} | {won} of {options.episodes} | {real} of 10 |", flush=True)
