"""Play a game twice, by the rules in numpy and by the compiled systems, and name the first difference.

``python -m tests.simulator.engine.side_by_side llm_smac/2s3z --attack`` finds the loop, the system after which the
worlds differ, and the columns and slots in which they do.
"""

from __future__ import annotations

import argparse
import itertools
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bench.simulator_engine import armies, battle
from khala_simulator import tick
from khala_simulator.maps.game_map import load_map
from khala_simulator.world.columns import COLUMNS

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.world.world import World


def differences(one: World, other: World) -> list[str]:
    """Return a line for every column in which two worlds differ, to the last bit, and for what else the digest sees."""
    if one.top != other.top:
        return [f"top {one.top} {other.top}"]
    n = one.top
    lines = []
    for name in COLUMNS:
        mine, theirs = getattr(one, name)[:n], getattr(other, name)[:n]
        if mine.tobytes() != theirs.tobytes():
            unequal = (mine.view(np.uint8) != theirs.view(np.uint8)).reshape(n, -1).any(axis=1)
            slot = int(np.flatnonzero(unequal)[0])
            lines.append(f"{name} of {int(unequal.sum())} slots, first {slot}: {mine[slot]!r} {theirs[slot]!r}")
    if one.visible[:, :n].tobytes() != other.visible[:, :n].tobytes():
        lines.append("visible")
    if one.fighters.tolist() != other.fighters.tolist():
        lines.append("fighters")
    if not lines and one.digest() != other.digest():
        lines.append("the digest: shots, buffs, players, creep, visibility or the generator")
    return lines


def first_difference(make: Callable[[], World], loops: int, every: int = 1) -> str | None:
    """Return where two games part, or None if they do not in so many loops.

    The digests are compared every ``every`` loops, and system by system from there if they differ.
    """
    rules, compiled = make(), make()
    for _ in range(0, loops, every):
        tick.advance(rules, every, tick.RULES)
        tick.advance(compiled, every, tick.SYSTEMS)
        if rules.digest() != compiled.digest():
            return _first_difference(make, rules.loop)
        if rules.ended:
            return None
    return None


def _first_difference(make: Callable[[], World], loops: int) -> str:
    rules, compiled = make(), make()
    while rules.loop < loops and not rules.ended:
        for world in (rules, compiled):
            world.loop += 1
        for one, other in zip(tick.RULES, tick.SYSTEMS, strict=True):
            one(rules)
            other(compiled)
            if lines := differences(rules, compiled):
                name = f"{one.__module__.rpartition('.')[2]}.{one.__name__}"
                return "\n  ".join((f"loop {rules.loop}, after {name}:", *lines))
    return f"loop {loops}: the digests differ, and the systems, one by one, agree"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("map", nargs="?", default="llm_smac/2s3z", help="a shipped map")
    parser.add_argument("--attack", action="store_true", help="player 1 attacks as well")
    parser.add_argument("--armies", type=int, metavar="N", help="two armies of N units in all, instead of a map")
    parser.add_argument("--loops", type=int, default=2000)
    parser.add_argument("--seeds", type=int, default=1)
    options = parser.parse_args()
    for seed in itertools.islice(itertools.count(), options.seeds):
        if options.armies:
            make = partial(armies, options.armies, seed)
        elif options.attack:
            make = partial(battle, options.map, seed)
        else:
            make = partial(tick.new_game, load_map(options.map), seed=seed)
        print(f"seed {seed}:", first_difference(make, options.loops, every=8) or "the same")  # noqa: T201  # a command's output


if __name__ == "__main__":
    main()
