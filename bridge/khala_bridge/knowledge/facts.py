"""The generated facts of a version of the game: `bridge/khala_bridge/data/knowledge/<version>/*.json`.

`khala knowledge write` makes the files from the simulator's tables. They hold no words: `load` adds these. Each file
is read on its first use.
"""

from __future__ import annotations

import functools
import json
from typing import Any, Final, TypeVar

from pydantic import TypeAdapter

from khala_bridge import data
from khala_bridge.knowledge.model import AbilityFacts, BuffFacts, UnitFacts, UpgradeFacts
from khala_protocol.messages import Frozen

M = TypeVar("M", bound=Frozen)

VERSION: Final = "4.10"
"""Version of the facts: the one that PySC2's ids belong to."""
VERSIONS: Final = (VERSION, "5.0.13")


@functools.cache
def unit_facts(version: str) -> dict[str, UnitFacts]:
    """Return unit types by name."""
    return _records(UnitFacts, {name: {"name": name, **raw} for name, raw in _entries(version, "units").items()})


@functools.cache
def ability_facts(version: str) -> dict[int, AbilityFacts]:
    """Return abilities by id."""
    raw = {number: _ability(int(number), own) for number, own in _entries(version, "abilities").items()}
    return {int(number): record for number, record in _records(AbilityFacts, raw).items()}


@functools.cache
def upgrade_facts(version: str) -> dict[str, UpgradeFacts]:
    """Return upgrades by name."""
    return _records(UpgradeFacts, {name: {"name": name, **raw} for name, raw in _entries(version, "upgrades").items()})


@functools.cache
def buff_facts(version: str) -> dict[str, BuffFacts]:
    """Return buffs by name."""
    return _records(BuffFacts, {name: {"name": name, **raw} for name, raw in _entries(version, "buffs").items()})


def _ability(number: int, raw: dict[str, Any]) -> dict[str, Any]:
    everywhere = raw.pop("everywhere", False)
    return {"id": number, **raw, **({"range": None} if everywhere else {})}


def _records(model: type[M], raw: dict[str, Any]) -> dict[str, M]:
    return TypeAdapter(dict[str, model]).validate_python(raw)  # type: ignore[valid-type]  # a type known at run time


def _entries(version: str, kind: str) -> dict[str, dict[str, Any]]:
    path = data.path("knowledge") / version / f"{kind}.json"
    entries: dict[str, dict[str, Any]] = json.loads(path.read_bytes())["entries"]
    return entries
