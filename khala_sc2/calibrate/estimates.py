"""What the simulator only guesses, and which probe would settle each guess.

The simulator's data names the probes: `simulator/khala_simulator/data/mechanics.yaml` beside each constant,
`simulator/khala_simulator/data/probes.yaml` for all else. Above:
`report`, `commands`, and the page of the probes.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from khala_simulator.abilities.registry import SKILLS
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.loader import read_data
from khala_simulator.tables.mechanics import entries
from khala_simulator.tables.versions import VERSION_OF_BUILD

if TYPE_CHECKING:
    from collections.abc import Iterator

NONE: Final = "none: "
"""Before the reason why no probe settles an estimate."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """One guess."""

    where: str
    """Constant, weapon, ability or file."""
    what: str
    probe: str
    """Id of the probe that would settle it; "" if none can."""
    because: str = ""
    """Why none can."""


@functools.cache
def estimates() -> tuple[Estimate, ...]:
    """Return every estimate of the simulator but those of single maps.

    Raises:
        KeyError: one has neither a probe nor a reason in the tables.
    """
    table: dict[str, Any] = read_data("probes.yaml")
    return (*_constants(), *_weapons(table), *_creep(table), *_abilities(table), *_opponents(table))


def of_maps() -> str:
    """Return why no probe settles what is estimated of single maps."""
    return str(read_data("probes.yaml")["maps"]).removeprefix(NONE)


def _estimate(where: str, what: str, said: str) -> Estimate:
    if said.startswith(NONE):
        return Estimate(where, what, "", said.removeprefix(NONE))
    return Estimate(where, what, said)


def _constants() -> Iterator[Estimate]:
    for entry in entries():
        if entry.source == "estimate":
            yield _estimate(entry.name, entry.note, entry.probe)


def _weapons(table: dict[str, Any]) -> Iterator[Estimate]:
    found = {
        (weapon.id, field): None
        for version in VERSION_OF_BUILD.values()
        for weapon in load_catalog(version).weapons
        for field in weapon.estimates
    }
    for weapon, field in found:
        yield _estimate(f"weapon {weapon}", field, table["weapons"][field])


def _creep(table: dict[str, Any]) -> Iterator[Estimate]:
    rows = (row for version in VERSION_OF_BUILD.values() for row in read_data("tables", version, "creep.json")["rows"])
    for unit, field in {(row["unit"], field): None for row in rows for field in row.get("estimates", ())}:
        yield _estimate(f"creep of {unit}", field, table["creep"][field])


def _abilities(table: dict[str, Any]) -> Iterator[Estimate]:
    for effect, skill in sorted(SKILLS.items()):
        for sentence in skill.estimates:
            yield _estimate(f"ability {effect}", sentence, table["abilities"][effect][sentence])


def _opponents(table: dict[str, Any]) -> Iterator[Estimate]:
    for file, said in table["opponents"].items():
        yield _estimate(f"opponents/{file}", "all numbers", said)
