"""The result of a judgement: why something is not possible now, as data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeAlias, get_args

if TYPE_CHECKING:
    from khala_bridge.rules.cost import Shortfall

Kind: TypeAlias = Literal[
    "nobody",
    "ability",
    "weapon",
    "disarmed",
    "unfinished",
    "researched",
    "researching",
    "requirement",
    "addon",
    "energy",
    "price",
    "taken",
    "occupied",
    "queue",
    "attached",
    "at_work",
    "power",
    "cooldown",
    "game",
]
"""Kinds of reasons, in the order in which they are tried: the later, the nearer a unit is to being able."""
RANKS: Final = {kind: rank for rank, kind in enumerate(get_args(Kind))}


class Unavailable(NamedTuple):
    """Why one unit, or any of several, cannot do something now. `khala_bridge.rules.words` writes it."""

    kind: Kind
    who: str = ""
    """Type of the unit; if there is no unit, the types that could do it."""
    tag: int = 0
    """Its tag."""
    among: tuple[str, ...] = ()
    """Types of all judged units, if there are several."""
    names: tuple[str, ...] = ()
    """Names of what is missing: structures and upgrades, or an add-on; or the upgrade that is researched."""
    begun: tuple[str, ...] = ()
    """Those of the missing structures that are being built."""
    missing: tuple[Shortfall, ...] = ()
    """The accounts that do not suffice."""
    needs: float = 0.0
    """Energy that a use takes, or seconds between two uses."""
    has: float = 0.0
    """Present energy, share of the unit that is built, or number of its orders."""


def rank(why: Unavailable) -> tuple[int, float, int]:
    """Return how near a unit is to being able, with more energy before less; texts name the nearest of several."""
    return RANKS[why.kind], why.has, -why.tag
