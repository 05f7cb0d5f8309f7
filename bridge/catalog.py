"""The catalogue of text actions: a typed reading of `bridge/data/actions.yaml`.

It says what an action is called, what it takes, who may use it and what PySC2 calls it. It decides nothing: whether
a call fits it is the business of `bridge.act.recognise`, whether it may be done now that of `bridge.act.translate`.
It does not import PySC2, which takes seconds, so that tasks can be listed and checked quickly; that PySC2 has every
function that is named here, and that both functions of an action are one ability, is tested.
"""

from __future__ import annotations

import functools
from typing import Literal, TypeAlias

from bridge import data
from protocol.messages import ActionSpec, Frozen

ArgKind: TypeAlias = Literal["tag", "screen", "minimap"]
FILE = "actions.yaml"


class Needs(Frozen):
    """What has to be true for an action to be valid now."""

    weapon: bool = False
    """The unit type has a weapon."""
    upgrade: str | None = None
    """The player has this upgrade, named as in `pysc2.lib.upgrades`."""


class Action(Frozen):
    """One text action."""

    name: str = ""
    args: tuple[ArgKind, ...] = ()
    about: str
    subject: Literal["team", "unit"] = "team"
    """Who carries it out: the whole team, or the unit that the first argument names."""
    units: tuple[str, ...] = ()
    """Unit types that have it; () for every type."""
    target: Literal["enemy", "own"] | None = None
    raw: str | None = None
    """Name of PySC2's raw function; None for an action that orders nothing."""
    screen: str | None = None
    """Name of PySC2's function for the screen executor."""
    queue: bool = False
    needs: Needs = Needs()

    @property
    def target_kind(self) -> ArgKind | None:
        """What the target is given as; None for an action without a target."""
        args = self.args[1:] if self.subject == "unit" else self.args
        return args[0] if args else None

    @property
    def form(self) -> str:
        """How it is written: `<Attack_Unit(tag)>`."""
        return f"<{self.name}({', '.join(self.args)})>"

    @functools.cached_property
    def spec(self) -> ActionSpec:
        """What an agent is told of it."""
        return ActionSpec(name=self.name, args=self.args, description=self.about)

    def fits(self, unit_type: str) -> bool:
        """Whether units of this type have it at all."""
        return not self.units or unit_type in self.units


@functools.cache
def catalogue() -> dict[str, Action]:
    """Every text action by name, in the order of the file."""
    return {name: action.model_copy(update={"name": name}) for name, action in data.table(FILE, Action).items()}


def catalogue_sha256() -> str:
    """Hash of the catalogue, for the run card."""
    return data.sha256(FILE)
