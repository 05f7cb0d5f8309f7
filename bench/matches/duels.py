"""Play duels of two models or scripted players, with sides swapped, and tabulate who wins.

    python -m bench duels                                               skilled against focus-fire, 20 games
    python -m bench duels --task duel_8m --games 40 --a skilled --b skilled
    python -m bench duels --a openai --b anthropic/claude-opus-4 --json

Each seed is played twice, in the second game with sides swapped, so that neither ground nor seed favours one of them;
a player against itself plays each seed once. `a` and `b` are what `khala run --blue` takes, and both have the same
clock. The intervals are Wilson's, of 95 %. A game that is not valid is not counted, and makes the exit code 1.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.command_line import make_parser
from khala_orchestrator.config import load_task
from khala_sc2.experiment.statistics import wilson

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

NOT_VALID = 3
"""Exit code of `khala run` after a match with results that are not valid."""


@dataclass(frozen=True, slots=True)
class Game:
    """One game, as its player `a` saw it."""

    seed: int
    side: str
    """That of `a`."""
    outcome: str
    killed: float
    """Minerals and vespene."""
    lost: float
    steps: int
    wall_s: float
    valid: bool


def duels(task: str, a: str, b: str, *, games: int, seed: int, out: Path, options: Sequence[str] = ()) -> list[Game]:
    """Play so many games, half of them with `a` as the first side, and return them by seed.

    Raises:
        RuntimeError: a run failed.
    """
    first, second = (side.side for side in load_task(task).per_side())
    half = games - games // 2
    played = [*_half(task, first, {first: a, second: b}, half, seed, out, options)]
    again = seed + half if a == b else seed  # a scripted player would play the very same game again
    played += _half(task, second, {first: b, second: a}, games // 2, again, out, options)
    return sorted(played, key=lambda game: game.seed)


def _half(
    task: str, side: str, models: dict[str, str], episodes: int, seed: int, out: Path, options: Sequence[str]
) -> Iterator[Game]:
    if not episodes:
        return
    command = [sys.executable, "-m", "khala_sc2", "run", task, "--latency", "0", "--max-wait", "60", "--json", *options]
    command += ["--episodes", str(episodes), "--seed", str(seed), "--out", str(out)]
    command += [part for name, model in models.items() for part in ("--side-model", f"{name}={model}")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in {0, NOT_VALID}:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    results: list[dict[str, Any]] = json.loads(done.stdout)["results"]
    valid = dict.fromkeys(range(episodes), True)
    for result in results:
        valid[result["episode"]] &= result["valid"]
    for result in results:
        if result["side"] == side:
            yield Game(
                seed=seed + result["episode"],
                side=side,
                outcome=result["outcome"],
                killed=result["killed"]["value"],
                lost=result["lost"]["value"],
                steps=result["steps"],
                wall_s=result["wall_s"],
                valid=valid[result["episode"]],
            )


def table(a: str, b: str, games: Sequence[Game]) -> Iterator[str]:
    """Yield the lines of a Markdown table: all games, then those of each seat of `a`."""
    b = f"{b} (b)" if a == b else b
    yield f"| games | number | {a} won | {b} won | drawn | KD of {a} | steps | not valid |"
    yield f"|{'---|' * 8}"
    yield _line("all", games)
    for side in dict.fromkeys(game.side for game in games):
        yield _line(f"{a} is {side}", [game for game in games if game.side == side])


def _line(name: str, games: Sequence[Game]) -> str:
    valid = [game for game in games if game.valid]
    outcomes = Counter(game.outcome for game in valid)
    killed, lost = sum(game.killed for game in valid), sum(game.lost for game in valid)
    cells = (
        name,
        str(len(valid)),
        _share(outcomes["win"], len(valid)),
        _share(outcomes["loss"], len(valid)),
        str(outcomes["draw"] + outcomes["cut"]),
        f"{killed / lost:.2f}" if lost else "none lost",
        str(sum(game.steps for game in valid)),
        str(len(games) - len(valid)),
    )
    return f"| {' | '.join(cells)} |"


def _share(won: int, games: int) -> str:
    share = wilson(won, games)
    return f"{won} ({100 * share.low:.0f} to {100 * share.high:.0f} %)"


def main() -> int:
    """Play the duels that the options describe, and print the table."""
    parser = make_parser(__doc__)
    parser.add_argument("--task", default="duel_3m", help="a task of two sides")
    parser.add_argument("--games", type=int, default=20, help="number of games")
    parser.add_argument("--a", default="scripted/skilled", metavar="MODEL", help="as of khala run --blue")
    parser.add_argument("--b", default="scripted/focus-fire", metavar="MODEL", help="its opponent")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first two games")
    parser.add_argument("--out", type=Path, default=Path("runs/duels"), help="directory for recordings")
    given, options = parser.parse_known_args()
    try:
        games = duels(given.task, given.a, given.b, games=given.games, seed=given.seed, out=given.out, options=options)
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    if given.json:
        print(json.dumps({"task": given.task, "a": given.a, "b": given.b, "games": [asdict(game) for game in games]}))
    else:
        print("\n".join(table(given.a, given.b, games)))
    return 0 if all(game.valid for game in games) else 1
