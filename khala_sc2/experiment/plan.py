"""The matches of an experiment: each cell of its grid with each seed, under the hash of what is played.

The hash is of the task with all its fields, the seed, the models with their files, the game and the catalogue of
actions. A match that was played is found again by it, also in a grid that has grown. It is not of the code: runs of
another version stay, and `khala experiment compare` says so.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from khala_agents.config import load_model
from khala_bridge.catalogue.catalogue import catalogue_sha256
from khala_bridge.observe import Observer
from khala_bridge.task.code import code_of
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.errors import ConfigError
from khala_protocol.trust import check_keys, check_trusted
from khala_sc2.experiment.spec import MOST_MATCHES, Level, level_of
from khala_sc2.playing import games
from khala_sc2.playing.minds import Minds, groups_of, minds_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from khala_bridge.task.config import TaskConfig
    from khala_sc2.experiment.spec import Experiment, Settings

KEY_CHARACTERS = 16
FACTOR = "factor."
"""Of labels on run cards, and of columns in exports."""
SWAPPED = "swapped"
"""Name of the factor that says whether the sides' models are swapped."""
_TASK_FIELDS = {
    "clock": "rule", "max_wait_s": "max_wait_s", "step_loops": "step_loops", "thinking_loops": "thinking_loops",
    "speed": "speed", "rhythm": "rhythm", "executor": "executor", "images": "images", "memory": "memory",
    "communication": "communication", "max_steps": "max_steps",
}  # fmt: skip
"""Settings by the names that `khala_orchestrator.config.change` has for them."""


@dataclass(frozen=True, slots=True)
class PlannedMatch:
    """One match of an experiment."""

    key: str
    """Hash of what is played."""
    cell: dict[str, str]
    """Names of the factors' values."""
    seed: int
    repetition: int
    config: MatchConfig
    minds: dict[str, Minds] = field(default_factory=dict)
    """By side, without a budget."""

    @property
    def title(self) -> str:
        """What it is, for people."""
        again = f", repetition {self.repetition}" if self.repetition else ""
        return f"{' · '.join(self.cell.values())}, seed {self.seed}{again}"


def plan(experiment: Experiment, *, game: str = "simulator") -> list[PlannedMatch]:
    """Return the matches in the order in which they are played: every cell once, then all with the next seed.

    Raises:
        ConfigError: a cell cannot be played; the text says which and why.
    """
    grid = list(cells(experiment))
    count = count_matches(experiment)
    if count > MOST_MATCHES:
        raise ConfigError(f"the grid has {count} matches, more than {MOST_MATCHES}: split the experiment")
    name = games.name_of(game)
    prepared = [(_prepare(cell, name), cell.seeds) for cell in grid]
    seeds = dict.fromkeys(seed for cell in grid for seed in cell.seeds)
    planned = [
        cell.match(experiment.name, seed, repetition)
        for repetition, seed in itertools.product(range(experiment.repetitions), seeds)
        for cell, its_seeds in prepared
        if seed in its_seeds
    ]
    return list({match.key: match for match in planned}.values())


def count_matches(experiment: Experiment) -> int:
    """Return the number of matches of the whole grid."""
    return sum(len(cell.seeds) for cell in cells(experiment)) * experiment.repetitions


def plan_cell(
    name: str, cell: dict[str, str], settings: Settings, seeds: Iterable[int], *, game: str = "simulator"
) -> list[PlannedMatch]:
    """Return the matches of one cell, which need not be of a grid, one for each seed.

    Args:
        name: of the experiment or the arena.
        cell: names for what `settings` say, by factor.
        settings: what is played.
        seeds: of the game.
        game: as `khala_sc2.playing.games` takes it.

    Raises:
        ConfigError: it cannot be played.
    """
    planned = GridCell(cell, settings, tuple(seeds))
    prepared = _prepare(planned, games.name_of(game))
    return [prepared.match(name, seed, 0) for seed in planned.seeds]


def check_playable(matches: Iterable[PlannedMatch], budget_usd: float | None) -> None:
    """Check that matches can be played and a budget be kept, before anything is: who only looks needs no key.

    Raises:
        ConfigError: code is not trusted, or a section, a model file, a key, a policy or a price is missing or wrong;
            the text says in which cell.
    """
    checked: set[str] = set()
    for match in matches:
        task = match.config.task
        try:
            if (known := task.model_dump_json()) not in checked:
                checked.add(known)
                check_trusted(code_of(task))
                for side in task.per_side():
                    Observer(side)
            for _, mind, _ in groups_of(task, match.minds):
                if (known := f"{mind!r} {task.clock!r}") not in checked:
                    checked.add(known)
                    check_keys(mind.keys_sent())
                    replace(mind, budget_usd=budget_usd).check(task.clock)
        except ConfigError as error:
            raise ConfigError(f"{_title(match.cell)}: {error}") from None


class GridCell(NamedTuple):
    """One cell of the grid."""

    names: dict[str, str]
    """Of the factors' values."""
    settings: Settings
    seeds: tuple[int, ...]


def cells(experiment: Experiment) -> Iterator[GridCell]:
    """Yield each cell of the grid."""
    for levels in itertools.product(*experiment.factors.values()):
        names = dict(zip(experiment.factors, (level.name for level in levels), strict=True))
        if not any(excluded.items() <= names.items() for excluded in experiment.exclude):
            yield from _both_ways(experiment, names, levels)
    for number, included in enumerate(experiment.include, 1):
        chosen = [_included_level(experiment, factor, value, number) for factor, value in included.items()]
        names = dict(zip(included, (level.name for level in chosen), strict=True))
        yield from _both_ways(experiment, names, chosen)


def _included_level(experiment: Experiment, factor: str, value: object, number: int) -> Level:
    known = {level.name: level for level in experiment.factors[factor]}
    if isinstance(value, str) and value in known:
        return known[value]
    try:
        return Level.model_validate(level_of(factor, value))
    except ValueError as error:
        raise ConfigError(str(error), source=f"cell {number} of include", field=factor) from None


def _both_ways(experiment: Experiment, names: dict[str, str], levels: Iterable[Level]) -> Iterator[GridCell]:
    settings = experiment.fixed
    seeds = experiment.seeds
    for level in levels:
        settings = level.settings.over(settings)
        seeds = level.seeds or seeds
    if not experiment.swap_sides:
        yield GridCell(names, settings, seeds)
        return
    if not settings.sides or len(settings.sides) != 2:
        raise ConfigError(f"swap_sides needs the models of two sides, as `sides`: {_title(names)} has none")
    (blue, red), (first, second) = settings.sides, settings.sides.values()
    swapped = settings.model_copy(update={"sides": {blue: second, red: first}})
    yield GridCell(names | {SWAPPED: "no"}, settings, seeds)
    yield GridCell(names | {SWAPPED: "yes"}, swapped, seeds)


@dataclass(frozen=True, slots=True)
class _Prepared:
    """A cell that can be played, with any seed."""

    cell: dict[str, str]
    task: TaskConfig
    minds: dict[str, Minds]
    played: str
    """What it plays, as JSON."""

    def match(self, experiment: str, seed: int, repetition: int) -> PlannedMatch:
        """Return the match with a seed."""
        text = f"{seed} {repetition} {self.played}"
        key = hashlib.sha256(text.encode()).hexdigest()[:KEY_CHARACTERS]
        labels = {"experiment": experiment, "match": key, "repetition": str(repetition)}
        labels |= {f"{FACTOR}{name}": value for name, value in self.cell.items()}
        config = MatchConfig(task=self.task, run=f"match-{key}", seed=seed, labels=labels)
        return PlannedMatch(key, self.cell, seed, repetition, config, self.minds)


def _prepare(cell: GridCell, game: str) -> _Prepared:
    try:
        task = task_of(cell.settings)
        minds = minds_for(task, cell.settings)
        list(groups_of(task, minds))  # do minds name agents that are there?
        played = {
            "task": task.model_dump(mode="json"),
            "game": game,
            "actions": catalogue_sha256(),
            "minds": {side: identity_of(mind) for side, mind in minds.items()},
        }
    except ConfigError as error:
        raise ConfigError(f"{_title(cell.names)}: {error}") from None
    return _Prepared(cell.names, task, minds, json.dumps(played, sort_keys=True, separators=(",", ":")))


def task_of(settings: Settings) -> TaskConfig:
    """Return the task with these settings.

    Raises:
        ConfigError: there is no such task, or a setting does not fit it.
    """
    if settings.task is None:
        raise ConfigError("no task is named: give the factor task, or fixed.task")
    task = load_task(settings.task)
    changes = {name: getattr(settings, ours) for ours, name in _TASK_FIELDS.items()}
    if settings.memory is not None:
        changes["memory"] = settings.memory.model_dump(exclude_unset=True)
    if settings.level or settings.against:
        asked = {"difficulty": settings.level, "race": settings.against}
        opponent = task.opponent.model_dump() | {name: value for name, value in asked.items() if value}
        changes["opponent"] = opponent
    return change(task, **changes, **(settings.fields or {}))


def minds_for(task: TaskConfig, settings: Settings) -> dict[str, Minds]:
    """Return how the agents of each side decide.

    Raises:
        ConfigError: there is no such side.
    """
    common = Minds(
        base_url=settings.base_url,
        latency_s=settings.latency_s or 0.0,
        fallback=settings.fallback,
        rethink=settings.rethink or 0,
        answer=settings.answer,
    )
    if settings.model is not None:
        common = replace(common.with_name(settings.model), base_url=settings.base_url)
    if settings.agents:
        common = replace(common, agents=settings.agents)
    return minds_of([side.side for side in task.per_side()], common, settings.sides or {})


def identity_of(mind: Minds) -> dict[str, Any]:
    """Return what makes a difference to what a side's agents say: not an address, not a budget."""
    said = {name: value for name, value in asdict(mind).items() if name not in ("budget_usd", "base_url")}
    for name in ("rethink", "answer"):  # matches that were planned before there were these keep their keys
        if not said[name]:
            del said[name]
    named = [mind, *(replace(mind, agents={}).with_name(text) for text in mind.agents.values())]
    return said | {"files": [_model_file(mind.model) for mind in named if mind.policy is None]}


def _model_file(name: str) -> Mapping[str, Any]:
    """Return what a model file says of the answers; how it is reached and limited is no part of that."""
    fields = {"profile", "model", "max_tokens", "temperature", "seed", "extra", "images", "pace", "try_timeout_s"}
    later = {"answer", "context", "detail", "system_role", "stop", "reasoning_effort"}  # older matches keep their keys
    file = load_model(name)
    return file.model_dump(mode="json", include=fields | (later & file.model_fields_set))


def _title(cell: Mapping[str, str]) -> str:
    return ", ".join(f"{factor} {value}" for factor, value in cell.items())
