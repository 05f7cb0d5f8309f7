"""The reward of a step, as SMAC defines it: damage to enemies and their deaths, and the end of the battle.

Sums are taken in the order of the units, as SMAC takes them: numbers with fractions have another sum in another order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala.env.numeric.forces import Force, OwnForce
    from khala.env.numeric.options import Options

Ending: TypeAlias = Literal["won", "lost", "draw"]


def most_reward(enemy: Force, options: Options) -> float:
    """Return what an episode is worth in which all enemies of the beginning die, if they regain nothing."""
    vitals = enemy.now.life_max + enemy.now.shields_max
    return _sum(np.concatenate(([len(enemy) * options.reward_death_value + options.reward_win], vitals)))


def of_battle(own: OwnForce, enemy: Force, options: Options) -> float:
    """Return the reward of what happened in the last step, before it is scaled."""
    if options.reward_sparse:
        return 0.0
    kills = _sum(enemy.died * options.reward_death_value)
    damage = _sum(_damage(enemy))
    if options.reward_only_positive:
        return abs(damage + kills)  # also what enemies have regained
    deaths = _sum(own.died * options.reward_death_value * options.reward_negative_scale)
    return damage + (kills - deaths) - _sum(_damage(own) * options.reward_negative_scale)


def of_end(ending: Ending | None, options: Options, reward: float) -> float:
    """Return the reward of a step with that of the end of the battle, if it is over."""
    if ending not in {"won", "lost"}:
        return reward
    if options.reward_sparse:
        return 1.0 if ending == "won" else -1.0
    return reward + (options.reward_win if ending == "won" else options.reward_defeat)


def ending_of(own: OwnForce, enemy: Force) -> Ending | None:
    """Return how a battle ended; None while it goes on. Medivacs alone do not fight on."""
    fighters = own.alive & ~own.heals
    if own.heals.any() and not fighters.any():
        return "lost"
    if not own.alive.any():
        return "lost" if enemy.alive.any() else "draw"
    return "won" if enemy.one_medivac(own) or not enemy.alive.any() else None


def _damage(force: Force) -> NDArray[np.float64]:
    """Return [units] what each has lost in the last step; nothing of those that were dead before it."""
    lost = np.where(force.died, force.before, force.before - force.life - force.now.shields)
    return np.where(force.alive | force.died, lost, 0.0)


def _sum(terms: NDArray[np.floating[Any]]) -> float:
    return float(np.cumsum(terms)[-1])
