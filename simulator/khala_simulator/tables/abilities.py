"""What an ability is: which units have it, what it is aimed at, what it costs, and which skill carries it out.

Data only, one record per specific ability id of the API, read from the shipped tables by ``catalog``. ``casting``
decides whether a unit may use one now, and what happens then; the rule behind each is a ``skills.Skill``, named by
``effect``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntFlag
from typing import Any, Final


class AbilityAim(IntFlag):
    """What an ability can be aimed at."""

    NONE = 1
    POINT = 2
    UNIT = 4


AIMS: Final = {
    "none": AbilityAim.NONE,
    "point": AbilityAim.POINT,
    "unit": AbilityAim.UNIT,
    "point_or_unit": AbilityAim.POINT | AbilityAim.UNIT,
    "point_or_none": AbilityAim.POINT | AbilityAim.NONE,
}


@dataclass(frozen=True, slots=True)
class Need:
    """A condition on a player's structures, upgrades and on the unit itself, as a tree.

    ``kind`` is ``unit``, ``upgrade`` or ``behavior`` (a count of ``name`` in ``state``), ``and``, ``or``, ``not`` (of
    ``parts``), ``cmp`` (``parts`` compared by ``name``), ``op`` (``parts`` joined by ``name``) or ``const``.
    """

    kind: str
    name: str = ""
    state: str = ""
    value: float | None = None
    parts: tuple[Need, ...] = ()


@dataclass(frozen=True, slots=True)
class Charges:
    """Uses that come back one by one: the number at most and at the start, and the loops for one to come back."""

    max: int
    start: int
    loops: float
    start_loops: float
    link: str


@dataclass(frozen=True, slots=True)
class Filter:
    """Which units may be targets, in the catalog's words: all of ``required`` and none of ``excluded`` hold."""

    required: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Ability:
    """One specific ability; distances are world units, ``range`` from edge to edge, 500 is the whole map.

    ``general`` is the id under which clients may also ask for it, ``solo`` means that only one of several ordered units
    uses it, ``transient`` that it leaves the unit's orders alone, ``overhead`` that the unit has to be right above the
    point. An ``unlisted`` one has no button on a command card, so the game never lists it as available: a click on a
    passenger or on a place of a queue gives it. ``count`` is how many it makes, ``supply`` their supply in all.
    ``numbers`` are the skill's own numbers.
    """

    id: int
    name: str
    effect: str = ""
    general: int = 0
    link: str = ""
    aim: AbilityAim = AbilityAim.NONE
    users: tuple[str, ...] = ()
    range: float = 0.0
    slop: float = 0.0
    arc_deg: float = 360.0
    follow_range: float = 0.0
    energy: float = 0.0
    life: float = 0.0
    minerals: int = 0
    vespene: int = 0
    cooldown_loops: float = 0.0
    cooldown: str = ""
    cooldown_shared: bool = False
    charges: Charges | None = None
    filters: Filter = Filter()
    autocast: str = ""
    autocast_range: float = 0.0
    autocast_filters: Filter = Filter()
    transient: bool = False
    unlisted: bool = False
    overhead: bool = False
    moves: bool = False
    solo: bool = False
    intro_loops: float = 0.0
    prep_loops: float = 0.0
    finish_loops: float = 0.0
    outro_loops: float = 0.0
    unit: str = ""
    units: tuple[str, ...] = ()
    upgrade: str = ""
    loops: float = 0.0
    random_loops: float = 0.0
    count: int = 1
    supply: float = 0.0
    building: bool = False
    requires: Need | None = None
    shown_if: Need | None = None
    numbers: dict[str, Any] = field(default_factory=dict, hash=False, compare=False)

    @property
    def requires_point(self) -> bool:
        """Whether it must be aimed, in the terms of the API's list of available abilities."""
        return AbilityAim.NONE not in self.aim

    @property
    def timer(self) -> str:
        """The name of its cooldown; abilities that share one share the name."""
        return self.cooldown or self.link


def ability_from(raw: dict[str, Any]) -> Ability:
    """Return the record in one row of ``abilities.json``."""
    raw = dict(raw)
    charges = raw.pop("charges", None)
    return Ability(
        aim=AIMS[raw.pop("target", "none")],
        users=tuple(raw.pop("users", ())),
        units=tuple(raw.pop("units", ())),
        charges=charges and Charges(**charges),
        filters=filter_from(raw.pop("filters", "")),
        autocast_filters=filter_from(raw.pop("autocast_filters", "")),
        requires=need_from(raw.pop("requires", None)),
        shown_if=need_from(raw.pop("shown_if", None)),
        **raw,
    )


def filter_from(text: str) -> Filter:
    """Return the filter in ``"Required,Words;Excluded,Words"``; "-" stands for none."""
    required, _, excluded = text.partition(";")

    def words(part: str) -> tuple[str, ...]:
        return tuple(word for word in part.split(",") if word not in ("", "-"))

    return Filter(words(required), words(excluded))


def need_from(raw: dict[str, Any] | None) -> Need | None:
    """Return the condition in a row of the tables, or None."""
    if raw is None:
        return None
    kind = next(
        kind for kind in ("unit", "upgrade", "behavior", "and", "or", "not", "cmp", "op", "const") if kind in raw
    )
    if kind in ("unit", "upgrade", "behavior"):
        return Need(kind, raw[kind], raw.get("state", "done"))
    if kind == "const":
        return Need(kind, value=raw["const"])
    parts = raw["args"] if kind in ("cmp", "op") else [raw["not"]] if kind == "not" else raw[kind]
    return Need(kind, raw[kind] if kind in ("cmp", "op") else "", parts=_parts(parts))


def _parts(raws: list[dict[str, Any] | None]) -> tuple[Need, ...]:
    return tuple(need for need in map(need_from, raws) if need is not None)
