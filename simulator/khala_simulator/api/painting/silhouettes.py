"""What unit types look like: outlines and short codes.

An outline is half a polygon, from the nose at (x, 0) over the left side to the tail, in radii of the unit: x is
forward, y to the left; the right side mirrors it. Types without an outline of their own have that of their class, so
that every type of the tables can be drawn. The shapes follow what the units are, not the game's pictures.
"""

from __future__ import annotations

import enum
import functools
import math
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.records import UnitType

Points = tuple[tuple[float, float], ...]


class Class(enum.Enum):
    """What a unit is at a glance."""

    WORKER = enum.auto()
    MELEE = enum.auto()
    RANGED = enum.auto()
    UNARMED = enum.auto()
    MASSIVE = enum.auto()
    FLYER = enum.auto()
    CAPITAL = enum.auto()
    CARRIER = enum.auto()
    CRITTER = enum.auto()
    STRUCTURE = enum.auto()
    MINERALS = enum.auto()
    GEYSER = enum.auto()
    ROCKS = enum.auto()
    BARRIER = enum.auto()


def _ring(count: int, radii: tuple[float, ...] = (1.0,), turn: float = 0.0) -> Points:
    """Return half of a star or a regular polygon of `count` corners with these radii in turn."""
    corners = ((math.pi * 2 * k / count + turn, radii[k % len(radii)]) for k in range(count // 2 + 1))
    return tuple((r * math.cos(a), r * math.sin(a)) for a, r in corners)


DISC: Points = _ring(24)
OF_CLASS: dict[Class, Points] = {
    Class.WORKER: ((0.35, 0), (0.95, 0.3), (0.9, 0.62), (0.1, 0.9), (-0.7, 0.7), (-0.9, 0)),
    Class.MELEE: ((0.7, 0), (0.5, 0.35), (1.15, 0.6), (0.3, 0.95), (-0.6, 0.75), (-0.85, 0)),
    Class.RANGED: ((1.3, 0), (1.3, 0.2), (0.8, 0.22), (0.5, 0.75), (-0.3, 0.95), (-0.85, 0.5), (-0.9, 0)),
    Class.UNARMED: ((1.0, 0), (0.2, 0.85), (-1.0, 0)),
    Class.MASSIVE: _ring(8, turn=0.0),
    Class.FLYER: ((1.15, 0), (-0.1, 0.4), (-0.8, 1.0), (-0.5, 0)),
    Class.CAPITAL: ((1.15, 0), (0.6, 0.35), (0.2, 0.9), (-0.6, 0.95), (-1.0, 0.4), (-0.85, 0)),
    Class.CARRIER: ((0.95, 0), (0.75, 0.55), (-0.5, 0.75), (-0.95, 0.5), (-0.95, 0)),
    Class.CRITTER: ((0.9, 0), (0.4, 0.6), (-0.5, 0.6), (-0.9, 0)),
    Class.STRUCTURE: ((0.85, 0), (0.85, 0.6), (0.6, 0.85), (-0.6, 0.85), (-0.85, 0.6), (-0.85, 0)),
    Class.MINERALS: ((1.15, 0), (0.75, 0.3), (0.2, 0.75), (-0.1, 0.4), (-0.6, 0.8), (-0.75, 0.35), (-1.2, 0)),
    Class.GEYSER: _ring(10),
    Class.ROCKS: _ring(9, (1.0, 0.82, 1.05)),
    Class.BARRIER: DISC,
}
STRUCTURES: dict[str, Points] = {
    "protoss": ((0.98, 0), (0.7, 0.7), (0, 0.98), (-0.7, 0.7), (-0.98, 0)),
    "terran": OF_CLASS[Class.STRUCTURE],
    "zerg": _ring(12, (0.98, 0.8)),
}

OUTLINES: dict[str, Points] = {
    # protoss
    "Zealot": ((0.55, 0), (0.5, 0.32), (1.3, 0.72), (0.4, 1.0), (-0.45, 0.85), (-0.8, 0.35), (-0.75, 0)),
    "Stalker": ((0.85, 0), (0.6, 0.35), (1.15, 0.95), (0.35, 0.7), (-0.3, 0.65), (-1.1, 1.05), (-0.7, 0.4), (-0.95, 0)),
    "Sentry": ((0.95, 0), (0.5, 0.45), (0.25, 1.1), (-0.1, 0.6), (-0.6, 0.55), (-1.0, 0)),
    "Adept": ((1.25, 0), (0.45, 0.35), (0.0, 1.0), (-0.45, 0.55), (-1.0, 0)),
    "HighTemplar": ((0.95, 0), (0.55, 0.6), (0.0, 0.7), (-1.0, 1.05), (-0.75, 0)),
    "DarkTemplar": ((0.4, 0), (1.5, 0.5), (0.2, 0.9), (-1.0, 0.75), (-0.7, 0)),
    "Archon": _ring(16, (1.15, 0.8)),
    "Immortal": ((0.65, 0), (0.65, 0.35), (1.25, 0.38), (1.25, 0.78), (0.1, 1.05), (-0.85, 0.95), (-0.95, 0)),
    "Colossus": (
        (0.95, 0), (0.75, 0.3), (0.45, 0.45), (1.05, 1.2), (0.2, 0.62), (-0.2, 0.62), (-1.05, 1.2), (-0.5, 0.45),
        (-0.7, 0),
    ),
    "Disruptor": _ring(12, (1.0, 0.86)),
    "DisruptorPhased": DISC,
    "Observer": ((0.9, 0), (0.45, 0.5), (-0.1, 1.1), (-0.35, 0.5), (-0.8, 0)),
    "WarpPrism": ((1.15, 0), (0.15, 0.5), (0.0, 1.0), (-0.3, 0.5), (-1.0, 0)),
    "Phoenix": ((1.2, 0), (0.35, 0.3), (0.5, 1.1), (-0.55, 0.75), (-0.45, 0.25), (-1.0, 0)),
    "VoidRay": ((0.5, 0), (0.45, 0.3), (1.2, 0.5), (0.3, 0.85), (-0.7, 0.6), (-1.05, 0)),
    "Oracle": ((0.35, 0), (1.15, 0.55), (0.35, 1.0), (-0.4, 0.65), (-0.95, 0)),
    "Tempest": ((1.0, 0), (0.35, 0.3), (0.95, 1.1), (-0.35, 0.75), (-1.15, 0.35), (-0.9, 0)),
    "Carrier": ((1.2, 0), (0.9, 0.5), (0.1, 0.85), (-0.9, 0.7), (-1.1, 0.3), (-0.8, 0)),
    "Mothership": ((0.75, 0), (1.0, 0.55), (0.4, 1.0), (-0.5, 0.95), (-1.05, 0.4), (-0.7, 0)),
    "Interceptor": ((1.3, 0), (-0.9, 0.9), (-0.5, 0)),
    # terran
    "Marine": ((1.35, 0), (1.35, 0.22), (0.75, 0.25), (0.6, 0.6), (0.1, 1.0), (-0.55, 0.85), (-0.8, 0)),
    "Marauder": ((0.6, 0), (0.65, 0.3), (1.2, 0.45), (1.15, 0.95), (0.1, 1.1), (-0.75, 0.8), (-0.9, 0)),
    "Reaper": ((0.9, 0), (0.55, 0.35), (1.15, 0.6), (0.3, 0.8), (-0.4, 0.5), (-1.15, 0.75), (-0.75, 0)),
    "Ghost": ((1.55, 0), (1.5, 0.13), (0.65, 0.2), (0.35, 0.65), (-0.5, 0.8), (-0.9, 0)),
    "Hellion": ((1.1, 0), (1.05, 0.3), (0.6, 0.75), (0.2, 0.75), (0.1, 0.5), (-0.5, 0.6), (-0.9, 0.85), (-1.1, 0)),
    "HellionTank": ((0.7, 0), (0.7, 0.4), (1.2, 0.5), (1.1, 0.9), (-0.3, 1.0), (-0.8, 0.6), (-0.85, 0)),
    "WidowMine": _ring(6, turn=math.pi / 6),
    "Cyclone": ((1.2, 0), (1.2, 0.35), (0.5, 0.4), (0.6, 0.9), (-0.8, 0.95), (-0.95, 0)),
    "SiegeTank": ((1.5, 0), (1.5, 0.16), (0.7, 0.2), (0.85, 0.85), (-0.9, 0.85), (-0.95, 0)),
    "SiegeTankSieged": ((1.75, 0), (1.75, 0.2), (0.6, 0.28), (0.95, 1.15), (0, 0.8), (-1.05, 1.15), (-0.9, 0)),
    "Thor": ((0.7, 0), (0.75, 0.4), (1.3, 0.55), (1.25, 0.95), (0.3, 1.15), (-0.85, 0.95), (-1.0, 0)),
    "VikingFighter": ((1.1, 0), (0.4, 0.3), (0.7, 0.75), (0.2, 1.15), (-0.6, 0.9), (-0.6, 0.35), (-1.0, 0)),
    "VikingAssault": ((0.5, 0), (0.55, 0.35), (1.2, 0.5), (1.1, 0.85), (-0.1, 1.05), (-0.85, 0.55), (-0.9, 0)),
    "Medivac": ((1.15, 0), (0.7, 0.4), (0.3, 0.5), (0.35, 1.0), (-0.45, 1.0), (-0.4, 0.5), (-1.05, 0.4), (-1.0, 0)),
    "Banshee": ((1.1, 0), (0.5, 0.3), (0.6, 1.05), (-0.25, 1.05), (-0.3, 0.3), (-1.15, 0.25), (-1.1, 0)),
    "Liberator": ((0.8, 0), (0.35, 0.35), (1.05, 0.8), (0.1, 1.15), (-0.8, 0.7), (-0.85, 0)),
    "Raven": ((0.85, 0), (0.4, 0.35), (0.2, 1.2), (-0.35, 0.95), (-0.5, 0.35), (-1.0, 0)),
    "Battlecruiser": ((1.35, 0), (1.3, 0.45), (0.7, 0.5), (0.45, 0.3), (-0.3, 0.4), (-0.5, 0.9), (-1.1, 0.8), (-1, 0)),
    # zerg
    "Zergling": ((0.7, 0), (1.3, 0.55), (0.45, 0.6), (0.1, 1.1), (-0.35, 0.6), (-1.1, 0.35), (-0.9, 0)),
    "Baneling": _ring(14, (1.05, 0.85)),
    "Roach": ((1.0, 0), (0.8, 0.55), (0.35, 0.75), (0.2, 1.15), (-0.2, 0.85), (-0.8, 0.85), (-1.0, 0)),
    "Ravager": ((0.75, 0), (1.2, 0.4), (0.6, 0.7), (0.2, 1.15), (-0.3, 0.9), (-1.05, 0.9), (-0.9, 0)),
    "Hydralisk": ((1.1, 0), (0.75, 0.35), (1.0, 0.85), (0.3, 0.6), (-0.2, 0.7), (-1.25, 0.2), (-1.3, 0)),
    "LurkerMP": ((0.9, 0), (0.6, 0.45), (0.9, 1.05), (0.1, 0.7), (-0.3, 1.15), (-0.8, 0.6), (-1.0, 0)),
    "LurkerMPBurrowed": _ring(10, (1.1, 0.7)),
    "Infestor": ((1.0, 0), (0.7, 0.6), (0.1, 0.85), (-0.8, 0.6), (-1.25, 0.2), (-1.2, 0)),
    "SwarmHostMP": ((0.9, 0), (0.55, 0.6), (0.4, 1.05), (-0.1, 0.9), (-0.9, 1.0), (-1.0, 0)),
    "Ultralisk": ((0.7, 0), (0.8, 0.4), (1.4, 0.75), (0.6, 1.05), (-0.6, 0.95), (-1.0, 0.5), (-1.1, 0)),
    "Queen": ((0.95, 0), (0.5, 0.4), (0.95, 1.0), (0.15, 0.65), (-0.25, 1.1), (-0.55, 0.55), (-1.3, 0.3), (-1.2, 0)),
    "Mutalisk": ((0.8, 0), (0.35, 0.3), (0.75, 1.25), (-0.25, 0.8), (-0.4, 0.25), (-1.2, 0)),
    "Corruptor": ((0.95, 0), (0.75, 0.7), (-0.1, 0.9), (-1.1, 0.85), (-0.6, 0.4), (-1.15, 0)),
    "BroodLord": ((0.8, 0), (0.6, 0.5), (0.85, 1.25), (-0.1, 0.95), (-0.7, 0.9), (-1.15, 0.35), (-1.1, 0)),
    "Viper": ((1.1, 0), (0.5, 0.3), (0.2, 1.2), (-0.2, 0.4), (-1.3, 0.15), (-1.25, 0)),
    "Overlord": ((0.9, 0), (0.6, 0.75), (-0.3, 0.95), (-0.9, 0.6), (-1.0, 0)),
    "Overseer": ((1.05, 0), (0.65, 0.75), (0.0, 0.85), (-0.3, 1.15), (-0.9, 0.6), (-1.0, 0)),
    "LocustMP": ((1.0, 0), (0.5, 0.5), (0.6, 1.1), (-0.2, 0.7), (-0.9, 0.5), (-0.9, 0)),
    "Broodling": ((1.1, 0), (0.4, 0.5), (0.0, 1.1), (-0.5, 0.5), (-1.0, 0)),
}  # fmt: skip
"""Types with a look of their own."""

CODES: dict[str, str] = {
    "Probe": "PR", "Zealot": "ZE", "Stalker": "ST", "Sentry": "SE", "Adept": "AD", "HighTemplar": "HT",
    "DarkTemplar": "DT", "Archon": "AR", "Immortal": "IM", "Colossus": "CO", "Disruptor": "DI", "Observer": "OB",
    "WarpPrism": "WP", "Phoenix": "PX", "VoidRay": "VR", "Oracle": "OR", "Tempest": "TE", "Carrier": "CA",
    "Mothership": "MS", "MothershipCore": "MC", "Interceptor": "IN", "Nexus": "NX", "Pylon": "PY", "Gateway": "GW",
    "WarpGate": "WG", "Forge": "FO", "CyberneticsCore": "CY", "PhotonCannon": "PC", "ShieldBattery": "SB",
    "Assimilator": "AS", "TwilightCouncil": "TC", "TemplarArchive": "TA", "DarkShrine": "DS", "Stargate": "SG",
    "FleetBeacon": "FB", "RoboticsFacility": "RF", "RoboticsBay": "RB",
    "SCV": "SC", "MULE": "ML", "Marine": "MA", "Marauder": "MR", "Reaper": "RP", "Ghost": "GH", "Hellion": "HE",
    "HellionTank": "HB", "WidowMine": "WM", "Cyclone": "CC", "SiegeTank": "TK", "Thor": "TH", "ThorAP": "TH",
    "VikingFighter": "VI", "VikingAssault": "VI", "Medivac": "MV", "Liberator": "LI", "Raven": "RV",
    "Banshee": "BS", "Battlecruiser": "BC", "CommandCenter": "CMD", "OrbitalCommand": "ORB",
    "PlanetaryFortress": "PF", "SupplyDepot": "SD", "Barracks": "BK", "Bunker": "BU", "MissileTurret": "MT",
    "EngineeringBay": "EB", "Factory": "FA", "Starport": "SP", "Armory": "AY", "FusionCore": "FC",
    "GhostAcademy": "GA", "Refinery": "RE", "SensorTower": "TW", "AutoTurret": "AT",
    "Drone": "DR", "Zergling": "ZL", "Baneling": "BN", "Roach": "RO", "Ravager": "RG", "Hydralisk": "HY",
    "LurkerMP": "LU", "Infestor": "IF", "SwarmHostMP": "SH", "Ultralisk": "UL", "Queen": "QU", "Mutalisk": "MU",
    "Corruptor": "CR", "BroodLord": "BL", "Viper": "VP", "Overlord": "OV", "OverlordTransport": "OT",
    "Overseer": "OS", "Larva": "LV", "Egg": "EG", "Broodling": "BR", "LocustMP": "LO", "Hatchery": "HA",
    "Lair": "LA", "Hive": "HI", "SpawningPool": "PL", "SpineCrawler": "SPN", "SporeCrawler": "SPR",
    "Extractor": "EX", "EvolutionChamber": "EV", "RoachWarren": "RW", "BanelingNest": "NE", "HydraliskDen": "HD",
    "LurkerDenMP": "LD", "Spire": "SI", "GreaterSpire": "GS", "InfestationPit": "IP", "UltraliskCavern": "UC",
    "NydusNetwork": "NY", "NydusCanal": "NC", "CreepTumor": "CT",
}  # fmt: skip
"""Letters of the types that players know; others have those of their name."""

_FORMS = re.compile(r"(Burrowed|Uprooted|Flying|Lowered|Sieged|SiegeMode|Alternate|Rich|AG|Phasing|Phased|Queen|_RL)$")
_BARREN = frozenset({Class.MINERALS, Class.GEYSER, Class.ROCKS, Class.BARRIER})


_MARKS: dict[Class, Callable[[UnitType], bool]] = {
    Class.MINERALS: lambda unit: unit.resource == "minerals",
    Class.GEYSER: lambda unit: unit.resource == "vespene",
    Class.BARRIER: lambda unit: unit.name == "ForceField",
    Class.ROCKS: lambda unit: unit.race == "neutral" and (unit.structure or bool(unit.footprint)),
    Class.STRUCTURE: lambda unit: unit.structure,
    Class.WORKER: lambda unit: unit.worker,
    Class.CAPITAL: lambda unit: unit.flying and "massive" in unit.attributes,
    Class.MASSIVE: lambda unit: "massive" in unit.attributes,
    Class.CARRIER: lambda unit: unit.flying and not unit.weapons,
    Class.FLYER: lambda unit: unit.flying,
    Class.UNARMED: lambda unit: unit.army and not unit.weapons,
    Class.CRITTER: lambda unit: not unit.weapons,
    Class.MELEE: lambda unit: all(weapon.melee for weapon in unit.weapons),
    Class.RANGED: lambda _: True,
}
"""The test for each class; the first that holds decides."""


def class_of(unit: UnitType) -> Class:
    """Return the class of a unit type."""
    return next(kind for kind, holds in _MARKS.items() if holds(unit))


@functools.lru_cache(maxsize=1024)
def outline_of(unit: UnitType) -> Points:
    """Return half of the outline of this type."""
    for name in (unit.name, _FORMS.sub("", unit.name)):
        if name in OUTLINES:
            return OUTLINES[name]
    kind = class_of(unit)
    return STRUCTURES.get(unit.race, OF_CLASS[kind]) if kind is Class.STRUCTURE else OF_CLASS[kind]


@functools.lru_cache(maxsize=1024)
def code_of(unit: UnitType) -> str:
    """Return the two or three capitals of this type; none for objects on the ground."""
    if class_of(unit) in _BARREN:
        return ""
    for name in (unit.name, _FORMS.sub("", unit.name)):
        if name in CODES:
            return CODES[name]
    capitals = "".join(letter for letter in unit.name if letter.isupper())
    return capitals[:3] if len(capitals) > 1 else unit.name[:2].upper()
