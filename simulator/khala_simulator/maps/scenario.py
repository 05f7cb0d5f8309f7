"""The scenario language: what a map's own script does, as data.

A scenario is one YAML file of about 30 lines: who plays, where the named points and regions are, what stands there,
and an ordered list of triggers. A trigger says *when* it is looked at, *if* which condition holds, and what it will
*do*::

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

Triggers are looked at in the order of the file, and none after the one that ends the game. This module is only the
model of the whole; its parts are in ``script`` and ``places``, ``scenario_file`` reads it, ``systems.triggers``
executes it and ``maps`` joins it with its terrain.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from khala_simulator.maps.places import Model, Names, PlayerId, Point, Region, UnitName, UpgradeName
from khala_simulator.maps.script import At, Create, CreateSpec, Enters, Every, Made, Touches, Trigger
from khala_simulator.tables.versions import DEFAULT_DATA, DataSet

if TYPE_CHECKING:
    from collections.abc import Iterator

MELEE_MINERALS = 50.0
"""What every player has at the start of a melee game."""

LARGEST_SIDE = 512
"""Cells of the longest side of a map."""
OwnSide = Annotated[int, Field(ge=1, le=LARGEST_SIDE)]
Box = Annotated[
    tuple[int, int, int, int], BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
]


class Visibility(Model):
    """What the map's script switches off for every player: the fog of war and the black mask."""

    fog: bool = True
    black_mask: bool = True


class PlayerSpec(Model):
    """A player slot of the map.

    An ``open`` slot is a player only if a client takes it. Without a ``start`` a player of a melee game gets one of the
    scenario's start locations by chance. With ``ai: melee`` the game's own computer player leads its units.
    """

    race: Literal["protoss", "terran", "zerg", "random"]
    control: Literal["agent", "computer", "open"]
    start: Point | None = None
    minerals: Annotated[float, Field(ge=0)] | None = None
    vespene: Annotated[float, Field(ge=0)] = 0.0
    upgrades: tuple[UpgradeName, ...] = ()
    ai: Literal["melee"] | None = None


class Flat(Model):
    """A terrain without a terrain file: level ground of this many cells."""

    flat: Annotated[
        tuple[OwnSide, OwnSide], BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
    ]


class Scenario(Model):
    """A whole map: its terrain, players, places, what stands on it, and its script."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$")]
    family: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$")]
    title: str
    terrain: Annotated[
        Annotated[str, Tag("name")] | Annotated[Flat, Tag("flat")],
        Discriminator(lambda value: "name" if isinstance(value, str) else "flat"),
    ]
    data: DataSet = DEFAULT_DATA
    """Whose numbers units have: those of the mods that the map depends on."""
    playable: Box | None = None
    """The playable part of the terrain, ``[x0, y0, x1, y1]``; by default the terrain's own."""
    visibility: Visibility = Visibility()
    camera: Point | None = None
    """Where the camera starts; by default at the player's workers in a melee game, else in the middle."""
    score: Literal["melee", "curriculum", "collected"] = "melee"
    """What the API calls the score: the game's own, the script's, or the resources that were gathered."""
    melee: bool = False
    """Whether every player starts with a town hall and twelve workers, and loses with their last structure."""
    elimination: bool = True
    """Whether a player of a melee game loses with the last structure; without it, the triggers alone end the game."""
    start_locations: tuple[Point, ...] = ()
    players: dict[PlayerId, PlayerSpec]
    own_types: tuple[UnitName, ...] = ()
    """The map's own unit types in the order of their API ids; by default that of the tables."""
    points: dict[str, Point] = Field(default_factory=dict)
    regions: dict[str, Region] = Field(default_factory=dict)
    groups: dict[str, tuple[CreateSpec, ...]] = Field(default_factory=dict)
    """Units that triggers make by name."""
    units: tuple[CreateSpec, ...] = ()
    """What stands on the map before any trigger is looked at."""
    triggers: tuple[Trigger, ...] = ()
    estimates: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _starts(self) -> Scenario:
        if self.melee:
            open_starts = len(self.start_locations)
            without = [number for number, player in self.players.items() if player.start is None]
            if len(without) > open_starts:
                raise ValueError(f"a melee game needs a start location for player {without[open_starts]}")
        return self

    def stated_points(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield each point that the file gives in numbers, with its field; those that are drawn or counted are not."""
        yield from ((f"points.{name}", point) for name, point in self.points.items())
        yield from ((f"start_locations[{number}]", point) for number, point in enumerate(self.start_locations))
        yield from (
            (f"players.{number}.start", player.start) for number, player in self.players.items() if player.start
        )
        if self.camera is not None:
            yield "camera", self.camera
        for field, spec in self._create_specs():
            if isinstance(spec.at, tuple):
                for place in spec.at if isinstance(spec.at[0], tuple) else [spec.at]:
                    yield f"{field}.at", place

    def _create_specs(self) -> Iterator[tuple[str, CreateSpec]]:
        yield from ((f"units[{number}]", spec) for number, spec in enumerate(self.units))
        for name, group in self.groups.items():
            yield from ((f"groups.{name}[{number}]", spec) for number, spec in enumerate(group))
        for number, trigger in enumerate(self.triggers):
            for place, action in enumerate(trigger.do):
                if isinstance(action, Create):
                    yield f"triggers[{number}].do[{place}].create", action.create

    @cached_property
    def periods(self) -> tuple[int, ...]:
        """The periods in game loops at which any trigger is due."""
        return tuple(sorted({w.every_loops for w in self._whens if isinstance(w, Every)}))

    @cached_property
    def moments(self) -> frozenset[int]:
        """The single game loops at which any trigger is due."""
        return frozenset(w.at_loop for w in self._whens if isinstance(w, At))

    @cached_property
    def watches(self) -> bool:
        """Whether any trigger waits for what can happen in every loop."""
        return any(isinstance(w, Made | Enters | Touches) for w in self._whens)

    @cached_property
    def _whens(self) -> list[Any]:
        return [when for trigger in self.triggers for when in trigger.when]


def names_of(raw: Any) -> Names:
    """Return the names that the parts of a scenario may refer to, from its unchecked data."""
    raw = raw if isinstance(raw, dict) else {}

    def keys(field: str) -> set[Any]:
        value = raw.get(field)
        return set(value) if isinstance(value, dict) else set()

    return Names(
        players=frozenset({0, *keys("players")}),
        points=frozenset(keys("points") | set(_drawn_points(raw.get("triggers")))),
        regions=frozenset(keys("regions")),
        groups=frozenset(keys("groups")),
    )


def _drawn_points(triggers: Any) -> list[str]:
    """Return the names of the points that triggers draw."""
    found: list[str] = []
    for trigger in triggers if isinstance(triggers, list) else ():
        actions = trigger.get("do") if isinstance(trigger, dict) else None
        for action in actions if isinstance(actions, list) else ():
            options = action.get("draw", ()) if isinstance(action, dict) else ()
            for option in options if isinstance(options, list) else [options]:
                found += list(option) if isinstance(option, dict) else []
    return found
