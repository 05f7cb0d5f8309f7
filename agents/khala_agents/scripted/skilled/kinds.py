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


class UnitKind(NamedTuple):
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

    def hits(self, other: UnitKind) -> bool:
        """Return whether its weapon can be aimed at another type."""
        return (self.air if other.flying else self.ground) >= 0

    @property
    def melee(self) -> bool:
        """Whether it has to touch its target."""
        return 0 <= self.ground < 2


_GROUND = {
    "Zealot": UnitKind(0.1, NONE, 18, 3.15),
    "Stalker": UnitKind(6, 6, 10, 4.13),
    "Sentry": UnitKind(5, 5, 8, 3.15),
    "Adept": UnitKind(4, NONE, 8, 3.5),
    "AdeptPhaseShift": UnitKind(NONE, NONE, 0, 3.5, role="support"),
    "HighTemplar": UnitKind(6, NONE, 40, 2.8),
    "DarkTemplar": UnitKind(0.1, NONE, 37, 3.9),
    "Archon": UnitKind(3, 3, 20, 3.9),
    "Immortal": UnitKind(6, NONE, 35, 3.15),
    "Colossus": UnitKind(7, NONE, 30, 3.15),
    "Disruptor": UnitKind(NONE, NONE, 40, 3.15),
    "Marine": UnitKind(5, 5, 10, 3.15),
    "Marauder": UnitKind(6, NONE, 12, 3.15),
    "Reaper": UnitKind(5, NONE, 10, 5.2),
    "Ghost": UnitKind(6, 6, 20, 3.9),
    "Hellion": UnitKind(5, NONE, 8, 5.9),
    "Hellbat": UnitKind(2, NONE, 13, 3.15),
    "WidowMine": UnitKind(NONE, NONE, 20, 3.9),
    "WidowMineBurrowed": UnitKind(5, 5, 60, 0),
    "SiegeTank": UnitKind(7, NONE, 25, 3.15),
    "SiegeTankSieged": UnitKind(13, NONE, 40, 0),
    "Cyclone": UnitKind(5, 5, 18, 4.7),
    "Thor": UnitKind(7, 11, 60, 2.6),
    "ThorHighImpactMode": UnitKind(7, 11, 60, 2.6),
    "VikingAssault": UnitKind(6, NONE, 17, 3.15),
    "Zergling": UnitKind(0.1, NONE, 10, 4.1),
    "Baneling": UnitKind(0.1, NONE, 25, 3.5),
    "Roach": UnitKind(4, NONE, 11, 3.15),
    "Ravager": UnitKind(6, NONE, 16, 3.85),
    "Hydralisk": UnitKind(5, 5, 22, 3.15),
    "LurkerBurrowed": UnitKind(8, NONE, 30, 0),
    "Lurker": UnitKind(NONE, NONE, 25, 4.1),
    "Queen": UnitKind(5, 7, 11, 1.3),
    "Infestor": UnitKind(NONE, NONE, 30, 3.15),
    "SwarmHost": UnitKind(NONE, NONE, 20, 3.15),
    "Locust": UnitKind(3, NONE, 12, 2.6),
    "Ultralisk": UnitKind(1, NONE, 55, 4.1),
    "Broodling": UnitKind(0.1, NONE, 5, 5.4),
}
_AIR = {
    "Phoenix": UnitKind(NONE, 5, 13, 5.9),
    "VoidRay": UnitKind(6, 6, 17, 3.8),
    "Oracle": UnitKind(4, NONE, 24, 5.6),
    "Carrier": UnitKind(8, 8, 35, 2.6),
    "Tempest": UnitKind(10, 13, 17, 3.1),
    "Mothership": UnitKind(7, 7, 25, 2.6),
    "VikingFighter": UnitKind(NONE, 9, 14, 3.8),
    "Liberator": UnitKind(NONE, 5, 8, 4.7),
    "LiberatorAG": UnitKind(10, NONE, 60, 0),
    "Banshee": UnitKind(6, NONE, 27, 3.8),
    "Battlecruiser": UnitKind(6, 6, 50, 2.6),
    "Mutalisk": UnitKind(3, 3, 12, 5.6),
    "Corruptor": UnitKind(NONE, 6, 10, 4.7),
    "BroodLord": UnitKind(10, NONE, 35, 2.0),
    "Viper": UnitKind(NONE, NONE, 35, 4.1),
}
_SUPPORT = {
    "WarpPrism": UnitKind(NONE, NONE, 8, 4.1, role="support"),
    "WarpPrismPhasing": UnitKind(NONE, NONE, 8, 0, role="support"),
    "Observer": UnitKind(NONE, NONE, 3, 2.6, role="support"),
    "ObserverSurveillanceMode": UnitKind(NONE, NONE, 3, 0, role="support"),
    "Medivac": UnitKind(NONE, NONE, 12, 3.5, role="support"),
    "Raven": UnitKind(NONE, NONE, 15, 3.8, role="support"),
    "Overlord": UnitKind(NONE, NONE, 1, 0.9, role="support"),
    "OverlordTransport": UnitKind(NONE, NONE, 60, 1.3, role="support"),
    "Overseer": UnitKind(NONE, NONE, 3, 2.6, role="support"),
    "Interceptor": UnitKind(NONE, NONE, 1, 10, role="support"),
}
_WORKERS = {name: UnitKind(0.1, NONE, 5, 2.8, role="worker") for name in ("Probe", "SCV", "Drone", "MULE")}
_GUNS = {
    "SpineCrawler": UnitKind(7, NONE, 19, 0),
    "SporeCrawler": UnitKind(NONE, 7, 30, 0),
    "PhotonCannon": UnitKind(7, 7, 22, 0),
    "Bunker": UnitKind(6, 6, 30, 0),
    "MissileTurret": UnitKind(NONE, 7, 39, 0),
    "PlanetaryFortress": UnitKind(6, NONE, 28, 0),
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
STRUCTURE = UnitKind(NONE, NONE, 1, 0, role="structure", structure=True)
TOWN_HALLS = frozenset(
    {"Nexus", "CommandCenter", "OrbitalCommand", "PlanetaryFortress", "Hatchery", "Lair", "Hive"},
)
IGNORED = frozenset({"Larva", "Egg", "BroodlingEscort", "ForceField", "KD8Charge", "ParasiticBombDummy", "Interceptor"})
"""Not targets."""

KINDS: dict[str, UnitKind] = {
    **_GROUND,
    **{name: kind._replace(flying=True) for name, kind in (_AIR | _SUPPORT).items()},
    **_WORKERS,
    **{name: kind._replace(structure=True) for name, kind in _GUNS.items()},
    **dict.fromkeys(_PLAIN.split(), STRUCTURE),
}
UNKNOWN = UnitKind()
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


def kind_of(unit: TextUnit) -> UnitKind:
    """Return the kind of a unit's type; a unit in the graviton beam flies."""
    kind = KINDS.get(unit.type, UNKNOWN)
    return kind._replace(flying=True) if "GravitonBeam" in unit.effects else kind
