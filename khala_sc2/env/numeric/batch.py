"""A batch of battles that are stepped together, into arrays of the caller.

Each battle is a `StarCraft2Env`, so that its numbers are SMAC's to the bit; a step makes no array and no object for
each agent. Battles whose episode is over begin the next one by themselves. Above: `khala_sc2.env.numeric.workers`.
Below: `khala_sc2.env.numeric.starcraft2`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

import numpy as np

from khala_protocol.errors import ConfigError
from khala_sc2.env.numeric import sizes
from khala_sc2.env.numeric.maps import smac_map
from khala_sc2.env.numeric.options import options_of
from khala_sc2.env.numeric.starcraft2 import BEGUN, BattleStep, StarCraft2Env

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

Arrays: TypeAlias = "dict[str, NDArray[Any]]"
"""By name, each with a row for each battle; see `shapes`."""

SAME_STEP: Final = "SameStep"
"""An episode begins in the step in which the one before ends; the last observation of that is kept beside."""
NEXT_STEP: Final = "NextStep"
"""It begins in the step after, whose actions are ignored and whose reward is 0."""


class BatchSpec(NamedTuple):
    """What all battles of a batch have in common; it goes to worker processes."""

    map_name: str
    mode: str
    """`SAME_STEP` or `NEXT_STEP`."""
    max_cycles: int | None
    options: dict[str, Any]

    def make(self) -> StarCraft2Env:
        """Return a battle that has not begun."""
        return StarCraft2Env(self.map_name, episode_limit=self.max_cycles, **self.options)


def shapes(spec: BatchSpec) -> dict[str, tuple[tuple[int, ...], type[np.generic]]]:
    """Return the shape and type of a battle's row in each array: what goes in, and what comes out of a step.

    Raises:
        ConfigError: there is no such map, or an option has no such value.
    """
    game = smac_map(spec.map_name)
    options = options_of(spec.options)
    agents = game.agents
    actions = sizes.actions(game)
    seen = sizes.seen(game, options)
    state = sizes.whole_state(game, options)
    rows: dict[str, tuple[tuple[int, ...], type[np.generic]]] = {
        "action": ((agents,), np.int64),
        "observation": ((agents, seen), np.float32),
        "action_mask": ((agents, actions), np.int8),
        "state": ((state,), np.float32),
        "reward": ((), np.float64),
        "terminated": ((), np.bool_),
        "truncated": ((), np.bool_),
        "battle_won": ((), np.bool_),
        "dead_allies": ((), np.int64),
        "dead_enemies": ((), np.int64),
        "elapsed": ((), np.int64),
    }
    if spec.mode == SAME_STEP:
        rows |= {"final_observation": rows["observation"], "final_state": rows["state"]}
    return rows


def arrays_for(spec: BatchSpec, count: int, given: Mapping[str, Any] | None = None) -> Arrays:
    """Return an array for each name: the caller's where it gave one, else a new one.

    Args:
        spec: of the battles.
        count: how many.
        given: arrays, or what has their memory, such as tensors of torch on the processor.

    Raises:
        ConfigError: a given one has no such name, shape or type, or its memory cannot be written in place.
    """
    rows = shapes(spec)
    given = given or {}
    for name in given:
        if name not in rows:
            raise ConfigError(f"there is no buffer {name!r}: give some of {', '.join(rows)}")
    return {
        name: _check(name, given[name], (count, *shape), dtype) if name in given else np.zeros((count, *shape), dtype)
        for name, (shape, dtype) in rows.items()
    }


def _check(name: str, buffer: Any, shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    array = np.asarray(buffer)
    if array.shape != shape or array.dtype != dtype:
        wanted = f"{list(shape)} {np.dtype(dtype).name}"
        raise ConfigError(f"buffer {name!r} is {list(array.shape)} {array.dtype.name} and must be {wanted}")
    if not (array.flags.c_contiguous and array.flags.writeable and np.shares_memory(array, np.asarray(buffer))):
        raise ConfigError(f"buffer {name!r} cannot be written in place: give a contiguous array or tensor on the CPU")
    return array


class Batch:
    """Some battles in this process.

    Attributes:
        battles: SMAC's own interface to each.
    """

    def __init__(self, spec: BatchSpec, arrays: Arrays) -> None:
        """Take arrays, whose rows are the battles."""
        self._arrays = arrays
        self._same_step = spec.mode == SAME_STEP
        self.battles = [spec.make() for _ in arrays["action"]]
        self._outcomes = [BEGUN] * len(self.battles)
        self._rows = [
            _Row(*(arrays[name][row] for name in ("action", "observation", "action_mask", "state")))
            for row in range(len(self.battles))
        ]

    def begin(self, seeds: Sequence[int | None]) -> None:
        """Begin an episode of each battle: in a new game where there is a seed, else in the game that goes on."""
        for row, (battle, seed) in enumerate(zip(self.battles, seeds, strict=True)):
            battle.begin(seed)
            self._outcomes[row] = BEGUN
            self._see(row)
        self._note()

    def step(self) -> None:
        """Play a step of each battle with the actions of the arrays; one that is not available is replaced by stop."""
        for row, battle in enumerate(self.battles):
            if battle.over:
                battle.begin()
                self._outcomes[row] = BEGUN
            else:
                outcome = self._outcomes[row] = battle.play(self._rows[row].action)
                if self._same_step and outcome.over:
                    battle.see(self._arrays["final_observation"][row], self._arrays["final_state"][row])
                    battle.begin()
            self._see(row)
        self._note()

    def _note(self) -> None:
        """Write what the step was worth to all battles, and how they stand."""
        for name, column in zip(BattleStep._fields, zip(*self._outcomes, strict=True), strict=True):
            self._arrays[name][:] = column

    def _see(self, row: int) -> None:
        """Write what the agents see now and may do."""
        _, observation, mask, state = self._rows[row]
        self.battles[row].show(observation, state, mask)


class _Row(NamedTuple):
    """Parts of the arrays that belong to one battle."""

    action: NDArray[np.int64]
    observation: NDArray[np.float32]
    mask: NDArray[np.int8]
    state: NDArray[np.float32]
