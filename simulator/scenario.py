"""The scenario language: what a map's own script does, as data.

A scenario is one YAML file of about 30 lines: who plays, where the named points are, and an ordered list of
triggers. A trigger says *when* it is looked at, *if* which condition holds, and what it will *do*::

    triggers:
      - name: spawn
        when: [start, unit_died]
        if: {alive: {1: none, 2: none}}
        do:
          - create: {player: 1, unit: Stalker, count: 2, at: team_1, facing: 4.7124}
          - order: {player: 2, attack_move: team_1}
      - name: victory
        when: [{every_loops: 80}]
        if: {alive: {1: some, 2: none}}
        do:
          - result: {1: victory, 2: defeat}

Triggers are looked at in the order of the file, and none after the one that ends the game. Here are only the models
and the reader; ``systems.triggers`` executes them and ``maps`` joins a scenario with its terrain.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import yaml
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

if TYPE_CHECKING:
    from pathlib import Path

PlayerId = Annotated[int, Field(ge=1, le=15)]
Outcome = Literal["victory", "defeat", "tie"]


class ScenarioError(ValueError):
    """A scenario file can't be used; the text names the file, the line and the field."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _as_point(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Point = Annotated[tuple[float, float], BeforeValidator(_as_point)]
Place = str | Point


class Visibility(_Model):
    """What the map's script switches off for everybody: the fog of war and the black mask."""

    fog: bool = True
    black_mask: bool = True


class PlayerSpec(_Model):
    """A player slot of the map."""

    race: Literal["protoss", "terran", "zerg", "random"]
    control: Literal["agent", "computer"]
    start: Point | None = None


class Every(_Model):
    """True at every multiple of this many game loops."""

    every_loops: Annotated[int, Field(gt=0)]


class At(_Model):
    """True once, at this game loop."""

    at_loop: Annotated[int, Field(ge=0)]


def _kind(value: Any) -> str | None:
    """Which of several models a value is meant to be: the name of its only key, or ``event`` for a word."""
    if isinstance(value, str):
        return "event"
    keys = list(value) if isinstance(value, dict) else list(type(value).model_fields)
    return str(keys[0]) if len(keys) == 1 else None


When = Annotated[
    Annotated[Literal["start", "unit_died"], Tag("event")]
    | Annotated[Every, Tag("every_loops")]
    | Annotated[At, Tag("at_loop")],
    Discriminator(
        _kind, custom_error_type="when", custom_error_message="give start, unit_died, {every_loops: n} or {at_loop: n}"
    ),
]


class Condition(_Model):
    """All of these must hold; ``alive`` counts the living units of a player, structures included."""

    alive: dict[PlayerId, Literal["some", "none"]]


class CreateSpec(_Model):
    """``count`` units of one type for a player, spread around a point when there are several."""

    player: PlayerId
    unit: str
    count: Annotated[int, Field(ge=1, le=400)] = 1
    at: Place
    facing: float = 4.7124


class Create(_Model):
    """Make units."""

    create: CreateSpec


class OrderSpec(_Model):
    """One order to all units of a player: an attack-move, a move, or an attack on every unit of another player."""

    player: PlayerId
    attack_move: Place | None = None
    move: Place | None = None
    attack_units_of: PlayerId | None = None

    @model_validator(mode="after")
    def _one_order(self) -> OrderSpec:
        given = [n for n in ("attack_move", "move", "attack_units_of") if getattr(self, n) is not None]
        if len(given) != 1:
            raise ValueError("give exactly one of attack_move, move, attack_units_of")
        return self


class Order(_Model):
    """Command units, replacing what they did."""

    order: OrderSpec


class Result(_Model):
    """End the game with a result for each player."""

    result: dict[PlayerId, Outcome]


Action = Annotated[
    Annotated[Create, Tag("create")] | Annotated[Order, Tag("order")] | Annotated[Result, Tag("result")],
    Discriminator(_kind, custom_error_type="do", custom_error_message="give exactly one of create, order, result"),
]


class Trigger(_Model):
    """One rule of the map's script."""

    name: str
    when: Annotated[tuple[When, ...], Field(min_length=1)]
    condition: Condition | None = Field(default=None, alias="if")
    do: Annotated[tuple[Action, ...], Field(min_length=1)]


class Scenario(_Model):
    """A whole map script with its players and points; see the module's text for the language."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$")]
    family: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$")]
    title: str
    terrain: str
    visibility: Visibility = Visibility()
    camera: Point | None = None
    players: dict[PlayerId, PlayerSpec]
    points: dict[str, Point] = {}
    triggers: tuple[Trigger, ...] = ()
    estimates: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _names_exist(self) -> Scenario:
        for trigger in self.triggers:
            for action in trigger.do:
                for place in _places(action):
                    if isinstance(place, str) and place not in self.points:
                        raise ValueError(f"trigger {trigger.name!r} uses the point {place!r}, which is not in points")
        return self

    @cached_property
    def periods(self) -> tuple[int, ...]:
        """The periods in game loops at which any trigger is due."""
        times = [when for trigger in self.triggers for when in trigger.when]
        return tuple(sorted({when.every_loops for when in times if isinstance(when, Every)}))

    @cached_property
    def moments(self) -> frozenset[int]:
        """The single game loops at which any trigger is due."""
        times = [when for trigger in self.triggers for when in trigger.when]
        return frozenset(when.at_loop for when in times if isinstance(when, At))

    def place(self, place: Place) -> tuple[float, float]:
        """World coordinates of a named point or of a pair of numbers."""
        return self.points[place] if isinstance(place, str) else place


def _places(action: Action) -> list[Place]:
    if isinstance(action, Create):
        return [action.create.at]
    if isinstance(action, Order):
        return [p for p in (action.order.attack_move, action.order.move) if p is not None]
    return []


def read_scenario(path: Path) -> Scenario:
    """Read one scenario file.

    Raises:
        ScenarioError: it can't be read, is no YAML, or breaks the language.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"{path}: can't be read: {error.strerror}") from error
    return parse_scenario(text, str(path))


def parse_scenario(text: str, source: str) -> Scenario:
    """The scenario in ``text``; ``source`` names it in errors."""
    try:
        raw = yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ScenarioError(f"{source}:{line}: not YAML: {error.problem}") from error
    try:
        return Scenario.model_validate(raw)
    except ValidationError as error:
        first = error.errors()[0]
        line, field = _locate(text, first["loc"], missing=first["type"] == "missing")
        message = first["msg"].removeprefix("Value error, ")
        raise ScenarioError(f"{source}:{line}: {field or 'the file'}: {message}") from error


def _locate(text: str, where: tuple[int | str, ...], *, missing: bool) -> tuple[int, str]:
    """The line of the innermost part of ``where`` that the file has, and the field's name.

    Parts that are no key of the file are the validator's own names of alternatives; the last one may be ``missing``.
    """
    node = yaml.compose(text, Loader=yaml.SafeLoader)
    line, field = 1, ""
    for part in where:
        if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            node, field = node.value[part], f"{field}[{part}]"
        elif isinstance(node, yaml.MappingNode):
            found = next(((key, value) for key, value in node.value if key.value == str(part)), None)
            if found is None:
                if missing and part == where[-1]:
                    field = f"{field}.{part}".lstrip(".")
                continue
            node, field = found[1], f"{field}.{part}".lstrip(".")
            line = found[0].start_mark.line + 1
            continue
        else:
            continue
        line = node.start_mark.line + 1
    return line, field
