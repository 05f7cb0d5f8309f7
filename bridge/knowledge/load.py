"""What is known of the game, read once: the facts of a version, merged with the words about them.

Facts are generated (`khala knowledge write`) into `bridge/data/knowledge/<version>/*.json`, words are written by hand
in `bridge/data/knowledge/words/*.yaml`. Nothing is read before it is asked for.
"""

from __future__ import annotations

import functools
import json
from typing import Any, Final, TypeVar

from pydantic import TypeAdapter

from bridge import data
from bridge.knowledge.model import AbilityFacts, UnitType, UpgradeFacts
from protocol.messages import Frozen

M = TypeVar("M", bound=Frozen)

VERSION: Final = "4.10"
"""Version whose facts are told: the one that PySC2's ids belong to."""
VERSIONS: Final = (VERSION, "5.0.13")
RACES: Final = ("protoss", "terran", "zerg")


def knowledge(version: str = VERSION) -> dict[str, UnitType]:
    """Every known unit type by the name that PySC2 gives it, resources and obstacles too, in alphabetical order."""
    return _units(version)


def abilities(version: str = VERSION) -> dict[int, AbilityFacts]:
    """Every known ability by its id, special and general ones, in the order of their ids."""
    return _abilities(version)


def upgrades(version: str = VERSION) -> dict[str, UpgradeFacts]:
    """Every known upgrade by the name that PySC2 gives it, in alphabetical order."""
    return _upgrades(version)


def ability_of(number: int, unit_type: str, version: str = VERSION) -> AbilityFacts | None:
    """What an ability, special or general, is for units of one type; None if they do not have it.

    `ability_of(EFFECT_STIM, "Marine")` is what Stim is to a Marine, and so is the special ability's own number.
    """
    facts = abilities(version).get(number)
    if facts is None:
        return None
    found = (abilities(version)[special] for special in facts.special)
    return next((case for case in (*found, facts) if not case.special and unit_type in case.users), None)


@functools.cache
def stand_ins(name: str, version: str = VERSION) -> frozenset[str]:
    """Types with which a requirement of this structure is met: itself, and what counts as it (a Hive as a Lair)."""
    return frozenset({name, *(kind.name for kind in knowledge(version).values() if name in kind.counts_as)})


def is_armed(unit_type: str) -> bool:
    """Whether a type has a weapon; a type that is not known is taken to have one."""
    known = knowledge().get(unit_type)
    return known is None or bool(known.weapons)


@functools.cache
def _units(version: str) -> dict[str, UnitType]:
    words = {name: said for race in RACES for name, said in _words(race).items()}
    return _records(UnitType, {n: _unit(n, raw, words.get(n, {})) for n, raw in _facts(version, "units").items()})


def _unit(name: str, raw: dict[str, Any], words: dict[str, Any]) -> dict[str, Any]:
    return {"name": name, **raw, "ability_ids": raw.get("abilities", ()), "abilities": {}, **words}


@functools.cache
def _abilities(version: str) -> dict[int, AbilityFacts]:
    facts = {number: _ability(int(number), raw) for number, raw in _facts(version, "abilities").items()}
    return {int(number): record for number, record in _records(AbilityFacts, facts).items()}


def _ability(number: int, raw: dict[str, Any]) -> dict[str, Any]:
    everywhere = raw.pop("everywhere", False)
    return {"id": number, **raw, **({"range": None} if everywhere else {})}


@functools.cache
def _upgrades(version: str) -> dict[str, UpgradeFacts]:
    return _records(UpgradeFacts, {name: {"name": name, **raw} for name, raw in _facts(version, "upgrades").items()})


def _records(model: type[M], raw: dict[str, Any]) -> dict[str, M]:
    return TypeAdapter(dict[str, model]).validate_python(raw)  # type: ignore[valid-type]  # a type known at run time


def _facts(version: str, kind: str) -> dict[str, dict[str, Any]]:
    path = data.path("knowledge") / version / f"{kind}.json"
    entries: dict[str, dict[str, Any]] = json.loads(path.read_bytes())["entries"]
    return entries


def _words(name: str) -> dict[str, dict[str, Any]]:
    words: dict[str, dict[str, Any]] = data.document(f"knowledge/words/{name}.yaml")
    return words
