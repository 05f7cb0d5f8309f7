"""The answer of a judgement: why something is not possible now, as data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeAlias, get_args

if TYPE_CHECKING:
    from khala_bridge.rules.cost import Shortfall

Kind: TypeAlias = Literal[
    "nobody",
    "ability",
    "weapon",
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
    """Type of the unit that is spoken of; of nobody, the types that could."""
    tag: int = 0
    """Its tag."""
    among: tuple[str, ...] = ()
    """Types of all units that were asked, where there are several."""
    names: tuple[str, ...] = ()
    """What is missing: structures and upgrades, an add-on, or what is researched."""
    begun: tuple[str, ...] = ()
    """Those of the missing structures that are being built."""
    missing: tuple[Shortfall, ...] = ()
    """The accounts that do not suffice."""
    needs: float = 0.0
    """Energy that it takes, or seconds between two uses."""
    has: float = 0.0
    """Energy that is there, how much of the unit is built, or how many orders it has."""


def rank(why: Unavailable) -> tuple[int, float, int]:
    """Return how near a unit is to being able; the nearest of several is spoken of, with more energy before less."""
    return RANKS[why.kind], why.has, -why.tag
