"""From the players and tasks of an arena to matches that `khala_sc2.experiment.runner` plays.

A match has a cell of four names: `group`, `task`, `first` and `second`, the players of the task's first side and of the
other one. Its results stand in the index of an experiment under these names.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from khala_orchestrator.config import load_task
from khala_protocol.errors import ConfigError
from khala_sc2.arena.pairing import Pair, pair_swiss
from khala_sc2.arena.results import PoolPlayer
from khala_sc2.experiment.plan import identity_of, minds_for, plan_cell

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_bridge.task.config import TaskConfig
    from khala_sc2.arena.spec import Arena, ArenaPlayer
    from khala_sc2.experiment.plan import PlannedMatch
    from khala_sc2.experiment.spec import Settings

MAP = "map-"
"""Before the name of a battle: the player that its map brings."""


@dataclass(frozen=True, slots=True)
class ArenaTask:
    """A task of an arena, and who can meet whom on it."""

    group: str
    name: str
    """As the file of the arena has it."""
    task: TaskConfig
    pairs: tuple[Pair, ...]
    seats: tuple[str, ...]
    """Players with a model."""

    @property
    def is_duel(self) -> bool:
        """Whether both sides have agents."""
        return bool(self.task.sides)

    def ways(self, pair: Pair) -> list[Pair]:
        """Return a pair as it sits in the matches of a round: in a duel both ways."""
        return [pair, pair[::-1]] if self.is_duel else [pair]


def tasks_of(arena: Arena) -> list[ArenaTask]:
    """Return the tasks of an arena.

    Raises:
        ConfigError: there is no such task, or nobody can meet on it.
    """
    return [_task_of(arena, group, name) for group, names in arena.groups.items() for name in names]


def _task_of(arena: Arena, group: str, name: str) -> ArenaTask:
    task = load_task(name)
    models = [player.name for player in arena.players if player.model is not None]
    if task.sides:
        pairs = list(itertools.combinations(models, 2))
    elif task.map_spec.any_race:
        others = [player.name for player in arena.players if player.model is None]
        pairs = list(itertools.product(models, others))
    else:
        pairs = [(model, f"{MAP}{task.name}") for model in models]
    if not pairs:
        needs = "two players with a model" if task.sides else "a player with a model, and a level or a guest"
        raise ConfigError(f"nobody can meet on the task {name}: it needs {needs}", source=arena.name, field="groups")
    return ArenaTask(group, name, task, tuple(pairs), tuple(models))


def plan_round(
    arena: Arena,
    number: int,
    *,
    met: Mapping[str, Mapping[frozenset[str], int]],
    ratings: Mapping[str, Mapping[str, float]],
    game: str,
) -> list[PlannedMatch]:
    """Return the matches of a round.

    Args:
        arena: whose round it is.
        number: from 1; the seed of its matches.
        met: by task, how often two players have met in earlier rounds.
        ratings: by group, after earlier rounds, as far as they are known.
        game: as the nodes find it.

    Raises:
        ConfigError: a match cannot be played.
    """
    return [
        match
        for task in tasks_of(arena)
        for pair in _pairs_of_round(arena, task, met.get(task.name, {}), ratings.get(task.group, {}))
        for way in task.ways(pair)
        for match in plan_cell(arena.name, _cell(task, way), _settings(arena, task, way), [number], game=game)
    ]


def _pairs_of_round(
    arena: Arena, task: ArenaTask, met: Mapping[frozenset[str], int], ratings: Mapping[str, float]
) -> Iterable[Pair]:
    if arena.pairing == "round-robin":
        return task.pairs
    return pair_swiss(task.pairs, met, ratings, task.seats)


def _cell(task: ArenaTask, pair: Pair) -> dict[str, str]:
    return {"group": task.group, "task": task.name, "first": pair[0], "second": pair[1]}


def _settings(arena: Arena, task: ArenaTask, pair: Pair) -> Settings:
    first = arena.player(pair[0])
    changes: dict[str, Any] = {"task": task.name}
    if task.is_duel:
        sides = [side.side for side in task.task.sides]
        changes["sides"] = {side: arena.player(name).model for side, name in zip(sides, pair, strict=True)}
        return arena.fixed.model_copy(update=changes)
    changes["model"] = first.model
    if not pair[1].startswith(MAP):
        changes |= _against(arena, arena.player(pair[1]))
    return arena.fixed.model_copy(update=changes)


def _against(arena: Arena, other: ArenaPlayer) -> dict[str, Any]:
    if other.level is not None:
        return {"level": other.level}
    opponent = {"kind": "guest", "command": shlex.split(other.guest or "")}
    return {"fields": dict(arena.fixed.fields or {}) | {"opponent": opponent}}


def pool_of(arena: Arena) -> dict[str, PoolPlayer]:
    """Return all players of an arena by name, also those that maps bring, with what makes each the same elsewhere.

    Raises:
        ConfigError: there is no such model.
    """
    found = {player.name: _pool_player(arena, player) for player in arena.players}
    for task in tasks_of(arena):
        for _, other in task.pairs:
            if other.startswith(MAP):
                found[other] = PoolPlayer(kind="map", about=f"the computer of {task.task.name}", identity=_hash(other))
    return found


def _pool_player(arena: Arena, player: ArenaPlayer) -> PoolPlayer:
    if player.level is not None:
        return PoolPlayer(kind="level", about=f"the computer, {player.level}", identity=_hash(player.level))
    if player.guest is not None:
        return PoolPlayer(kind="guest", about=player.guest, identity=_hash(player.guest))
    settings = arena.fixed.model_copy(update={"model": player.model})
    task = next(iter(tasks_of(arena))).task
    minds = minds_for(task.model_copy(update={"sides": ()}), settings)
    about = [identity_of(mind) for mind in minds.values()]
    return PoolPlayer(kind="model", about=player.model or "", identity=_hash(json.dumps(about, sort_keys=True)))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def count_meetings(cells: Iterable[Mapping[str, str]]) -> dict[str, dict[frozenset[str], int]]:
    """Return how often players have met, by task, from the cells of matches."""
    counts: dict[str, dict[frozenset[str], int]] = {}
    for cell in cells:
        pair = frozenset((cell["first"], cell["second"]))
        of_task = counts.setdefault(cell["task"], {})
        of_task[pair] = of_task.get(pair, 0) + 1
    return counts
