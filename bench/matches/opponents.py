"""Measure how strong the computer players are: how they grow, and which level beats which.

    python -m bench opponents growth                            every level of every race at 1:30, 3, 5, 6 and 8 minutes
    python -m bench opponents growth --races terran --levels 1 7 --minutes 5
    python -m bench opponents ladder --race zerg --games 10     each pair of levels, one race against itself
    python -m bench opponents ladder --neighbours --games 10    each level against the one below it, nine match-ups
    python -m bench opponents ladder --pairs 7-8 --log won.jsonl     one pair; games in the file are not played again
    python -m bench opponents replays                           the same beside replays of the game's own
    python -m bench opponents replays --races zerg --levels 3 7
    python -m bench opponents speed                             loops per second of a game with and without them

Straight on the engine, without the SC2 API. A pair plays each seed from both seats in turn. A game that is not over
after `--minutes` goes to the side whose units and structures cost more, if it has a quarter more; else it is drawn.
The levels were tuned on seeds below 100; the ladder begins with seed 100. With `--log`
each game is written down when it is over, and a long ladder can be interrupted and continued; `--games 0`
prints the file.
"""

from __future__ import annotations

import itertools
import json
import math
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final
from unittest import mock

from bench.command_line import make_parser
from khala_sc2.experiment.statistics import wilson
from khala_simulator.economy import supply
from khala_simulator.maps.game_map import load_map
from khala_simulator.opponent import player
from khala_simulator.opponent.build_file import NAMES
from khala_simulator.opponent.levels import FASTER_LOOPS, load_levels
from khala_simulator.tables.loader import read_data
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import GameResult, PlayerSetup

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Iterator, Sequence

    from khala_simulator.world.world import World

RACES: Final = ("protoss", "terran", "zerg")
MOMENTS_S: Final = (90, 180, 300, 360, 480)
MACRO: Final = 2
CLEARLY: Final = 1.25
STRIDE: Final = 112
TOLERANCES: Final = {"workers": (0.15, 0.0), "army": (0.25, 3.0), "minerals": (0.2, 0.0)}
"""How far from the median of replays a number may be: a share of it, or so much."""
HELD_BACK: Final = 1 << 40
"""A loop that no game reaches."""


@dataclass(frozen=True, slots=True)
class Seat:
    """A computer player: its race, level and build (the API's AIBuild)."""

    race: str
    level: int
    build: int = 0

    @property
    def name(self) -> str:
        """What it is called in tables."""
        return f"{self.race} {load_levels()[self.level].name}"


@dataclass(frozen=True, slots=True)
class Game:
    """One game of two computer players: who won (1, 2, or 0 for a draw), when, and how many loops a second took."""

    first: Seat
    second: Seat
    seed: int
    winner: int
    decided: bool
    minutes: float
    loops_per_s: float


@dataclass(frozen=True, slots=True)
class Growth:
    """What a computer player has at a moment; income is minerals and vespene a minute over the last half minute."""

    seat: Seat
    at_s: int
    workers: int
    bases: int
    army_supply: float
    supply: float
    upgrades: int
    minerals: float
    vespene: float
    unspent: float


def world_of(game_map: str, seats: Sequence[Seat], seed: int) -> World:
    """Return a game of computer players at loop 0."""
    setups = [PlayerSetup(i + 1, s.race, "computer", difficulty=s.level, build=s.build) for i, s in enumerate(seats)]
    return new_game(load_map(game_map), setups, seed=seed)


# growth ---------------------------------------------------------------------------------------------------------------


def growth(game_map: str, seat: Seat, moments_s: Iterable[int], seed: int) -> list[Growth]:
    """Play against an opponent that does nothing, without attacking it, and note what there is at some moments."""
    setups = [PlayerSetup(1, seat.race, "computer", difficulty=seat.level, build=seat.build)]
    world = new_game(load_map(game_map), [*setups, PlayerSetup(2, "terran", "agent")], seed=seed)
    mind = world.players[1].mind = player.begin(world, 1)
    mind.attack_from = mind.next_drop = HELD_BACK
    rows = []
    for at_s in moments_s:
        before = at_s - 30
        advance(world, max(0, round(before * FASTER_LOOPS) - world.loop))
        had = list(world.players[1].score.collected)
        advance(world, max(0, round(at_s * FASTER_LOOPS) - world.loop))
        rows.append(_grown(world, seat, at_s, had))
        print(_growth_row(rows[-1]), file=sys.stderr, flush=True)
    return rows


def _grown(world: World, seat: Seat, at_s: int, had: list[float]) -> Growth:
    owner = world.players[1]
    slots = world.units_of(1).tolist()
    units = [world.unit_type(slot) for at in slots for slot in (at, *world.passengers(at))]
    collected = owner.score.collected
    return Growth(
        seat=seat,
        at_s=at_s,
        workers=sum(unit.worker for unit in units),
        bases=sum("DropOff" in unit.placement for unit in units),
        army_supply=sum(unit.supply for unit in units if unit.army),
        supply=supply.in_use(world, 1),
        upgrades=len(owner.upgrades),
        minerals=2.0 * (collected[0] - had[0]),
        vespene=2.0 * (collected[1] - had[1]),
        unspent=owner.minerals + owner.vespene,
    )


# games ----------------------------------------------------------------------------------------------------------------


def play(game_map: str, first: Seat, second: Seat, seed: int, minutes: float) -> Game:
    """Play one game to its end, or for so many minutes."""
    world = world_of(game_map, (first, second), seed)
    began = time.process_time()
    while not world.ended and world.loop < minutes * 60.0 * FASTER_LOOPS:
        advance(world, STRIDE)
    won = [p.id for p in world.players[1:] if p.result is GameResult.VICTORY]
    return Game(
        first,
        second,
        seed,
        winner=won[0] if won else 0 if world.ended else _ahead(world),
        decided=world.ended,
        minutes=round(world.loop / FASTER_LOOPS / 60.0, 1),
        loops_per_s=round(world.loop / max(time.process_time() - began, 1e-9)),
    )


def _ahead(world: World) -> int:
    """Return the player that is clearly ahead by the price of all that it has, 0 for neither."""
    worth = [sum(sum(world.unit_type(slot).cost) for slot in world.units_of(p).tolist()) for p in (1, 2)]
    if max(worth) < CLEARLY * min(worth):
        return 0
    return 1 if worth[0] > worth[1] else 2


def fixtures(pairs: Sequence[tuple[Seat, Seat]], games: int, seed: int) -> Iterator[tuple[Seat, Seat, int]]:
    """Yield the games of all pairs of a weaker and a stronger player: each seed from both seats, every pair in turn."""
    for number in range(games):
        for weaker, stronger in pairs:
            seats = (weaker, stronger) if number % 2 else (stronger, weaker)
            yield *seats, seed + number // 2


def ladder(race: str, levels: Sequence[int], build: int) -> list[tuple[Seat, Seat]]:
    """Return every pair of levels of one race."""
    return [(Seat(race, a, build), Seat(race, b, build)) for a, b in itertools.combinations(sorted(levels), 2)]


def neighbours(races: Sequence[str], levels: Sequence[int], build: int) -> list[tuple[Seat, Seat]]:
    """Return each level against the one below it, for every pair of races."""
    return [
        (Seat(weaker, a, build), Seat(stronger, b, build))
        for weaker, stronger in itertools.product(races, races)
        for a, b in itertools.pairwise(sorted(levels))
    ]


def pairs_of(options: argparse.Namespace) -> list[tuple[Seat, Seat]]:
    """Return the pairs that the options ask for."""
    if options.neighbours:
        return neighbours(options.races, options.levels, options.build)
    every = ladder(options.race, options.levels, options.build)
    return [(a, b) for a, b in every if not options.pairs or f"{a.level}-{b.level}" in options.pairs]


# tables ---------------------------------------------------------------------------------------------------------------


def growth_table(rows: Iterable[Growth]) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    yield "| player | at | workers | bases | army supply | supply | upgrades | minerals/min | vespene/min | unspent |"
    yield f"|{'---|' * 10}"
    yield from map(_growth_row, rows)


def _growth_row(r: Growth) -> str:
    at = f"{r.at_s // 60}:{r.at_s % 60:02d}"
    return (
        f"| {r.seat.name} | {at} | {r.workers} | {r.bases} | {r.army_supply:.0f} | {r.supply:.0f} | {r.upgrades} "
        f"| {r.minerals:.0f} | {r.vespene:.0f} | {r.unspent:.0f} |"
    )


def ladder_table(games: Iterable[Game]) -> Iterator[str]:
    """Yield the lines of a Markdown table: for each pair how often the higher level won; draws count a half."""
    yield "| stronger | weaker | games | won | drawn | share | minutes | not over | loops/s |"
    yield f"|{'---|' * 9}"
    by_pair: dict[tuple[Seat, Seat], list[Game]] = {}
    for game in games:
        weaker, stronger = sorted((game.first, game.second), key=lambda s: s.level)
        by_pair.setdefault((weaker, stronger), []).append(game)
    for (weaker, stronger), played in by_pair.items():
        won = sum(1 for g in played if g.winner and (g.first, g.second)[g.winner - 1] == stronger)
        drawn = sum(not g.winner for g in played)
        wins = wilson(won, len(played))
        share = (won + drawn / 2) / len(played)
        yield (
            f"| {stronger.name} | {weaker.name} | {len(played)} | {won} | {drawn} "
            f"| {share:.0%} ({wins.low:.0%} to {wins.high:.0%}) | {sum(g.minutes for g in played) / len(played):.1f} "
            f"| {sum(not g.decided for g in played)} | {sum(g.loops_per_s for g in played) / len(played):.0f} |"
        )


# beside replays -------------------------------------------------------------------------------------------------------


def beside_replays(options: argparse.Namespace) -> Iterator[str]:
    """Yield the lines of a Markdown table: medians of replays, and of ours, one game of each build."""
    replays = read_data("opponents", "replays.yaml")
    moments = replays["moments_s"]
    held = compared = 0
    yield "| player | build | replays | what | 3:00 | 5:00 | 6:00 | 8:00 |"
    yield f"|{'---|' * 8}"
    for row in replays["rows"]:
        if row["race"] not in options.races or row["level"] not in options.levels:
            continue
        builds = [number for number, name in NAMES.items() if row["build"] in {name, "any"}]
        seats = [Seat(row["race"], row["level"], build) for build in builds]
        games = [growth(options.map, seat, moments, options.seed + seat.build) for seat in seats]
        income = load_levels()[row["level"]].income
        ours = {
            "workers": [[g.workers for g in grown] for grown in zip(*games, strict=True)],
            "army": [[g.supply - g.workers for g in grown] for grown in zip(*games, strict=True)],
            "minerals": [[g.minerals * income for g in grown] for grown in zip(*games, strict=True)],
        }
        for what, (share, absolute) in TOLERANCES.items():
            cells = []
            for real, found in zip(row[what], map(statistics.median, ours[what]), strict=True):
                off = real is not None and abs(found - real) > max(share * real, absolute)
                held += real is not None and not off
                compared += real is not None
                cells.append(f"{'-' if real is None else f'{real:g}'} / {found:.0f}{' !' if off else ''}")
            yield f"| {seats[0].name} | {row['build']} | {row['players']} | {what} | {' | '.join(cells)} |"
    yield f"\n{held} of {compared} hold; replays / ours, ! beyond {', '.join(map(str, TOLERANCES))} within 15, 25, 20 %"


# the command ----------------------------------------------------------------------------------------------------------


def play_missing(options: argparse.Namespace, pairs: Sequence[tuple[Seat, Seat]]) -> list[Game]:
    """Play the games of the pairs that the log does not have yet; return all games, those of the log first."""
    done = list(read_log(options.log))
    known = {(game.first, game.second, game.seed) for game in done}
    todo = [row for row in fixtures(pairs, options.games, options.seed) if row not in known]
    for number, game in enumerate(_games(options, todo), start=1):
        done.append(game)
        if options.log:
            with options.log.open("a", encoding="utf-8") as file:
                print(json.dumps(asdict(game)), file=file)
        _progress(number, len(todo), f"{game.first.name} - {game.second.name}: {game.winner} at {game.minutes} min")
    return done


def read_log(log: Path | None) -> Iterator[Game]:
    """Yield the games of a log, none if there is no such file."""
    for line in log.read_text(encoding="utf-8").splitlines() if log and log.exists() else ():
        row = json.loads(line)
        yield Game(**{**row, "first": Seat(**row["first"]), "second": Seat(**row["second"])})


def _games(options: argparse.Namespace, todo: Sequence[tuple[Seat, Seat, int]]) -> Iterator[Game]:
    if options.processes < 2:
        yield from (play(options.map, *row, options.minutes) for row in todo)
        return
    with ProcessPoolExecutor(options.processes) as pool:
        waiting = [pool.submit(play, options.map, *row, options.minutes) for row in todo]
        yield from (future.result() for future in as_completed(waiting))


def _progress(done: int, whole: int, what: str) -> None:
    print(f"{done}/{whole}  {what}", file=sys.stderr, flush=True)


def grown(options: argparse.Namespace) -> list[Growth]:
    """Measure the growth of every level and race that is asked for."""
    seats = [Seat(race, level, options.build) for race in options.races for level in options.levels]
    moments = [m for m in MOMENTS_S if m <= options.minutes * 60]
    rows: list[Growth] = []
    for number, seat in enumerate(seats, start=1):
        rows += growth(options.map, seat, moments, options.seed)
        _progress(number, len(seats), seat.name)
    return rows


def speed(options: argparse.Namespace) -> Iterator[str]:
    """Yield the lines of a table: loops per second of CPU time of a game, and what of it the computer players take."""
    think = player.think
    spent_ns = 0

    def think_in_time(world: World, number: int) -> None:
        nonlocal spent_ns
        began = time.process_time_ns()
        think(world, number)
        spent_ns += time.process_time_ns() - began

    yield "| level | loops | loops/s | without thinking | units |"
    yield f"|{'---|' * 5}"
    for level in options.levels:
        spent_ns = 0
        world = world_of(options.map, [Seat(race, level, options.build) for race in ("terran", "zerg")], options.seed)
        with mock.patch.object(player, "think", think_in_time):
            began = time.process_time()
            advance(world, math.ceil(options.minutes * 60 * FASTER_LOOPS))
            whole = time.process_time() - began
        rest = whole - spent_ns / 1e9
        yield f"| {level} | {world.loop} | {world.loop / whole:.0f} | {world.loop / rest:.0f} | {len(world.live)} |"


def main() -> None:
    """Measure what the options ask for, and print it."""
    parser = make_parser(__doc__)
    parser.add_argument("what", choices=("growth", "replays", "ladder", "speed"))
    parser.add_argument("--map", default="Melee/Simple64", help="as in the simulator's data")
    parser.add_argument("--race", default="terran", choices=RACES, help="of a ladder of one race")
    parser.add_argument("--races", nargs="*", default=list(RACES), choices=RACES)
    parser.add_argument("--levels", nargs="*", type=int, default=sorted(load_levels()))
    parser.add_argument("--neighbours", action="store_true", help="each level against the one below it, all match-ups")
    parser.add_argument("--pairs", nargs="*", default=[], help="of levels, such as 3-4; every pair by default")
    parser.add_argument("--log", type=Path, help="a file with a line for each game")
    parser.add_argument("--build", type=int, default=MACRO, help="AIBuild of the API; 1 chooses by the seed")
    parser.add_argument("--games", type=int, default=10, help="of each pair")
    parser.add_argument("--minutes", type=float, default=0.0, help="of game time; 8 for growth, 20 for games")
    parser.add_argument("--seed", type=int, default=100, help="of the first game")
    parser.add_argument("--processes", type=int, default=1)
    options = parser.parse_args()
    options.minutes = options.minutes or (20.0 if options.what == "ladder" else 8.0)
    if options.what in {"speed", "replays"}:
        for line in (speed if options.what == "speed" else beside_replays)(options):
            print(line, flush=True)
        return
    rows: Sequence[Growth | Game]
    if options.what == "growth":
        rows = grown(options)
        lines = list(growth_table(rows))
    else:
        rows = play_missing(options, pairs_of(options))
        lines = list(ladder_table(rows))
    if options.json:
        json.dump({"command": " ".join(sys.argv), "rows": [asdict(row) for row in rows]}, sys.stdout)
        return
    print("\n".join(lines))
