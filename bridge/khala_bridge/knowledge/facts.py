"""The generated facts of a version of the game: `bridge/khala_bridge/data/knowledge/<version>/*.json`.

`khala knowledge write` makes the files from the simulator's tables. They hold no words: `load` adds these. Each file
is read on its first use.

The facts are those of the multiplayer's maps. A map that depends on other data has units with other numbers: the
version `4.10/void` has those of `units.void.json` in place of its own, and all else as `4.10`.
"""

from __future__ import annotations

import functools
import json
from typing import Any, Final, Literal, TypeAlias, TypeVar, get_args

from pydantic import TypeAdapter

from khala_bridge import data
from khala_bridge.knowledge.model import AbilityFacts, BuffFacts, UnitFacts, UpgradeFacts
from khala_protocol.messages import Frozen

M = TypeVar("M", bound=Frozen)

VERSION: Final = "4.10"
"""Version of the facts: the one that PySC2's ids belong to."""
VERSIONS: Final = (VERSION, "5.0.13")
DataSet: TypeAlias = Literal["multi", "liberty", "void"]
"""Data of the game that a map depends on: the multiplayer's, or those of the first or the last campaign."""
MULTI: Final = "multi"
DATA_SETS: Final[tuple[DataSet, ...]] = tuple(name for name in get_args(DataSet) if name != MULTI)
"""Those with files of their own."""


def version_of(data_set: DataSet) -> str:
    """Return the version of the facts that hold on a map with these data, `4.10/void`."""
    return VERSION if data_set == MULTI else f"{VERSION}/{data_set}"


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
    number, _, data_set = version.partition("/")
    entries = _read(number, f"{kind}.json")
    if data_set and kind == "units":
        entries |= _read(number, f"{kind}.{data_set}.json")
    return entries


def _read(version: str, file: str) -> dict[str, dict[str, Any]]:
    entries: dict[str, dict[str, Any]] = json.loads((data.path("knowledge") / version / file).read_bytes())["entries"]
    return entries
