"""Play python-sc2's example bots against the computer players of ten levels, each game in a process of its own.

    python -m bench bots ~/python-sc2                       four rushes, ten levels, one game each
    python -m bench bots ~/python-sc2 --bots worker_rush --levels 4 5 --games 3
    python -m bench bots ~/python-sc2 --log won.jsonl       games in the file are not played again
    python -m bench bots ~/python-sc2 --maps ~/Maps --map Simple128

The path is a checkout of https://github.com/BurnySc2/python-sc2, whose examples are not in its package; the package
itself comes with `make install`. The computer plays the race that the example's own `main` asks for. The examples name
ladder maps, whose bases are twice as far apart as those of Simple64: there "25 from the middle" is in front of the
enemy's base, here it is inside.
"""

from __future__ import annotations

import argparse
import importlib.util
import inspect
import json
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from bench.command_line import make_parser
from khala_simulator.process.install import install, link_maps

if TYPE_CHECKING:
    from collections.abc import Iterator

BOTS: Final = {
    "worker_rush": ("worker_rush.py", "Protoss", "Protoss"),
    "zerg_rush": ("zerg/zerg_rush.py", "Zerg", "Terran"),
    "proxy_rax": ("terran/proxy_rax.py", "Terran", "Zerg"),
    "cannon_rush": ("protoss/cannon_rush.py", "Protoss", "Protoss"),
}
"""By name: the file, the bot's race, and the computer's."""
LEVELS: Final = (
    "VeryEasy", "Easy", "Medium", "MediumHard", "Hard",
    "Harder", "VeryHard", "CheatVision", "CheatMoney", "CheatInsane",
)  # fmt: skip
"""As python-sc2 names them, from 1 to 10."""


def play(options: argparse.Namespace) -> None:
    """Play one game in this process, and print its result as JSON."""
    from sc2 import maps  # noqa: PLC0415  # a package that only this measurement needs
    from sc2.data import Difficulty, Race  # noqa: PLC0415
    from sc2.main import run_game  # noqa: PLC0415
    from sc2.player import Bot, Computer  # noqa: PLC0415

    file, own, other = BOTS[options.bots[0]]
    random.seed(options.seed)  # the bots draw where they build, and what they attack
    ai = _bot(options.path / "examples" / file)
    players: Any = [Bot(Race[own], ai), Computer(Race[other], Difficulty[LEVELS[options.levels[0] - 1]])]
    limit_s = round(60 * options.minutes)
    arena = maps.get(options.map)
    result: Any = run_game(arena, players, realtime=False, game_time_limit=limit_s, random_seed=options.seed)
    found = {"result": result.name, "minutes": round(ai.time / 60, 1)}
    sys.stdout.write("\n" + json.dumps(found) + "\n")


def _bot(file: Path) -> Any:
    """Return the bot of an example."""
    from sc2.bot_ai import BotAI  # noqa: PLC0415

    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[file.stem] = module
    spec.loader.exec_module(module)
    bots = (kind for _, kind in inspect.getmembers(module, inspect.isclass) if issubclass(kind, BotAI))
    return next(kind for kind in bots if kind.__module__ == file.stem)()


def play_apart(options: argparse.Namespace, sc2path: Path, game: tuple[str, int, int]) -> dict[str, Any]:
    """Play one game in a process of its own; return its result, or what was wrong."""
    bot, level, seed = game
    command = [sys.executable, "-m", "bench", "bots", str(options.path), "--one", "--bots", bot, "--levels", str(level)]
    command += ["--seed", str(seed), "--minutes", str(options.minutes), "--map", options.map]
    try:
        done = subprocess.run(
            command, env={**os.environ, "SC2PATH": str(sc2path)}, capture_output=True, text=True,
            timeout=options.patience_s, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"result": f"not over after {options.patience_s:.0f} s"}
    if done.returncode:
        return {"result": (done.stderr.strip().splitlines() or ["it failed"])[-1]}
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def games(options: argparse.Namespace) -> Iterator[tuple[str, int, int]]:
    """Yield the games to play: bot, level, seed."""
    for number in range(options.games):
        for bot in options.bots:
            for level in options.levels:
                yield bot, level, options.seed + number


def table(won: dict[tuple[str, int, int], dict[str, Any]], levels: list[int]) -> Iterator[str]:
    """Yield a row for each bot, with its wins of its games by level."""
    yield "| bot | " + " | ".join(map(str, levels)) + " |"
    yield "|---|" + "---:|" * len(levels)
    for bot in dict.fromkeys(bot for bot, _, _ in won):
        cells = []
        for level in levels:
            found = [game for (name, at, _), game in won.items() if (name, at) == (bot, level)]
            cells.append(f"{sum(game['result'] == 'Victory' for game in found)} of {len(found)}" if found else "")
        yield f"| {bot} | " + " | ".join(cells) + " |"


def main() -> None:
    """Play what the command line asks for."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("path", type=Path)
    parser.add_argument("--bots", nargs="+", choices=sorted(BOTS), default=list(BOTS))
    parser.add_argument("--levels", nargs="+", type=int, default=list(range(1, 11)))
    parser.add_argument("--games", type=int, default=1)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=15.0, help="of game time; then it is a tie")
    parser.add_argument("--patience-s", type=float, default=900.0, help="wall time of a game; then it has no result")
    parser.add_argument("--map", default="Simple64", help="by default %(default)s; each map needs a log of its own")
    parser.add_argument("--maps", type=Path, help="a directory with maps of the game, to be played too")
    parser.add_argument("--log", type=Path, help="a file with a line for each game")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not (options.path / "examples").is_dir():
        raise SystemExit(f"{options.path} has no examples: clone https://github.com/BurnySc2/python-sc2, give its path")
    if options.one:
        play(options)
        return
    won: dict[tuple[str, int, int], dict[str, Any]] = {}
    if options.log and options.log.exists():
        for line in options.log.read_text().splitlines():
            known = json.loads(line)
            won[known["bot"], known["level"], known["seed"]] = known
    with tempfile.TemporaryDirectory() as directory:
        sc2path = install(Path(directory) / "sc2")
        if options.maps:
            link_maps(sc2path, options.maps)
        for game in games(options):
            if game not in won:
                won[game] = play_apart(options, sc2path, game)
                line = json.dumps({"bot": game[0], "level": game[1], "seed": game[2], **won[game]})
                sys.stderr.write(line + "\n")
                if options.log:
                    with options.log.open("a") as log:
                        log.write(line + "\n")
    sys.stdout.write("\n".join(table(won, options.levels)) + "\n")
