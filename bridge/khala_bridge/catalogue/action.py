"""The model of a text action: an entry of the catalogue.

It says what an action is called, what it takes, who may use it and in which of PySC2's functions it ends. It decides
nothing: whether a call fits it is the business of `khala_bridge.act.recognise`, whether it may be done now that of
`khala_bridge.act.translate`. Which actions there are is told by `khala_bridge.catalogue.catalogue`.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Literal, TypeAlias

from khala_bridge.catalogue.functions import functions
from khala_protocol.messages import ActionSpec, Frozen

if TYPE_CHECKING:
    from khala_bridge.catalogue.functions import Function

ArgKind: TypeAlias = Literal["tag", "screen", "minimap"]
Subject: TypeAlias = Literal["team", "unit", "two_units", "side"]
GROUP_SELECTOR = "group:"
"""Begins what stands in a task for all actions of a group: `group:skill`."""


class Action(Frozen):
    """One text action."""

    name: str = ""
    args: tuple[ArgKind, ...] = ()
    about: str
    """What a model is told of it."""
    group: str = "basic"
    """Kind of action, by which tasks can ask for many at once: `basic`, `skill`, `train`, …"""
    race: Literal["protoss", "terran", "zerg"] | None = None
    """Whose it is; None for every race."""
    aliases: tuple[str, ...] = ()
    """Other spellings of the name, as the paper or its code has them."""
    subject: Subject = "team"
    """Who carries it out: the whole team, the unit or the two units that the first arguments name, or units of the
    whole side that its rule chooses."""
    units: tuple[str, ...] = ()
    """Unit types that have it, for `side` those that carry it out; () for every type."""
    function: str | None = None
    """PySC2's function that it ends in, as in `FUNCTIONS`; None for an action that orders nothing."""
    aim: Literal["unit", "place"] = "unit"
    """Whether a tag names the target itself, or only the place where it stands."""
    target: Literal["enemy", "own"] | None = None
    """Whose unit the target may be; None for anybody's."""
    queue: bool = False
    """Whether it waits for the orders that the unit was given earlier in the same reply."""
    rule: str | None = None
    """Rule of `khala_bridge.auto` that finds who carries it out, or where; None if the words say it all."""
    produces: str | None = None
    """Unit type or upgrade that comes of it."""

    @property
    def named(self) -> int:
        """How many of its arguments name the units that carry it out."""
        return {"unit": 1, "two_units": 2}.get(self.subject, 0)

    @property
    def target_kind(self) -> ArgKind | None:
        """What the target is given as; None for an action without a target."""
        return self.args[self.named] if len(self.args) > self.named else None

    @property
    def form(self) -> str:
        """How it is written: `<Attack_Unit(tag)>`."""
        return f"<{self.name}({', '.join(self.args)})>"

    @property
    def pysc2(self) -> Function | None:
        """The function that it ends in."""
        return None if self.function is None else functions()[self.function]

    @functools.cached_property
    def spec(self) -> ActionSpec:
        """What an agent is told of it."""
        return ActionSpec(name=self.name, args=self.args, description=self.about)

    def fits(self, unit_type: str) -> bool:
        """Whether units of this type have it at all."""
        return not self.units or unit_type in self.units
