"""Load the knowledge of the game: the facts of a version, merged with the words about them, once on the first use.

People write the words in `bridge/khala_bridge/data/knowledge/words/*.yaml`; their numbers are filled in here. Above:
every module that describes the game. Below: `facts`, which reads the generated files, and `words`, which fills in
numbers.
"""

from __future__ import annotations

import functools
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from pydantic import Field

from khala_bridge import data
from khala_bridge.knowledge.facts import VERSION, ability_facts, buff_facts, unit_facts, upgrade_facts
from khala_bridge.knowledge.words import Filler
from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.knowledge.model import AbilityFacts, BuffFacts, Race, UnitFacts, UpgradeFacts

RACES: Final = ("protoss", "terran", "zerg")
WORKERS: Final = frozenset({"Probe", "SCV", "Drone", "MULE"})
"""Types that gather, as they are when they do."""


def knowledge(version: str = VERSION) -> dict[str, UnitFacts]:
    """Return every known unit type by PySC2's name, resources and obstacles too, in alphabetical order."""
    return _units(version)


def abilities(version: str = VERSION) -> dict[int, AbilityFacts]:
    """Return every known ability by its id, special and general ones, in the order of ids."""
    return _abilities(version)


def upgrades(version: str = VERSION) -> dict[str, UpgradeFacts]:
    """Return every known upgrade by PySC2's name, in alphabetical order."""
    return _upgrades(version)


def buffs(version: str = VERSION) -> dict[str, BuffFacts]:
    """Return every buff that has an effect or that observations show, by name, in alphabetical order."""
    return buff_facts(version)


def race_of(name: str) -> Race | None:
    """Return the race of a unit type, on every map; None if the name is of an upgrade, or of nothing known."""
    known = unit_facts(VERSION).get(name)
    return known.race if known else None


@functools.cache
def is_structure(unit_type: str) -> bool:
    """Return True if a type is a structure, on every map; unknown types are not."""
    known = unit_facts(VERSION).get(unit_type)
    return known is not None and known.structure


@functools.cache
def is_worker(unit_type: str) -> bool:
    """Return True if a type of unit gathers, on every map; unknown types do not."""
    known = unit_facts(VERSION).get(unit_type)
    return known is not None and known.worker


# --- words ----------------------------------------------------------------------------------------------------


class UnitWords(Frozen):
    """The words about one unit type, or about several similar ones."""

    types: tuple[str, ...] = ()
    """Types that the words are about; () for the type of the entry's name."""
    about: str
    uses: str = ""
    beats: tuple[str, ...] = ()
    """Types that it counters; the other direction is derived."""
    traits: dict[str, str] = Field(default_factory=dict)
    """What it does without orders, a title and a sentence each."""


class AbilityWords(Frozen):
    """The words about one ability."""

    title: str = ""
    """Short name in the list of a unit's own abilities; '' for what players do not see as an ability."""
    about: str


@functools.cache
def unit_words() -> dict[str, UnitWords]:
    """Return the words about unit types, by name."""
    files = [f"knowledge/words/{race}.yaml" for race in (*RACES, "neutral")]
    entries = [entry for file in files for entry in data.table(file, UnitWords).items()]
    return {name: words for heading, words in entries for name in words.types or (heading,)}


@functools.cache
def ability_words() -> dict[str, AbilityWords]:
    """Return the words about abilities: by name, or by kind in angle brackets."""
    return data.table("knowledge/words/abilities.yaml", AbilityWords)


@functools.cache
def upgrade_words() -> dict[str, str]:
    """Return the words about upgrades, by name; a star stands for any ending."""
    written: dict[str, str] = data.document("knowledge/words/upgrades.yaml")
    return written


def words_of(ability: AbilityFacts) -> AbilityWords | None:
    """Return the words about an ability by its name, or else about its kind."""
    return ability_words().get(ability.name) or ability_words().get(f"<{ability.does}>")


# --- both -----------------------------------------------------------------------------------------------------


@functools.cache
def _filler(version: str) -> Filler:
    return Filler(unit_facts(version), ability_facts(version), buff_facts(version))


@functools.cache
def _units(version: str) -> dict[str, UnitFacts]:
    beaten_by = _beaten_by()
    return {name: _describe_unit(kind, beaten_by.get(name, ()), version) for name, kind in unit_facts(version).items()}


def _beaten_by() -> dict[str, tuple[str, ...]]:
    """Return the types that counter each type, by name; first those that name it first among the types they counter."""
    found: dict[str, list[tuple[int, str]]] = {}
    for name, words in unit_words().items():
        for rank, other in enumerate(words.beats):
            found.setdefault(other, []).append((rank, name))
    return {other: tuple(name for _, name in sorted(names)) for other, names in found.items()}


def _describe_unit(kind: UnitFacts, beaten_by: tuple[str, ...], version: str) -> UnitFacts:
    words = unit_words()[kind.name]
    filler = _filler(version)
    told = {
        "allows": _allowed_by(version).get(kind.name, ()),
        "about": filler.fill(words.about, kind),
        "uses": filler.fill(words.uses, kind),
        "counters": words.beats,
        "countered_by": beaten_by,
        "abilities": describe_abilities(kind, version=version),
    }
    return kind.model_copy(update=told)


@functools.cache
def _allowed_by(version: str) -> dict[str, tuple[str, ...]]:
    """Return the types and upgrades of melee games that require a structure, by its name."""
    kinds, better = unit_facts(version).values(), upgrade_facts(version).values()
    required = [(kind.name, kind.requires) for kind in kinds if kind.melee]
    required += [(upgrade.name, upgrade.requires) for upgrade in better if upgrade.melee]
    found: dict[str, list[str]] = {}
    for name, needs in required:
        for needed in needs:
            found.setdefault(needed, []).append(name)
    return {name: tuple(allowed) for name, allowed in found.items()}


def describe_abilities(
    kind: UnitFacts, researched: frozenset[str] = frozenset(), *, version: str = VERSION
) -> dict[str, str]:
    """Return what a type can do as titles and sentences, which name no upgrade as needed that is `researched`."""
    traits = unit_words()[kind.name].traits
    told = {title: _filler(version).fill(said, kind) for title, said in traits.items()}
    return told | dict(_titles(kind, researched, version))


def _titles(kind: UnitFacts, researched: frozenset[str], version: str) -> Iterator[tuple[str, str]]:
    """Yield the abilities of a type that have a title, with the words about them."""
    for number in kind.ability_ids:
        if (ability := abilities(version).get(number)) and (words := words_of(ability)) and words.title:
            needed = tuple(name for name in ability.requires if name not in researched)
            yield words.title, _describe_ability(ability.model_copy(update={"requires": needed}), version).about


@functools.cache
def _abilities(version: str) -> dict[int, AbilityFacts]:
    return {number: _describe_ability(ability, version) for number, ability in ability_facts(version).items()}


def _describe_ability(ability: AbilityFacts, version: str) -> AbilityFacts:
    words = words_of(ability) if ability.melee else None
    return ability.model_copy(update={"about": _filler(version).fill(words.about, ability)}) if words else ability


@functools.cache
def _upgrades(version: str) -> dict[str, UpgradeFacts]:
    return {name: _describe_upgrade(upgrade, version) for name, upgrade in upgrade_facts(version).items()}


def _describe_upgrade(upgrade: UpgradeFacts, version: str) -> UpgradeFacts:
    said = next((said for name, said in upgrade_words().items() if fnmatchcase(upgrade.name, name)), "")
    return upgrade.model_copy(update={"about": _filler(version).fill(said, upgrade)})
