"""The reward of a step, as SMAC defines it: damage to enemies and their deaths, and the end of the battle.

Below: `khala_simulator.smac.fighters`, which sums up what happened to the units.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.api.vital_rows import LIFE_MAX, SHIELDS_MAX
from khala_simulator.smac.rules import LOST, WON

if TYPE_CHECKING:
    from khala_sc2.env.numeric.options import Options
    from khala_simulator.smac.fighters import Fighters


def most_reward(fighters: Fighters, options: Options) -> float:
    """Return what an episode is worth in which all enemies of the beginning die, if they regain nothing."""
    numbers = fighters.numbers[:, fighters.agents :]
    enemies = fighters.count - fighters.agents
    vitals = numbers[LIFE_MAX] + numbers[SHIELDS_MAX]
    worth = np.concatenate(([enemies * options.reward_death_value + options.reward_win], vitals))
    return float(np.cumsum(worth)[-1])


def of_step(fighters: Fighters, ending: int, options: Options) -> float:
    """Return the reward of the last step, before it is scaled, with that of the end of the battle."""
    ended = ending in {WON, LOST}
    if options.reward_sparse:
        return (1.0 if ending == WON else -1.0) if ended else 0.0
    reward = fighters.reward(options.reward_death_value, options.reward_negative_scale, options.reward_only_positive)
    if not ended:
        return reward
    return reward + (options.reward_win if ending == WON else options.reward_defeat)
