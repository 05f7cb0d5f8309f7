"""Build orders of the three races, as tables: simple ones that lead to an army of one or two kinds of units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping


class Want(NamedTuple):
    """Something that the side should have."""

    action: str
    makes: str
    """Unit types that count for it, with a bar between them, or the upgrade."""
    wanted: int = 1
    after: Mapping[str, int] = {}
    """What must exist before its turn comes, by type."""
    per_hall: bool = False
    """Whether the count is for each base."""
    at_once: bool = False
    """Whether at most as many of it are made at a time as there are bases."""
    upgrade: bool = False
    first: bool = False
    """Whether later wants wait until it can be paid."""


@dataclass(frozen=True, slots=True)
class Build:
    """The build order of a race."""

    signs: tuple[str, ...]
    """Actions that show which race is playing."""
    supply: Want
    supply_minerals: int
    wants: tuple[Want, ...]
    army: tuple[str, ...]
    """Actions that make units of the army, the best first."""
    producers: tuple[str, ...] = ()
    """Types of the structures that make them one at a time; () for larvae."""
    structures: tuple[str, ...] = field(default=())


PROTOSS = Build(
    signs=("Train_Probe", "Build_Pylon", "Train_Zealot", "Train_Stalker", "Build_Gateway"),
    supply=Want("Build_Pylon", "Pylon"),
    supply_minerals=100,
    wants=(
        Want("Train_Probe", "Probe", 21, per_hall=True, at_once=True),
        Want("Build_Pylon", "Pylon", 1, {"Probe": 13}, first=True),
        Want("Build_Gateway", "Gateway|WarpGate", 1, {"Pylon": 1}, first=True),
        Want("Build_Assimilator", "Assimilator", 1, {"Pylon": 1, "Probe": 15}),
        Want("Build_CyberneticsCore", "CyberneticsCore", 1, {"Pylon": 1, "Probe": 16}, first=True),
        Want("Research_WarpGate", "WarpGate", upgrade=True, after={"CyberneticsCore": 1}),
        Want("Build_Gateway", "Gateway|WarpGate", 3, {"CyberneticsCore": 1, "Probe": 18}),
        Want("Build_Assimilator", "Assimilator", 2, {"CyberneticsCore": 1, "Probe": 18}),
        Want("Build_Nexus", "Nexus", 2, {"Stalker": 6}),
        Want("Build_RoboticsFacility", "RoboticsFacility", 1, {"Stalker": 8}),
        Want("Build_TwilightCouncil", "TwilightCouncil", 1, {"RoboticsFacility": 1}),
        Want("Research_Blink", "Blink", upgrade=True, after={"TwilightCouncil": 1}),
        Want("Build_Gateway", "Gateway|WarpGate", 6, {"Nexus": 2, "Probe": 26}),
        Want("Build_Forge", "Forge", 1, {"Nexus": 2, "Probe": 30}),
        Want("Research_ProtossGroundWeapons", "ProtossGroundWeaponsLevel1", upgrade=True, after={"Forge": 1}),
        Want("Build_Assimilator", "Assimilator", 4, {"Nexus": 2, "Probe": 34}),
    ),
    army=("Train_Immortal", "Warp_Stalker", "Train_Stalker", "Warp_Zealot", "Train_Zealot"),
    producers=("Gateway", "WarpGate", "RoboticsFacility"),
    structures=(
        "Nexus", "Pylon", "Assimilator", "Gateway", "WarpGate", "CyberneticsCore", "Forge", "TwilightCouncil",
        "RoboticsFacility", "RoboticsBay", "Stargate", "FleetBeacon", "TemplarArchive", "DarkShrine", "PhotonCannon",
        "ShieldBattery",
    ),
)  # fmt: skip

TERRAN = Build(
    signs=("Train_SCV", "Build_SupplyDepot", "Train_Marine", "Build_Barracks"),
    supply=Want("Build_SupplyDepot", "SupplyDepot"),
    supply_minerals=100,
    wants=(
        Want("Train_SCV", "SCV", 20, per_hall=True, at_once=True),
        Want("Build_SupplyDepot", "SupplyDepot|SupplyDepotLowered", 1, {"SCV": 13}, first=True),
        Want("Build_Barracks", "Barracks", 1, {"SCV": 14}, first=True),
        Want("Build_Refinery", "Refinery", 1, {"SCV": 15}),
        Want("Build_Barracks", "Barracks", 3, {"SCV": 17}),
        Want("Morph_OrbitalCommand", "OrbitalCommand", 1, {"Barracks": 1}),
        Want("Build_TechLab_Barracks", "BarracksTechLab", 1, {"Barracks": 2}),
        Want("Research_Stimpack", "Stimpack", upgrade=True, after={"BarracksTechLab": 1}),
        Want("Build_CommandCenter", "CommandCenter|OrbitalCommand", 2, {"Marine": 12}),
        Want("Build_Barracks", "Barracks", 5, {"Marine": 12}),
        Want("Build_EngineeringBay", "EngineeringBay", 1, {"Marine": 16}),
        Want("Research_TerranInfantryWeapons", "TerranInfantryWeaponsLevel1", 1, {"EngineeringBay": 1}, upgrade=True),
    ),
    army=("Train_Marauder", "Train_Marine"),
    producers=("Barracks",),
    structures=(
        "CommandCenter", "OrbitalCommand", "PlanetaryFortress", "SupplyDepot", "SupplyDepotLowered", "Refinery",
        "Barracks", "BarracksTechLab", "BarracksReactor", "EngineeringBay", "Factory", "FactoryTechLab",
        "FactoryReactor", "Armory", "Starport", "StarportTechLab", "StarportReactor", "Bunker", "MissileTurret",
        "SensorTower", "GhostAcademy", "FusionCore", "TechLab", "Reactor",
    ),
)  # fmt: skip

ZERG = Build(
    signs=("Train_Drone", "Train_Overlord", "Train_Zergling", "Train_Roach", "Build_SpawningPool"),
    supply=Want("Train_Overlord", "Overlord"),
    supply_minerals=100,
    wants=(
        Want("Train_Drone", "Drone", 14),
        Want("Build_SpawningPool", "SpawningPool", 1, {"Drone": 14}, first=True),
        Want("Build_Extractor", "Extractor", 1, {"Drone": 13, "SpawningPool": 1}),
        Want("Train_Queen", "Queen", 1, {"SpawningPool": 1}, per_hall=True),
        Want("Train_Drone", "Drone", 19, {"SpawningPool": 1}),
        Want("Build_RoachWarren", "RoachWarren", 1, {"SpawningPool": 1, "Drone": 16}, first=True),
        Want("Build_Hatchery", "Hatchery|Lair|Hive", 2, {"Roach": 8}),
        Want("Train_Drone", "Drone", 32, {"Hatchery": 2}),
        Want("Build_Extractor", "Extractor", 3, {"Hatchery": 2, "Drone": 24}),
    ),
    army=("Inject_Larva", "Train_Roach", "Train_Zergling"),
    structures=(
        "Hatchery", "Lair", "Hive", "Extractor", "SpawningPool", "EvolutionChamber", "RoachWarren", "BanelingNest",
        "SpineCrawler", "SporeCrawler", "HydraliskDen", "LurkerDen", "InfestationPit", "Spire", "GreaterSpire",
        "UltraliskCavern", "NydusNetwork", "NydusCanal", "CreepTumor", "CreepTumorBurrowed", "CreepTumorQueen",
    ),
)  # fmt: skip

BUILDS = (PROTOSS, TERRAN, ZERG)
