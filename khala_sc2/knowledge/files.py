"""Write the facts of the game into the data of the bridge: `bridge/khala_bridge/data/knowledge/<version>/*.json`.

One record per line, in a fixed order, so that a change of the tables is a small diff.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from khala_bridge import data
from khala_bridge.knowledge.facts import DATA_SETS
from khala_protocol.files import MB, read_limited, write_together
from khala_sc2.knowledge.abilities import ability_facts
from khala_sc2.knowledge.buffs import buff_facts
from khala_sc2.knowledge.units import unit_facts
from khala_sc2.knowledge.upgrades import upgrade_facts
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from pathlib import Path


MOST_BYTES: Final = 4 * MB
"""Of a file of facts; the largest has 0.2 MB."""


def facts(version: str) -> dict[str, str]:
    """Return the text of every file of facts of a game version, by file name.

    Raises:
        CatalogError: the simulator has no tables of this version.
    """
    catalog = load_catalog(version)
    made = {
        "units": unit_facts(catalog),
        "abilities": ability_facts(catalog),
        "upgrades": upgrade_facts(catalog),
        "buffs": buff_facts(catalog),
    }
    for data_set in DATA_SETS:
        other = unit_facts(load_catalog(version, data_set))
        made[f"units.{data_set}"] = {name: kind for name, kind in other.items() if kind != made["units"][name]}
    return {f"{kind}.json": _text(catalog.version, catalog.build, records) for kind, records in made.items()}


def outdated_files(version: str) -> list[str]:
    """Return the names of the files of a version that differ from what would be written now."""
    where = directory(version)
    return [name for name, text in facts(version).items() if _bytes(where / name) != text.encode()]


def write(version: str) -> list[Path]:
    """Write the files of a version, all of them or none; return their paths."""
    where = directory(version)
    where.mkdir(parents=True, exist_ok=True)
    made = {where / name: text for name, text in facts(version).items()}
    write_together({path: text.encode() for path, text in made.items()})
    for path in made:
        path.chmod(0o644)  # no secret: a part of the package, which all of its users read
    return list(made)


def directory(version: str) -> Path:
    """Return the directory of the facts of a game version."""
    return data.path("knowledge") / version


def _bytes(path: Path) -> bytes | None:
    try:
        return read_limited(path, MOST_BYTES)
    except OSError:
        return None


def _text(version: str, build: int, records: dict[str, dict[str, Any]]) -> str:
    lines = [f"{json.dumps(name)}: {json.dumps(record)}" for name, record in records.items()]
    head = f'"version": {json.dumps(version)},\n"build": {build},\n"made_by": "khala knowledge write"'
    return "{\n" + head + ',\n"entries": {\n' + ",\n".join(lines) + "\n}\n}\n"
