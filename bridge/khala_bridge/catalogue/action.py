"""The model of a text action: an entry of the catalogue.

It holds an action's name, its arguments, its units and the function of PySC2 that it ends in. It decides nothing:
`khala_bridge.act.recognise` checks whether a call fits it, `khala_bridge.act.translate` whether it is possible now.
`khala_bridge.catalogue.catalogue` lists the actions.
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
"""Begins the name that stands in a task for all actions of a group: `group:skill`."""


class Action(Frozen):
    """One text action."""

    name: str = ""
    args: tuple[ArgKind, ...] = ()
    about: str
    """Its description for a model."""
    group: str = "basic"
    """Kind of action, so that tasks can ask for many at once: `basic`, `skill`, `train`, …"""
    race: Literal["protoss", "terran", "zerg"] | None = None
    """The race that has it; None for every race."""
    aliases: tuple[str, ...] = ()
    """Other spellings of the name, as the paper or its code has them."""
    subject: Subject = "team"
    """The units that carry it out: the whole team, the one or two units that the first arguments name, or units of the
    whole side that its rule chooses."""
    units: tuple[str, ...] = ()
    """Unit types that have it; for `side` those that carry it out; () for every type."""
    function: str | None = None
    """PySC2's function that it ends in, as in `FUNCTIONS`; None for an action that orders nothing."""
    aim: Literal["unit", "place"] = "unit"
    """Whether a tag names the target itself, or only its place."""
    target: Literal["enemy", "own"] | None = None
    """Owner of the target; None for any owner."""
    queue: bool = False
    """Whether it waits for the unit's earlier orders of the same reply."""
    rule: str | None = None
    """Rule of `khala_bridge.auto` that finds the unit or the place; None if the call leaves nothing open."""
    produces: str | None = None
    """Unit type or upgrade that it produces."""

    @functools.cached_property
    def actor_count(self) -> int:
        """How many of its arguments name the units that carry it out."""
        return {"unit": 1, "two_units": 2}.get(self.subject, 0)

    @functools.cached_property
    def target_kind(self) -> ArgKind | None:
        """The kind of the target argument; None for an action without a target."""
        return self.args[self.actor_count] if len(self.args) > self.actor_count else None

    @property
    def form(self) -> str:
        """How it is written: `<Attack_Unit(tag)>`."""
        return f"<{self.name}({', '.join(self.args)})>"

    @functools.cached_property
    def pysc2(self) -> Function | None:
        """The function that it ends in."""
        return None if self.function is None else functions()[self.function]

    @functools.cached_property
    def spec(self) -> ActionSpec:
        """The action as an agent's briefing describes it."""
        return ActionSpec(
            name=self.name, args=self.args, description=self.about, actors=self.actor_count, target=self.target
        )

    def fits(self, unit_type: str) -> bool:
        """Return True if units of this type have it."""
        return not self.units or unit_type in self.units
