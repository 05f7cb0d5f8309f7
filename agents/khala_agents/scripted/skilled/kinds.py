"""What a StarCraft II player knows of a unit by its name: reach, worth, pace. All numbers are rounded.

These are a player's rules of thumb, not the bridge's knowledge, which an observation may leave out. A type that is not
listed counts as a slow one that reaches 5.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.scripted.reading import TextUnit

Role = Literal["army", "worker", "structure", "support"]
NONE = -1.0
"""Range of a missing weapon."""


class Kind(NamedTuple):
    """A unit type; ranges in world units from edge to edge, damage and speed per second."""

    ground: float = 5.0
    """Range against the ground."""
    air: float = NONE
    damage: float = 10.0
    """Damage per second, or the worth of killing it."""
    speed: float = 2.5
    flying: bool = False
    role: Role = "army"
    structure: bool = False

    @property
    def reach(self) -> float:
        """The longest range."""
        return max(self.ground, self.air)

    def hits(self, other: Kind) -> bool:
        """Return whether its weapon can be aimed at another type."""
        return (self.air if other.flying else self.ground) >= 0

    @property
    def melee(self) -> bool:
        """Whether it has to touch its target."""
        return 0 <= self.ground < 2


_GROUND = {
    "Zealot": Kind(0.1, NONE, 18, 3.15),
    "Stalker": Kind(6, 6, 10, 4.13),
    "Sentry": Kind(5, 5, 8, 3.15),
    "Adept": Kind(4, NONE, 8, 3.5),
    "AdeptPhaseShift": Kind(NONE, NONE, 0, 3.5, role="support"),
    "HighTemplar": Kind(6, NONE, 40, 2.8),
    "DarkTemplar": Kind(0.1, NONE, 37, 3.9),
    "Archon": Kind(3, 3, 20, 3.9),
    "Immortal": Kind(6, NONE, 35, 3.15),
    "Colossus": Kind(7, NONE, 30, 3.15),
    "Disruptor": Kind(NONE, NONE, 40, 3.15),
    "Marine": Kind(5, 5, 10, 3.15),
    "Marauder": Kind(6, NONE, 12, 3.15),
    "Reaper": Kind(5, NONE, 10, 5.2),
    "Ghost": Kind(6, 6, 20, 3.9),
    "Hellion": Kind(5, NONE, 8, 5.9),
    "Hellbat": Kind(2, NONE, 13, 3.15),
    "WidowMine": Kind(NONE, NONE, 20, 3.9),
    "WidowMineBurrowed": Kind(5, 5, 60, 0),
    "SiegeTank": Kind(7, NONE, 25, 3.15),
    "SiegeTankSieged": Kind(13, NONE, 40, 0),
    "Cyclone": Kind(5, 5, 18, 4.7),
    "Thor": Kind(7, 11, 60, 2.6),
    "ThorHighImpactMode": Kind(7, 11, 60, 2.6),
    "VikingAssault": Kind(6, NONE, 17, 3.15),
    "Zergling": Kind(0.1, NONE, 10, 4.1),
    "Baneling": Kind(0.1, NONE, 25, 3.5),
    "Roach": Kind(4, NONE, 11, 3.15),
    "Ravager": Kind(6, NONE, 16, 3.85),
    "Hydralisk": Kind(5, 5, 22, 3.15),
    "LurkerBurrowed": Kind(8, NONE, 30, 0),
    "Lurker": Kind(NONE, NONE, 25, 4.1),
    "Queen": Kind(5, 7, 11, 1.3),
    "Infestor": Kind(NONE, NONE, 30, 3.15),
    "SwarmHost": Kind(NONE, NONE, 20, 3.15),
    "Locust": Kind(3, NONE, 12, 2.6),
    "Ultralisk": Kind(1, NONE, 55, 4.1),
    "Broodling": Kind(0.1, NONE, 5, 5.4),
}
_AIR = {
    "Phoenix": Kind(NONE, 5, 13, 5.9),
    "VoidRay": Kind(6, 6, 17, 3.8),
    "Oracle": Kind(4, NONE, 24, 5.6),
    "Carrier": Kind(8, 8, 35, 2.6),
    "Tempest": Kind(10, 13, 17, 3.1),
    "Mothership": Kind(7, 7, 25, 2.6),
    "VikingFighter": Kind(NONE, 9, 14, 3.8),
    "Liberator": Kind(NONE, 5, 8, 4.7),
    "LiberatorAG": Kind(10, NONE, 60, 0),
    "Banshee": Kind(6, NONE, 27, 3.8),
    "Battlecruiser": Kind(6, 6, 50, 2.6),
    "Mutalisk": Kind(3, 3, 12, 5.6),
    "Corruptor": Kind(NONE, 6, 10, 4.7),
    "BroodLord": Kind(10, NONE, 35, 2.0),
    "Viper": Kind(NONE, NONE, 35, 4.1),
}
_SUPPORT = {
    "WarpPrism": Kind(NONE, NONE, 8, 4.1, role="support"),
    "WarpPrismPhasing": Kind(NONE, NONE, 8, 0, role="support"),
    "Observer": Kind(NONE, NONE, 3, 2.6, role="support"),
    "ObserverSurveillanceMode": Kind(NONE, NONE, 3, 0, role="support"),
    "Medivac": Kind(NONE, NONE, 12, 3.5, role="support"),
    "Raven": Kind(NONE, NONE, 15, 3.8, role="support"),
    "Overlord": Kind(NONE, NONE, 1, 0.9, role="support"),
    "OverlordTransport": Kind(NONE, NONE, 60, 1.3, role="support"),
    "Overseer": Kind(NONE, NONE, 3, 2.6, role="support"),
    "Interceptor": Kind(NONE, NONE, 1, 10, role="support"),
}
_WORKERS = {name: Kind(0.1, NONE, 5, 2.8, role="worker") for name in ("Probe", "SCV", "Drone", "MULE")}
_GUNS = {
    "SpineCrawler": Kind(7, NONE, 19, 0),
    "SporeCrawler": Kind(NONE, 7, 30, 0),
    "PhotonCannon": Kind(7, 7, 22, 0),
    "Bunker": Kind(6, 6, 30, 0),
    "MissileTurret": Kind(NONE, 7, 39, 0),
    "PlanetaryFortress": Kind(6, NONE, 28, 0),
}
_PLAIN = (
    "Nexus Pylon Assimilator Gateway WarpGate Forge CyberneticsCore TwilightCouncil RoboticsFacility "
    "RoboticsBay Stargate FleetBeacon TemplarArchive DarkShrine ShieldBattery StasisTrap OracleStasisTrap "
    "CommandCenter OrbitalCommand SupplyDepot SupplyDepotLowered Refinery Barracks EngineeringBay Armory "
    "Factory Starport FusionCore GhostAcademy SensorTower Reactor TechLab BarracksTechLab BarracksReactor "
    "FactoryTechLab FactoryReactor StarportTechLab StarportReactor Hatchery Lair Hive Extractor "
    "SpawningPool EvolutionChamber RoachWarren BanelingNest HydraliskDen LurkerDen InfestationPit Spire "
    "GreaterSpire UltraliskCavern NydusNetwork NydusCanal CreepTumor CreepTumorBurrowed CreepTumorQueen"
)
STRUCTURE = Kind(NONE, NONE, 1, 0, role="structure", structure=True)
TOWN_HALLS = frozenset(
    {"Nexus", "CommandCenter", "OrbitalCommand", "PlanetaryFortress", "Hatchery", "Lair", "Hive"},
)
IGNORED = frozenset({"Larva", "Egg", "BroodlingEscort", "ForceField", "KD8Charge", "ParasiticBombDummy", "Interceptor"})
"""Not targets."""

KINDS: dict[str, Kind] = {
    **_GROUND,
    **{name: kind._replace(flying=True) for name, kind in (_AIR | _SUPPORT).items()},
    **_WORKERS,
    **{name: kind._replace(structure=True) for name, kind in _GUNS.items()},
    **dict.fromkeys(_PLAIN.split(), STRUCTURE),
}
UNKNOWN = Kind()
SUPPLIES = {
    **dict.fromkeys(("Zergling", "Baneling"), 0.5),
    **dict.fromkeys(("Marine", "Reaper"), 1.0),
    **dict.fromkeys(("Ravager", "Lurker", "LurkerBurrowed", "Phoenix", "SiegeTank", "SiegeTankSieged", "Cyclone"), 3.0),
    **dict.fromkeys(("Liberator", "LiberatorAG", "Banshee", "Oracle", "SwarmHost", "Disruptor"), 3.0),
    **dict.fromkeys(("Immortal", "Archon", "VoidRay", "BroodLord"), 4.0),
    **dict.fromkeys(("Tempest",), 5.0),
    **dict.fromkeys(("Colossus", "Thor", "ThorHighImpactMode", "Carrier", "Battlecruiser", "Ultralisk"), 6.0),
    "Mothership": 8.0,
    **dict.fromkeys(("Broodling", "Locust", "AdeptPhaseShift"), 0.0),
}
"""Supply of types that use another number of it than 2."""


def strength(counts: Mapping[str, int]) -> float:
    """Return the supply of the units that fight; Queens stay at home and do not count."""
    return sum(SUPPLIES.get(kind, 2.0) * count for kind, count in counts.items() if fights(kind))


def fights(kind: str) -> bool:
    """Return whether units of a type belong to the army that attacks."""
    known = KINDS.get(kind, STRUCTURE)
    return known.role == "army" and not known.structure and kind != "Queen"


def kind_of(unit: TextUnit) -> Kind:
    """Return the kind of a unit's type; a unit in the graviton beam flies."""
    kind = KINDS.get(unit.type, UNKNOWN)
    return kind._replace(flying=True) if "GravitonBeam" in unit.effects else kind
