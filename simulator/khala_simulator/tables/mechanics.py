"""Constants of the rules that belong to no unit, with their sources.

``data/mechanics.yaml`` holds every one with its unit, its source and, where the source is an estimate, the reasoning.
The rules read ``MECHANICS``; a table of estimates reads ``entries``.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Final, Literal

from khala_simulator.tables.loader import read_data


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant of the data file."""

    name: str
    value: float | str | bool
    unit: str
    source: Literal["catalog", "replay", "estimate"]
    note: str
    probe: str = ""
    """Of an estimate: the probe of `khala calibrate` that would settle it."""


@dataclass(frozen=True, slots=True)
class Mechanics:
    """The numbers, by name; units and sources are in the data file."""

    damage_min: float
    leash_radius: float
    help_radius: float
    help_period: int
    scan_period: int
    leash_reset: float
    scan_margin: float
    guard_margin: float
    flee_distance: float
    switch_blocked: int
    guard_slack: float
    arrival_radius: float
    path_period: int
    body_clearance: float
    chase_slack: float
    push_rounds: int
    push_limit: float
    push_firm: float
    push_idle: float
    push_ranged: float
    push_melee: float
    push_ahead: float
    flyer_drift: float
    flyer_drift_limit: float
    blocked_share: float
    detour_after: int
    detour_period: int
    detour_loops: int
    detour_look: float
    flank_period: int
    flank_look: float
    flank_reach: float
    flank_squeeze: float
    crowd_share: float
    crowd_near: float
    crowd_patience: int
    crowd_stall: int
    vision_period: int
    bunker_range: float
    high_ground_step: float
    building_sight: float
    harvest_gap: float
    harvest_search: float
    harvest_leaving: float
    harvest_handover: int
    creep_cells_per_step: int
    creep_decay_loops: float
    off_creep_damage: float
    emp_speed_n: float
    yamato_speed_n: float
    mine_missile_speed_n: float
    matrix_speed_n: float
    shredder_speed_n: float
    knockback_loops: int
    larvae_natural: int
    larva_limit: int
    larva_loops: int
    injected_larva_loops: float
    larva_rest_loops: int
    larva_step: float
    larva_leash: float
    larva_home: float
    broodling_random_loops: float
    swoop_speed_n: float
    tumor_throw_speed: float


def entries() -> tuple[Constant, ...]:
    """Return all constants of the data file, in its order; some are choices of a rule and have no number."""
    raw: dict[str, dict[str, Any]] = read_data("mechanics.yaml")
    return tuple(Constant(name=name, **fields) for name, fields in raw.items())


def _load() -> Mechanics:
    values: dict[str, Any] = {entry.name: entry.value for entry in entries()}
    return Mechanics(**{field.name: values[field.name] for field in dataclasses.fields(Mechanics)})


MECHANICS: Final = _load()
