"""Build orders of the three races, as tables: workers and a second base first, then an army of two or three kinds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping


class Want(NamedTuple):
    """Something that the side should have. Types that count as one have a bar between them."""

    action: str
    makes: str = ""
    """Types that count for it; "" for an upgrade, of which every level is wanted."""
    wanted: int = 1
    after: Mapping[str, int] = {}
    """What must exist before its turn comes, by type."""
    per_hall: bool = False
    """Whether the count is for each base."""
    at_once: bool = False
    """Whether at most as many of it are made at a time as there are bases."""
    first: bool = False
    """Whether later wants wait until it can be paid."""


class Line(NamedTuple):
    """Structures of one type, and what they make one at a time."""

    producer: str
    """"" for larvae."""
    units: tuple[str, ...]
    """Actions, the best first."""
    others: tuple[str, ...] = ()
    """What else keeps one of them busy."""
    lab: tuple[str, ...] = ()
    """Which of the units need a Tech Lab."""
    most: Mapping[str, int] = {}
    """How many of a unit are enough."""


@dataclass(frozen=True, slots=True)
class Build:
    """The build order of a race."""

    signs: tuple[str, ...]
    """Actions that show which race is playing."""
    supply: Want
    wants: tuple[Want, ...]
    army: tuple[Line, ...]
    boosts: tuple[str, ...] = ()
    """What makes the rest faster and costs energy only."""


PROTOSS = Build(
    signs=("Train_Probe", "Build_Pylon", "Train_Zealot", "Train_Stalker", "Build_Gateway"),
    supply=Want("Build_Pylon", "Pylon"),
    wants=(
        Want("Train_Probe", "Probe", 22, per_hall=True, at_once=True),
        Want("Build_Pylon", "Pylon", 1, {"Probe": 13}, first=True),
        Want("Build_Gateway", "Gateway|WarpGate", 1, {"Pylon": 1}, first=True),
        Want("Build_Assimilator", "Assimilator", 1, {"Pylon": 1, "Probe": 16}),
        Want("Build_CyberneticsCore", "CyberneticsCore", 1, {"Gateway|WarpGate": 1}, first=True),
        Want("Build_Nexus", "Nexus", 2, {"Pylon": 1, "Probe": 19, "Zealot|Stalker": 1}, first=True),
        Want("Research_WarpGate", after={"CyberneticsCore": 1}),
        Want("Build_Assimilator", "Assimilator", 2, {"CyberneticsCore": 1, "Probe": 20}),
        Want("Build_Gateway", "Gateway|WarpGate", 3, {"CyberneticsCore": 1, "Probe": 22}),
        Want("Build_RoboticsFacility", "RoboticsFacility", 1, {"CyberneticsCore": 1, "Probe": 26}),
        Want("Build_Gateway", "Gateway|WarpGate", 5, {"Nexus": 2, "Probe": 32}),
        Want("Build_Assimilator", "Assimilator", 4, {"Nexus": 2, "Probe": 34}),
        Want("Build_Forge", "Forge", 1, {"Nexus": 2, "Probe": 34}),
        Want("Research_ProtossGroundWeapons", after={"Forge": 1}),
        Want("Build_TwilightCouncil", "TwilightCouncil", 1, {"Nexus": 2, "Probe": 38}),
        Want("Research_Charge", after={"TwilightCouncil": 1}),
        Want("Build_Gateway", "Gateway|WarpGate", 8, {"Nexus": 2, "Probe": 40}),
        Want("Build_RoboticsFacility", "RoboticsFacility", 2, {"Nexus": 2, "Probe": 42}),
    ),
    army=(
        Line("RoboticsFacility", ("Train_Immortal",)),
        Line("WarpGate", ("Warp_Stalker", "Warp_Zealot")),
        Line("Gateway", ("Train_Stalker", "Train_Zealot"), ("Morph_WarpGate",)),
    ),
    boosts=("ChronoBoost_Economy", "ChronoBoost_Military"),
)

_COMMAND = "CommandCenter|OrbitalCommand|PlanetaryFortress"
TERRAN = Build(
    signs=("Train_SCV", "Build_SupplyDepot", "Train_Marine", "Build_Barracks"),
    supply=Want("Build_SupplyDepot", "SupplyDepot|SupplyDepotLowered"),
    wants=(
        Want("Train_SCV", "SCV", 22, per_hall=True, at_once=True),
        Want("Build_SupplyDepot", "SupplyDepot|SupplyDepotLowered", 1, {"SCV": 13}, first=True),
        Want("Build_Barracks", "Barracks", 1, {"SupplyDepot|SupplyDepotLowered": 1}, first=True),
        Want("Build_Refinery", "Refinery", 1, {"SCV": 16}),
        Want("Morph_OrbitalCommand", "OrbitalCommand", 1, {"Barracks": 1}, per_hall=True),
        Want("Build_CommandCenter", _COMMAND, 2, {"Barracks": 1, "SCV": 19}, first=True),
        Want("Build_Reactor_Barracks", "BarracksReactor", 1, {"Barracks": 1, "Marine": 1}),
        Want("Build_Barracks", "Barracks", 3, {"Barracks": 1, "SCV": 22}),
        Want("Build_TechLab_Barracks", "BarracksTechLab", 1, {"Barracks": 2}),
        Want("Research_Stimpack", after={"BarracksTechLab": 1}),
        Want("Research_CombatShield", after={"BarracksTechLab": 1}),
        Want("Build_Factory", "Factory", 1, {_COMMAND: 2, "SCV": 28}),
        Want("Build_Refinery", "Refinery", 3, {_COMMAND: 2, "SCV": 30}),
        Want("Build_Starport", "Starport", 1, {"Factory": 1}),
        Want("Build_Barracks", "Barracks", 5, {_COMMAND: 2, "SCV": 34}),
        Want("Build_TechLab_Factory", "FactoryTechLab", 1, {"Factory": 1}),
        Want("Build_EngineeringBay", "EngineeringBay", 1, {_COMMAND: 2, "SCV": 34}),
        Want("Research_TerranInfantryWeapons", after={"EngineeringBay": 1}),
        Want("Build_Reactor_Barracks", "BarracksReactor", 3, {"Barracks": 4}),
        Want("Build_TechLab_Barracks", "BarracksTechLab", 2, {"Barracks": 5}),
        Want("Build_Refinery", "Refinery", 4, {_COMMAND: 2, "SCV": 38}),
        Want("Build_Barracks", "Barracks", 8, {_COMMAND: 2, "SCV": 42}),
    ),
    army=(
        Line("Factory", ("Train_SiegeTank",), ("Build_TechLab_Factory",), ("Train_SiegeTank",)),
        Line("Starport", ("Train_Medivac", "Train_VikingFighter"), most={"Train_Medivac": 6, "Train_VikingFighter": 4}),
        Line(
            "Barracks",
            ("Train_Marauder", "Train_Marine"),
            ("Build_TechLab_Barracks", "Build_Reactor_Barracks"),
            ("Train_Marauder",),
        ),
    ),
    boosts=("Calldown_MULE",),
)

_HATCHERY = "Hatchery|Lair|Hive"
ZERG = Build(
    signs=("Train_Drone", "Train_Overlord", "Train_Zergling", "Train_Roach", "Build_SpawningPool"),
    supply=Want("Train_Overlord", "Overlord"),
    wants=(
        Want("Train_Drone", "Drone", 13),
        Want("Train_Overlord", "Overlord", 2, first=True),
        Want("Train_Drone", "Drone", 20),
        Want("Build_SpawningPool", "SpawningPool", 1, {"Drone": 17}, first=True),
        Want("Build_Hatchery", _HATCHERY, 2, {"Drone": 16}, first=True),
        Want("Build_Extractor", "Extractor", 1, {"Drone": 17}),
        Want("Train_Queen", "Queen", 1, {"SpawningPool": 1}, per_hall=True),
        Want("Train_Zergling", "Zergling", 4, {"SpawningPool": 1}),
        Want("Train_Drone", "Drone", 28, {"SpawningPool": 1}),
        Want("Build_RoachWarren", "RoachWarren", 1, {"SpawningPool": 1, "Drone": 24}, first=True),
        Want("Build_SpineCrawler", "SpineCrawler", 2, {"Queen": 2, "Drone": 24}),
        Want("Train_Roach", "Roach", 8, {"RoachWarren": 1}),
        Want("Train_Queen", "Queen", 2, {"RoachWarren": 1}, per_hall=True),
        Want("Build_Extractor", "Extractor", 2, {_HATCHERY: 2, "Drone": 28}),
        Want("Train_Drone", "Drone", 34, {_HATCHERY: 2}),
        Want("Train_Roach", "Roach", 16, {"RoachWarren": 1}),
        Want("Train_Drone", "Drone", 40, {_HATCHERY: 2}),
        Want("Morph_Lair", "Lair|Hive", 1, {"Roach": 14, "Drone": 34}),
        Want("Build_EvolutionChamber", "EvolutionChamber", 1, {"Roach": 14, "Drone": 34}),
        Want("Research_ZergMissileWeapons", after={"EvolutionChamber": 1}),
        Want("Build_EvolutionChamber", "EvolutionChamber", 2, {"EvolutionChamber": 1, "Lair|Hive": 1}),
        Want("Research_ZergGroundArmor", after={"EvolutionChamber": 2}),
        Want("Research_GlialRegeneration", after={"Lair|Hive": 1}),
        Want("Build_HydraliskDen", "HydraliskDen", 1, {"Lair|Hive": 1}),
        Want("Build_Extractor", "Extractor", 4, {_HATCHERY: 2, "Roach": 14, "Drone": 36}),
        Want("Build_SpineCrawler", "SpineCrawler", 4, {"Roach": 16, "Drone": 40}),
        Want("Train_Drone", "Drone", 48, {_HATCHERY: 2, "Roach": 16}),
    ),
    army=(
        Line(
            "",
            ("Train_Hydralisk", "Train_Roach"),
            most={"Train_Hydralisk": 20},
        ),
    ),
    boosts=("Inject_Larva",),
)

BUILDS = (PROTOSS, TERRAN, ZERG)
