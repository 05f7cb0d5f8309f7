"""The script of a scenario as data: triggers, what they wait for, what they ask, what they do.

Models only; ``systems.triggers`` says when one is due and ``systems.staging`` carries it out. Above: ``scenario``.
Below: ``places``.
"""

from __future__ import annotations

import operator
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Discriminator, Field, PlainSerializer, Tag, model_validator

from khala_simulator.maps.places import (
    MOST_UNITS,
    GroupName,
    Model,
    Owner,
    Place,
    RegionName,
    Source,
    Spot,
    UnitName,
    fields_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable

Outcome = Literal["victory", "defeat", "tie"]
Trait = Literal["structure", "worker", "caster", "flyer"]

# what a trigger waits for ---------------------------------------------------------------------------------------------


class Who(Model):
    """Units by owner and type; an omitted field matches any."""

    player: Owner | None = None
    unit: UnitName | None = None


class Every(Model):
    """At every multiple of this many game loops."""

    every_loops: Annotated[int, Field(gt=0)]


class At(Model):
    """Once, at this game loop."""

    at_loop: Annotated[int, Field(ge=0)]


class Died(Model):
    """Once for each such unit that died."""

    died: Who


class Made(Model):
    """Once for each such unit that is finished, by any player."""

    made: Who


class EnterSpec(Model):
    """Which units, into which region."""

    region: RegionName
    player: Owner | None = None
    unit: UnitName | None = None


class Enters(Model):
    """In a loop in which such a unit came into the region, or was made there."""

    enters: EnterSpec


class TouchSpec(Model):
    """A unit of ``player`` whose centre is ``within`` so much of the centre of a neutral unit."""

    player: Owner
    unit: UnitName
    within: Annotated[float, Field(gt=0)]


class Touches(Model):
    """Once for each neutral unit that is touched in this loop."""

    touches: TouchSpec


def only_key(value: Any) -> str | None:
    """Return which of several models a value is: the name of its only key, or ``event`` for a word."""
    if isinstance(value, str):
        return "event"
    keys = list(fields_of(value))
    return str(keys[0]) if len(keys) == 1 else None


When = Annotated[
    Annotated[Literal["start", "unit_died"], Tag("event")]
    | Annotated[Every, Tag("every_loops")]
    | Annotated[At, Tag("at_loop")]
    | Annotated[Died, Tag("died")]
    | Annotated[Made, Tag("made")]
    | Annotated[Enters, Tag("enters")]
    | Annotated[Touches, Tag("touches")],
    Discriminator(
        only_key,
        custom_error_type="when",
        custom_error_message="give start, unit_died, {every_loops: n}, {at_loop: n}, {died: who}, {made: who}, "
        "{enters: ...} or {touches: ...}",
    ),
]

# what it asks ---------------------------------------------------------------------------------------------------------

OPERATORS: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
}
_COMPARISON = re.compile(r"^(<=|>=|==|<|>)\s*(\d+)$")


@dataclass(frozen=True, slots=True)
class NumberCondition:
    """A condition on a number: ``6`` or ``"< 6"`` in a file."""

    operator: str
    number: int

    def holds(self, value: float) -> bool:
        """Return whether a value fits."""
        return OPERATORS[self.operator](value, self.number)

    def __str__(self) -> str:
        return f"{self.operator} {self.number}"


def _comparison(value: Any) -> Any:
    if isinstance(value, int) and not isinstance(value, bool):
        return NumberCondition("==", value)
    found = _COMPARISON.match(value) if isinstance(value, str) else None
    if found is None and not isinstance(value, NumberCondition):
        raise ValueError('give a number, or a comparison such as "< 6"')
    return value if found is None else NumberCondition(found[1], int(found[2]))


Asked = Annotated[NumberCondition, BeforeValidator(_comparison), PlainSerializer(str)]


class Condition(Model):
    """All given fields must hold.

    ``alive`` asks for any living unit of a player, structures included; ``count`` for numbers of finished units of a
    type, passengers included; ``count_unfinished`` also counts unfinished ones; ``score`` asks for the curriculum
    score; one of ``any`` must hold.
    """

    alive: dict[Owner, Literal["some", "none"]] = Field(default_factory=dict)
    count: dict[Owner, dict[UnitName, Asked]] = Field(default_factory=dict)
    count_unfinished: dict[Owner, dict[UnitName, Asked]] = Field(default_factory=dict)
    score: dict[Owner, Asked] = Field(default_factory=dict)
    any: tuple[Condition, ...] = ()


# what it does ---------------------------------------------------------------------------------------------------------


class CreateSpec(Model):
    """Units of one type for a player.

    ``count`` of them at a point or a random place, spread around it when there are several; one at each of several
    places. Each of them carries its ``cargo``.
    """

    player: Owner
    unit: UnitName
    count: Annotated[int, Field(ge=1, le=MOST_UNITS)] = 1
    at: Spot
    facing: float | Literal["random"] = 4.7124
    life: Annotated[float, Field(gt=0)] | None = None
    energy: Annotated[float, Field(ge=0)] | None = None
    cargo: dict[UnitName, Annotated[int, Field(ge=1, le=8)]] = Field(default_factory=dict, max_length=8)


class Create(Model):
    """Make units."""

    create: CreateSpec


class SpawnGroups(Model):
    """Make the units of named groups."""

    spawn: tuple[GroupName, ...]


class RegroupSpec(Model):
    """Which units are replaced, how many more come, and where."""

    player: Owner
    unit: UnitName
    more: Annotated[int, Field(ge=0, le=MOST_UNITS)] = 0
    at: Spot


class Regroup(Model):
    """Replace a player's units of a type by as many new ones, each with its former life, and add ``more``."""

    regroup: RegroupSpec


class Remove(Model):
    """Take units out of the game without a death: matching units, or the touched one."""

    remove: Who | Literal["touched"]


ORDERS: Final = ("attack_move", "move", "attack_units_of", "attack_nearest_of", "unload_at", "gather_near")


class OrderSpec(Model):
    """One order to a player's units; ``unit``, ``group``, ``inside``, ``idle`` and ``unless`` narrow them down.

    ``gather_near`` is for the mineral field nearest to the place, ``unload_at`` for transports. ``queue`` says whether
    it replaces what they do, goes before that, or after it.
    """

    player: Owner
    unit: UnitName | None = None
    group: GroupName | None = None
    inside: RegionName | None = None
    idle: bool = False
    unless: tuple[Trait, ...] = ()
    attack_move: Place | None = None
    move: Place | None = None
    attack_units_of: Owner | None = None
    attack_nearest_of: Owner | None = None
    unload_at: Place | None = None
    gather_near: Place | None = None
    queue: Literal["replace", "front", "append"] = "replace"

    @model_validator(mode="after")
    def _one_order(self) -> OrderSpec:
        given = [n for n in ORDERS if getattr(self, n) is not None]
        if len(given) != 1:
            raise ValueError(f"give exactly one of {', '.join(ORDERS)}")
        return self


class OrderUnits(Model):
    """Command units."""

    order: OrderSpec


class Select(Model):
    """Select units of a player in the player's interface."""

    select: Who


class Draw(Model):
    """Choose one of several sets of named points by chance; a region stands for any point of it."""

    draw: Annotated[tuple[dict[str, Source], ...], Field(min_length=1)]

    @model_validator(mode="before")
    @classmethod
    def _options(cls, value: Any) -> Any:
        options = value.get("draw") if isinstance(value, dict) else None
        return {"draw": [options]} if isinstance(options, dict) else value


class AddScore(Model):
    """Add to the curriculum score of players."""

    score: dict[Owner, float]


class StartingResources(Model):
    """Resources."""

    minerals: float = 0.0
    vespene: float = 0.0


class Give(Model):
    """Give resources to players."""

    give: dict[Owner, StartingResources]


class EndGame(Model):
    """End the game with a result for each player."""

    result: dict[Owner, Outcome]


Action = Annotated[
    Annotated[Create, Tag("create")]
    | Annotated[SpawnGroups, Tag("spawn")]
    | Annotated[Regroup, Tag("regroup")]
    | Annotated[Remove, Tag("remove")]
    | Annotated[OrderUnits, Tag("order")]
    | Annotated[Select, Tag("select")]
    | Annotated[Draw, Tag("draw")]
    | Annotated[AddScore, Tag("score")]
    | Annotated[Give, Tag("give")]
    | Annotated[EndGame, Tag("result")],
    Discriminator(
        only_key,
        custom_error_type="do",
        custom_error_message="give exactly one of create, spawn, regroup, remove, order, select, draw, score, give, "
        "result",
    ),
]


class Trigger(Model):
    """One rule of the map's script."""

    name: str
    when: Annotated[tuple[When, ...], Field(min_length=1)]
    condition: Condition | None = Field(default=None, alias="if")
    do: Annotated[tuple[Action, ...], Field(min_length=1)]
