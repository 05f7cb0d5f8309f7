"""The end of a standing order: words → a condition, judged against each snapshot.

| written | the order ends when |
|---|---|
| `22 Probe` | the side has so many, with those in production |
| `WarpGateResearch` | the upgrade is researched |
| `4:30` | the game's clock shows it |
| `attacked` | a unit of the team lost health or died; of a team of the whole side, any own unit |
| `minerals 400`, `400 vespene` | the side has as much |
| nothing | it is revoked |

Words only here: `khala_bridge.act.standing` keeps the orders.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from khala_bridge.act.rejected import CallRejected
from khala_bridge.act.vocabulary import squash
from khala_bridge.state.ground import land_of
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.knowledge import MapFacts
    from khala_bridge.state import Snapshot, Unit

Kind: TypeAlias = Literal["never", "count", "upgrade", "time", "attacked", "minerals", "vespene"]

_TIME = re.compile(r"(\d{1,3}):([0-5]\d)(?::00)?")
_AMOUNT = re.compile(r"(?P<a>\d{1,5})\s*(?P<what>[A-Za-z][\w ]*)|(?P<name>[A-Za-z][\w ]*?)[\s=:]*(?P<b>\d{1,5})")
_FORMS = "write until 22 and a type of units, until an upgrade, until 4:30, until attacked or until minerals 400"


@dataclass(frozen=True, slots=True)
class Until:
    """A condition; `text` says it in its usual form."""

    text: str = ""
    kind: Kind = "never"
    amount: float = 0.0
    """Number of units, seconds, or minerals or vespene."""
    name: str = ""
    """Of a unit type or an upgrade."""

    def is_reached(self, snapshot: Snapshot, *, attacked: bool) -> bool:
        """Return True if the order is over; `attacked` says whether its units were."""
        match self.kind:
            case "count":
                return _number_of(self.name, snapshot) >= self.amount
            case "upgrade":
                return self.name in snapshot.upgrades
            case "time":
                return snapshot.game_loop / LOOPS_PER_S >= self.amount
            case "minerals":
                return snapshot.player.minerals >= self.amount
            case "vespene":
                return snapshot.player.vespene >= self.amount
            case _:
                return attacked and self.kind == "attacked"


def read_until(words: str, facts: MapFacts) -> Until:
    """Return the condition that some words say; `facts` has the names of units and upgrades.

    Raises:
        CallRejected: they say none; the text names the forms.
    """
    if not words:
        return Until()
    if squash(words) in ("attacked", "attack", "underattack"):
        return Until("attacked", "attacked")
    if clock := _TIME.fullmatch(words):
        return Until(f"{int(clock[1])}:{clock[2]}", "time", 60 * int(clock[1]) + int(clock[2]))
    if upgrade := _match_name(words, facts.upgrades):
        return Until(upgrade, "upgrade", name=upgrade)
    if amount := _AMOUNT.fullmatch(words):
        number = int(amount["a"] or amount["b"])
        what = amount["what"] or amount["name"]
        plain = squash(what)
        if plain in ("minerals", "vespene", "gas"):
            kind: Literal["minerals", "vespene"] = "minerals" if plain == "minerals" else "vespene"
            return Until(f"{kind} {number}", kind, number)
        if name := _match_name(what, facts.units):
            return Until(f"{number} {name}", "count", number, name)
    raise CallRejected("wrong_arguments", f"'{words}' is no end of a standing order: {_FORMS}.")


def _match_name(words: str, known: Iterable[str]) -> str | None:
    """Return the known name that some words mean, in any spelling and also in the plural."""
    names = {squash(name): name for name in known}
    plain = squash(words)
    return names.get(plain) or names.get(plain.removesuffix("s"))


def _number_of(name: str, snapshot: Snapshot) -> int:
    """Return how many units of a type the side has, with those in production and those that are about to be built."""
    kinds = snapshot.facts.stand_ins(name)
    there = sum(unit.name in kinds for unit in snapshot.own)
    facts = snapshot.facts.units[name]
    if facts.structure:
        return there + sum(structure in kinds for structure, _ in land_of(snapshot).plans)
    if facts.worker:  # some are inside a gas structure, where nobody sees them
        there = max(there, snapshot.player.food_workers)
    return there + sum(_coming(name, unit, snapshot.facts) for unit in snapshot.own)


def _coming(name: str, unit: Unit, of_map: MapFacts) -> int:
    found = (of_map.abilities.get(order.ability_id) for order in unit.orders)
    return sum(facts.count for facts in found if facts and facts.does in ("train", "morph") and facts.produces == name)
