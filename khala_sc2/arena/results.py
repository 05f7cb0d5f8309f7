"""The file of what an arena has played: games, players and run cards, as JSON that people can send to each other.

`khala arena run` writes it beside the recordings, and `show` and `export` read one or several of them. A file may be
anyone's: what stands in it is checked when it is read, and recordings are looked for only below its own directory.
"""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, JsonValue, ValidationError

from khala_protocol.errors import ConfigError
from khala_protocol.files import MB, read_limited, write_private
from khala_protocol.messages import Frozen, Variant
from khala_sc2.experiment.plan import FACTOR

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from khala_sc2.experiment.store import Store

RESULTS = "results.json"
MOST_BYTES = 256 * MB
_CARD_CHARACTERS = 12

Key = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
Short = Annotated[str, Field(max_length=200)]
Number = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class PoolPlayer(Frozen):
    """A player of one or several arenas."""

    kind: Literal["model", "level", "guest", "map"]
    about: Annotated[str, Field(max_length=1000)]
    """For people: its model, its level, or its command."""
    identity: Key
    """The same for the same player: a hash of what makes a difference to its decisions, as far as a file can say."""


class GameSeat(Frozen):
    """One side of a game."""

    player: Short
    tokens: Annotated[int, Field(ge=0)] = 0
    """Read and written."""
    cost_usd: Number | None = None
    """None if no price is known."""


class ArenaGame(Frozen):
    """One game that was played to its end, and is valid."""

    match: Key
    """The hash of what was played, as in experiments."""
    group: Short
    task: Short
    variant: Variant = "files"
    """Of the task: as its published files play it, or as its paper says."""
    seed: int
    first: GameSeat
    second: GameSeat
    outcome: Literal["win", "draw", "loss"]
    """Of the first player; a game that was cut at its limit of steps is a draw."""
    cause: Short
    clock: Short
    """Rule of the clock."""
    steps: Annotated[int, Field(ge=0)]
    game_s: Number
    killed: Number
    """Value that the first side killed."""
    lost: Number
    """Value that it lost."""
    card: Annotated[str, Field(pattern=r"^[0-9a-f]{12}$")]
    """Of `ArenaResults.cards`."""
    recording: Annotated[str, Field(pattern=r"^matches/[0-9a-f]{16}/recording[0-9-]*\.mcap$")]
    """From the directory of the file on."""

    @property
    def score(self) -> float:
        """Points of the first player."""
        return {"win": 1.0, "draw": 0.5, "loss": 0.0}[self.outcome]


class ArenaResults(Frozen):
    """What one arena has played."""

    format: Literal["khala arena results 1"] = "khala arena results 1"
    arena: Short
    anchors: dict[Short, Annotated[float, Field(allow_inf_nan=False)]]
    players: dict[Short, PoolPlayer]
    cards: dict[str, dict[str, JsonValue]]
    """What run cards say of map, clock, game, task, versions and hardware, by hash."""
    games: tuple[ArenaGame, ...]
    left_out: Annotated[int, Field(ge=0)] = 0
    """Matches that crashed or are not valid."""


@dataclass(slots=True)
class PlayerPool:
    """The games of one or several files."""

    players: dict[str, PoolPlayer] = field(default_factory=dict)
    anchors: dict[str, float] = field(default_factory=dict)
    games: list[ArenaGame] = field(default_factory=list)
    places: dict[str, Path] = field(default_factory=dict)
    """By match, where its recording would be."""
    remarks: list[str] = field(default_factory=list)
    """What a reader of the ratings must know."""
    arenas: list[str] = field(default_factory=list)


def results_of(
    name: str, anchors: Mapping[str, float], players: Mapping[str, PoolPlayer], store: Store
) -> ArenaResults:
    """Return what the directory of an arena holds."""
    played = store.matches()
    rows: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in store.results():
        if row["state"] == "done" and {row[f"{FACTOR}first"], row[f"{FACTOR}second"]} <= players.keys():
            rows[row["match"]].append(row)
    cards: dict[str, dict[str, JsonValue]] = {}
    games = []
    for key, sides in rows.items():
        card = played[key].card
        number = hashlib.sha256(json.dumps(card, sort_keys=True).encode()).hexdigest()[:_CARD_CHARACTERS]
        cards[number] = card
        names = [side["side"] for side in card["task"].get("sides", ())]  # an index has them by the alphabet
        in_order = sorted(sides, key=lambda row: names.index(row["side"]) if names else 0)
        games.append(_game(key, in_order, number, played[key].recording))
    left_out = sum(match.state != "done" for match in played.values())
    games.sort(key=lambda game: (game.group, game.task, game.seed, game.first.player, game.second.player))
    return ArenaResults(arena=name, anchors=dict(anchors), players=dict(players), cards=cards, games=tuple(games),
                        left_out=left_out)  # fmt: skip


def _game(key: str, sides: Sequence[Mapping[str, Any]], card: str, recording: str) -> ArenaGame:
    """Return a game from the rows of its sides, of which the first is that of the first player."""
    row = sides[0]
    other = sides[1] if len(sides) > 1 else None
    return ArenaGame(
        match=key, group=row[f"{FACTOR}group"], task=row[f"{FACTOR}task"], variant=row["variant"], seed=row["seed"],
        first=_seat(row[f"{FACTOR}first"], row), second=_seat(row[f"{FACTOR}second"], other),
        outcome="draw" if row["outcome"] == "cut" else row["outcome"], cause=row["cause"],
        clock=row["clock"], steps=row["steps"], game_s=row["game_s"],
        killed=row["killed_value"] or 0.0, lost=row["lost_value"] or 0.0, card=card, recording=recording,
    )  # fmt: skip


def _seat(player: str, row: Mapping[str, Any] | None) -> GameSeat:
    if row is None:
        return GameSeat(player=player)
    tokens = row["prompt_tokens"] + row["completion_tokens"]
    return GameSeat(player=player, tokens=tokens, cost_usd=row["paid_usd"])


def write_results(results: ArenaResults, path: Path) -> None:
    """Write a file of results: a game on each line, so that a change of it can be read."""
    plain = results.model_dump(mode="json", exclude={"games"})
    games = ",\n  ".join(game.model_dump_json() for game in results.games)
    text = json.dumps(plain, indent=1, sort_keys=True).removesuffix("\n}")
    write_private(path, f'{text},\n "games": [\n  {games}\n ]\n}}\n')


def read_results(path: Path) -> ArenaResults:
    """Return what a file has, or `results.json` of a directory.

    Raises:
        ConfigError: it cannot be read, or is no such file.
    """
    path = path / RESULTS if path.is_dir() else path
    try:
        return ArenaResults.model_validate_json(read_limited(path, MOST_BYTES))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror or error}; `khala arena run` writes one") from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise ConfigError(f"{first['msg']}", source=str(path), field=place) from None


def pool_results(paths: Sequence[Path]) -> PlayerPool:
    """Return the games of several files together; a match that two files have is counted once.

    Raises:
        ConfigError: a file cannot be read, or two files mean different players or anchors by the same name.
    """
    pool = PlayerPool()
    codes: set[str] = set()
    tasks: dict[str, set[str]] = {}
    for path in paths:
        results = read_results(path)
        directory = path if path.is_dir() else path.parent
        _add_players(pool, results, str(path))
        pool.arenas.append(results.arena)
        for game in results.games:
            _check_names(game, results, str(path))
            if game.match not in pool.places:
                pool.places[game.match] = directory / game.recording
                pool.games.append(game)
                codes.add(str(results.cards.get(game.card, {}).get("code", "")))
        for group, found in _tasks_by_group(results).items():
            if tasks.setdefault(group, found) != found:
                pool.remarks.append(
                    f"{results.arena} has other tasks in {group} than a file before: players of one file who have not "
                    "met those of the other are compared over unlike tasks there."
                )
        if results.left_out:
            pool.remarks.append(f"{results.left_out} matches of {results.arena} crashed or are not valid: not counted.")
    if len(codes) > 1:
        pool.remarks.append(f"The games were played by {len(codes)} states of Khala's code: levels may differ.")
    return pool


def _tasks_by_group(results: ArenaResults) -> dict[str, set[str]]:
    tasks: dict[str, set[str]] = defaultdict(set)
    for game in results.games:
        tasks[game.group].add(game.task)
    return tasks


def _add_players(pool: PlayerPool, results: ArenaResults, source: str) -> None:
    for name, player in results.players.items():
        if pool.players.setdefault(name, player).identity != player.identity:
            raise ConfigError(
                f"{name} is another player here ({player.about}) than in a file before ({pool.players[name].about}): "
                "give it another name", source=source, field="players",
            )  # fmt: skip
    for name, rating in results.anchors.items():
        if pool.anchors.setdefault(name, rating) != rating:
            raise ConfigError(
                f"the anchor {name} has {rating:g} here and {pool.anchors[name]:g} in a file before: arenas are "
                "compared by the same anchors", source=source, field="anchors",
            )  # fmt: skip


def _check_names(game: ArenaGame, results: ArenaResults, source: str) -> None:
    for seat in (game.first, game.second):
        if seat.player not in results.players:
            raise ConfigError(f"the game {game.match} has the player {seat.player!r}, whom `players` does not have",
                              source=source, field="games")  # fmt: skip
