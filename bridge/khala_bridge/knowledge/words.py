"""Fill numbers into sentences: the words about a type, an ability or an upgrade get theirs from its facts.

No number is typed twice. Names in braces are looked up when the words are read:

    {range}  {damage}  {duration_s}      a fact or a figure of the record itself
    {AutoTurret.health}                  a fact of a unit type
    {1042.figures.max}                   of an ability
    {buff.Slow.speed%}                   of a buff
    {changes.Zergling.speed}             further down in a record
    {searches*search_period_s}           a product
    {move_speed_multiplier%}             as a percentage
    {cost} {needs} {makes} {research}    in words, see `_IN_WORDS`

It reads no file, and does not know what a sentence is for.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, Final

from khala_bridge.errors import CatalogueError
from khala_bridge.knowledge.model import AbilityFacts

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from khala_bridge.knowledge.model import BuffFacts, UnitFacts, UpgradeFacts

PLACEHOLDER: Final = re.compile(r"\{(-?)([\w.*]+)(%?)\}")


class Filler:
    """Fills in the facts of one version of the game."""

    def __init__(
        self, units: Mapping[str, UnitFacts], abilities: Mapping[int, AbilityFacts], buffs: Mapping[str, BuffFacts]
    ) -> None:
        self._units = units
        self._abilities = abilities
        self._buffs = buffs

    def fill(self, text: str, record: UnitFacts | AbilityFacts | UpgradeFacts) -> str:
        """Return the text with every placeholder replaced.

        Raises:
            CatalogueError: a placeholder names a missing fact; the text names both.
        """

        def found(match: re.Match[str]) -> str:
            sign, names, percent = match.groups()
            if isinstance(record, AbilityFacts) and names in _IN_WORDS:
                return _IN_WORDS[names](record)
            try:
                value = math.prod(self._value(name, record) for name in names.split("*"))
            except (LookupError, AttributeError, TypeError, ValueError) as error:
                raise CatalogueError(f"the words about {record.name} speak of {match.group()}: no such fact") from error
            return round_number((-value if sign else value) * (100 if percent else 1)) + percent

        return " ".join(PLACEHOLDER.sub(found, text).split())

    def _value(self, path: str, record: Any) -> float:
        first, *rest = path.split(".")
        if first.isdigit():
            value: Any = self._abilities[int(first)]
        elif first in self._units:
            value = self._units[first]
        elif first == "buff":
            value = self._buffs
        elif isinstance(record, AbilityFacts) and first in record.figures:
            value = record.figures[first]
        else:
            value = getattr(record, first)
        for name in rest:
            value = _part(value, name)
        return float(value)


def number(value: float) -> str:
    """Return a number without needless digits: 12, 12.5."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def round_number(value: float) -> str:
    """Return a number with three digits, as people say it: 10.7 for 10.71, and 1440."""
    return number(value) if value == int(value) else number(float(f"{value:.3g}"))


def join_names(names: tuple[str, ...]) -> str:
    """Return names as a list in words: `A`, `A and B`, `A, B and C`."""
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)


def price(minerals: float, vespene: float, supply: float = 0) -> str:
    """Return a price in words: `125 minerals, 50 vespene, 2 supply`, or `nothing`."""
    parts = ((minerals, "minerals"), (vespene, "vespene"), (supply, "supply"))
    return ", ".join(f"{number(amount)} {what}" for amount, what in parts if amount) or "nothing"


def _part(value: Any, name: str) -> Any:
    if name.isdigit():
        return value[int(name)]
    return value[name] if isinstance(value, dict) else getattr(value, name)


def _cost(ability: AbilityFacts) -> str:
    return price(ability.minerals, ability.vespene, ability.supply)


def _needs(ability: AbilityFacts) -> str:
    needed = join_names((*ability.requires, *((f"a {ability.addon} of its own",) if ability.addon else ())))
    return f"; needs {needed}" if needed else ""


def _makes(ability: AbilityFacts) -> str:
    product = str(ability.produces)
    return f"{ability.count} {product}s" if ability.count > 1 else _with_article(product)


def _with_article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOU' or name == 'SCV' else 'a'} {name}"


def _illusion(ability: AbilityFacts) -> str:
    kind = ability.name.rpartition("_")[2]
    return f"{ability.count} {kind} illusions" if ability.count > 1 else f"one {kind} illusion"


_IN_WORDS: Final[dict[str, Callable[[AbilityFacts], str]]] = {
    "cost": _cost,
    "needs": _needs,
    "makes": _makes,
    "illusion": _illusion,
    "research": lambda ability: str(ability.researches),
}
