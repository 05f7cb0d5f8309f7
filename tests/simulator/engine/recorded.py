"""What games come to: digests that are recorded once and must hold, whatever becomes of the code.

``python -m tests.simulator.engine.recorded --write`` records them again, after a change of the rules that is meant.
Digests are cut to 16 digits: chance makes one of 10^19 pairs equal.
"""

from __future__ import annotations

import argparse
import itertools
import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bench.simulator.simulator_engine import battle
from khala_simulator import tick
from khala_simulator.maps.game_map import load_map
from tests.simulator.engine import random_orders

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_simulator.world.world import World

FILE: Final = Path(__file__).with_name("recorded.json")
BATTLES: Final = (
    "llm_smac/2s3z", "llm_smac/2c_vs_64zg", "llm_smac/MMM2", "llm_smac/bane_vs_bane", "llm_smac/so_many_baneling",
    "llm_smac/1c3s5z", "llm_smac/corridor", "llm_smac/25m", "mini_games/DefeatRoaches",
    "mini_games/DefeatZerglingsAndBanelings", *(f"llm_pysc2/pvz_task{number}_level1" for number in range(1, 9)),
)  # fmt: skip
GAMES: Final = ("melee/Simple64", "mini_games/CollectMineralsAndGas")
LOOPS: Final = 2000
EVERY: Final = 100
RANDOM_WORLDS: Final = 1000
RANDOM_LOOPS: Final = 120


def makers() -> dict[str, Callable[[], World]]:
    """Return what makes each game of the record."""
    fought: dict[str, Callable[[], World]] = {name: partial(battle, name, 1) for name in BATTLES}
    return fought | {name: partial(tick.new_game, load_map(name), seed=1) for name in GAMES}


def digests(make: Callable[[], World], loops: int = LOOPS) -> list[str]:
    """Return the digest of a game after every hundred loops, to its end at most."""
    world = make()
    found = []
    while world.loop < loops and not world.ended:
        tick.advance(world, EVERY)
        found.append(world.digest()[:16])
    return found


def random_digest(number: int) -> str:
    """Return the digest of a world of random units that got random orders."""
    units, seed = 1 + number % 12, 7919 * number
    return random_orders.play(random_orders.crowd(units, seed), seed, RANDOM_LOOPS).digest()[:16]


def random_differences(numbers: range) -> Iterator[int]:
    """Yield the numbers of the random worlds that differ from the record."""
    recorded = json.loads(FILE.read_text(encoding="utf-8"))["random"]
    return (number for number in numbers if random_digest(number) != recorded[number])


def main() -> None:
    """Write the record, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="record what the games come to now")
    parser.add_argument("--loops", type=int, default=LOOPS, help="of the games, to compare fewer")
    parser.add_argument("--worlds", type=int, default=RANDOM_WORLDS, help="random ones, to compare fewer")
    given = parser.parse_args()
    if given.write:
        games = {name: digests(make) for name, make in makers().items()}
        random = [random_digest(number) for number in range(RANDOM_WORLDS)]
        FILE.write_text(json.dumps({"games": games, "random": random}, indent=0) + "\n", encoding="utf-8")
        return
    recorded = json.loads(FILE.read_text(encoding="utf-8"))["games"]
    for name, make in makers().items():
        pairs = enumerate(zip(digests(make, given.loops), recorded[name], strict=False), start=1)
        parted = next((EVERY * count for count, (now, then) in pairs if now != then), 0)
        print(f"{name}: {f'differs after loop {parted - EVERY}, at {parted} at the latest' if parted else 'the same'}")  # noqa: T201  # a command's output
    differing = list(itertools.islice(random_differences(range(given.worlds)), 10))
    print(f"random worlds that differ: {differing or 'none'}")  # noqa: T201  # see above


if __name__ == "__main__":
    main()
