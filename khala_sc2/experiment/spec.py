"""The file of an experiment: which settings vary, which stay, how often each match is played, and what it may cost.

    name: pair
    fixed: {clock: frozen, rhythm: paper}
    factors:
      task: [2s3z_pair, 3s5z]
      player:
        - {name: skilled, model: scripted/skilled}
        - {name: focus, model: scripted/focus-fire}
    seeds: 20

A factor is a setting with several values, or a name of its own whose values are settings with a `name`.
`khala_sc2.experiment.plan` makes the matches of it.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping  # noqa: TC003  # pydantic looks at annotations of methods, too
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, JsonValue, field_validator, model_validator

from khala_agents.answers.form import AnswerForm  # noqa: TC001  # pydantic evaluates it
from khala_bridge.task.maps import Difficulty, Race  # noqa: TC001  # pydantic evaluates them
from khala_protocol.clock_rule import ClockRule  # noqa: TC001  # pydantic evaluates it
from khala_protocol.errors import WrongKey
from khala_protocol.keys import check_name
from khala_protocol.messages import Frozen, MemoryRule
from khala_protocol.rethinks import MAX_RETHINKS
from khala_sc2.experiment.published import PublishedTable, table_named

MOST_MATCHES = 100_000
MOST_SEEDS = 10_000


def _check_name(value: str) -> str:
    try:
        return check_name(value, "experiment")
    except WrongKey as error:
        raise ValueError(str(error)) from None


def _seeds(value: object) -> object:
    """Return a list for `20` (1 to 20) and for `1-20`."""
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= MOST_SEEDS:
            raise ValueError(f"give a number from 1 to {MOST_SEEDS}, a list, or a range such as 1-20")
        return list(range(1, value + 1))
    if isinstance(value, str):
        first, dash, last = value.partition("-")
        if not (dash and first.strip().isdecimal() and last.strip().isdecimal() and int(first) <= int(last)):
            raise ValueError(f"{value!r} is not a range of seeds: write it as 1-20")
        if int(last) - int(first) >= MOST_SEEDS:
            raise ValueError(f"there are at most {MOST_SEEDS} seeds")
        return list(range(int(first), int(last) + 1))
    return value


Seeds = Annotated[tuple[Annotated[int, Field(ge=0, lt=2**31)], ...], BeforeValidator(_seeds),
                  Field(min_length=1, max_length=MOST_SEEDS)]  # fmt: skip


class Settings(Frozen):
    """What a match is played with; None for what its task says, and for agents what `khala run` would do."""

    task: str | None = None
    """Name of a task, or path of its file."""
    model: str | None = None
    """Of all agents: a model, a model and its name at the endpoint (`scripted/skilled`), or a policy
    (`my_agent:decide`)."""
    agents: dict[str, str] | None = None
    """Models of single agents, by name."""
    sides: dict[str, str] | None = None
    """Models of the sides of a duel, by name."""
    base_url: str | None = None
    answer: AnswerForm | None = None
    """Form of the models' answers: `text`, `json`, `tools` or `grammar`."""
    fallback: str | None = None
    rethink: int | None = Field(default=None, ge=0, le=MAX_RETHINKS)
    """How often models are asked again in a step, if nothing of their answer is possible."""
    latency_s: float | None = Field(default=None, ge=0)
    """Of the scripted model's endpoint."""
    clock: ClockRule | None = None
    max_wait_s: float | None = Field(default=None, gt=0)
    step_loops: int | None = Field(default=None, ge=1)
    thinking_loops: int | None = Field(default=None, ge=0)
    speed: float | None = Field(default=None, gt=0)
    rhythm: str | None = None
    executor: str | None = None
    images: str | None = None
    memory: MemoryRule | None = None
    communication: bool | None = None
    max_steps: int | None = Field(default=None, ge=1)
    level: Difficulty | None = None
    """Of the computer that the agents play against."""
    against: Race | None = None
    """Its race."""
    fields: dict[str, JsonValue] | None = None
    """Further fields of the task file, such as `max_actions` or `agents`; they replace those of the task."""

    def over(self, other: Settings) -> Settings:
        """Return these settings, with those of another where these say nothing."""
        return other.model_copy(update={name: getattr(self, name) for name in self.model_fields_set})


class Level(Frozen):
    """One value of a factor: its name in tables, and what it sets."""

    name: str
    settings: Settings
    seeds: Seeds | None = None
    """Of the cells that have this value, instead of the experiment's: of two such values in a cell the later counts."""


class ExperimentBudget(Frozen):
    """What the whole experiment may take. Matches that would need more are not begun."""

    usd: float | None = Field(default=None, gt=0)
    tokens: int | None = Field(default=None, gt=0)
    """Prompt and answer."""
    hours: float | None = Field(default=None, gt=0)


class Experiment(Frozen):
    """One experiment."""

    name: Annotated[str, BeforeValidator(lambda value: _check_name(value) if isinstance(value, str) else value)]
    description: str = ""
    fixed: Settings = Settings()
    factors: dict[str, tuple[Level, ...]] = Field(min_length=1)
    include: tuple[dict[str, JsonValue], ...] = ()
    """Further cells, each with a value for every factor."""
    exclude: tuple[dict[str, str], ...] = ()
    """Cells that are left out: those that have all of these values."""
    seeds: Seeds = (1,)
    """Of the game: `20` for 1 to 20, `1-20`, or a list. All cells have the same, so that they can be paired; a value of
    a factor may have more or fewer: `{name: small, model: openai, seeds: 50}`."""
    repetitions: int = Field(default=1, ge=1, le=1000)
    """Matches of the same cell and seed; more than one says something only if the model is not deterministic."""
    swap_sides: bool = False
    """In duels: play each match again with the sides' models swapped."""
    budget: ExperimentBudget = ExperimentBudget()
    retries: int = Field(default=2, ge=0, le=20)
    """How often a match that crashed is played again; a lost match is a result and is not."""
    match_hours: float = Field(default=6.0, gt=0)
    """A match that takes longer is ended, and counts as crashed."""
    published: Annotated[PublishedTable | None, BeforeValidator(table_named)] = None
    """What others published of the same cells, for the report: the name of a shipped table, or a table."""

    @field_validator("factors", mode="before")
    @classmethod
    def _levels(cls, factors: object) -> object:
        if not isinstance(factors, dict):
            return factors
        return {name: _levels_of(str(name), values) for name, values in factors.items()}

    @model_validator(mode="after")
    def _known_levels(self) -> Self:
        for factor, levels in self.factors.items():
            names = [level.name for level in levels]
            if not names:
                raise ValueError(f"the factor {factor} has no values")
            if double := next((name for name in names if names.count(name) > 1), None):
                raise ValueError(f"the factor {factor} has the value {double} twice")
        return self

    @model_validator(mode="after")
    def _known_cells(self) -> Self:
        for cell in self.exclude:
            for factor, name in cell.items():
                if factor not in self.factors:
                    raise ValueError(f"exclude names the factor {factor!r}; the factors are {', '.join(self.factors)}")
                if name not in (names := [level.name for level in self.factors[factor]]):
                    raise ValueError(f"exclude names {factor} {name!r}; its values are {', '.join(names)}")
        for included in self.include:
            if set(included) != set(self.factors):
                raise ValueError(f"a cell of include needs a value for each of {', '.join(self.factors)}, and no other")
        return self

    @model_validator(mode="after")
    def _some_task(self) -> Self:
        if not (self.fixed.task or "task" in self.factors or self._all_have_a_task()):
            raise ValueError("no task is named: give the factor task, or fixed.task")
        return self

    def only(self, where: Mapping[str, str]) -> Self:
        """Return the experiment with nothing but these values of factors.

        A value that the factor does not have is added where the factor is a setting: a model or a task of one's own.

        Raises:
            ValueError: there is no such factor or value.
        """
        for factor in where:
            if factor not in self.factors:
                raise ValueError(f"there is no factor {factor!r}; the factors are {', '.join(self.factors)}")
        chosen = {factor: (self._level(factor, name),) for factor, name in where.items()}
        included = tuple(cell for cell in self.include if where.items() <= _names_in(cell).items())
        return self.model_copy(update={"factors": self.factors | chosen, "include": included})

    def _level(self, factor: str, name: str) -> Level:
        if (known := {level.name: level for level in self.factors[factor]}.get(name)) is not None:
            return known
        if factor in Settings.model_fields:
            return Level.model_validate(level_of(factor, name))
        names = ", ".join(level.name for level in self.factors[factor])
        raise ValueError(f"the factor {factor} has no value {name!r}; its values are {names}")

    def _all_have_a_task(self) -> bool:
        return any(all(level.settings.task for level in levels) for levels in self.factors.values())


def level_of(factor: str, value: object) -> dict[str, Any]:
    """Return the name and the settings of a factor's value as fields of a `Level`.

    Raises:
        ValueError: the factor is no setting, and its value has no name.
    """
    if isinstance(value, dict) and "name" in value:
        settings = {name: set_to for name, set_to in value.items() if name not in ("name", "seeds")}
        return {"name": str(value["name"]), "settings": settings, "seeds": value.get("seeds")}
    if factor in Settings.model_fields:
        return {"name": _word(value), "settings": {factor: value}}
    close = difflib.get_close_matches(factor, Settings.model_fields, n=1)
    hint = f"did you mean {close[0]}? " if close else ""
    raise ValueError(
        f"there is no setting {factor!r}: {hint}the values of a factor with a name of its own are settings with a "
        f"`name`, such as {{name: fast, clock: frozen}}"
    )


def _levels_of(factor: str, values: object) -> object:
    if not isinstance(values, list | tuple):
        raise ValueError(f"the factor {factor} needs a list of values")  # noqa: TRY004  # pydantic wants a ValueError
    return [value if isinstance(value, Level) else level_of(factor, value) for value in values]


def _names_in(included: Mapping[str, JsonValue]) -> dict[str, str]:
    """Return the names of the values of a cell of `include`."""
    return {factor: str(level_of(factor, value)["name"]) if isinstance(value, dict) else str(value)
            for factor, value in included.items()}  # fmt: skip


def _word(value: object) -> str:
    if isinstance(value, dict):
        return ",".join(f"{key}={_word(inner)}" for key, inner in value.items())
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else str(value)
