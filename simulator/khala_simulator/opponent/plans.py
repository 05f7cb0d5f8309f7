"""What a computer player of each race builds, in short lists. An estimate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ArmyPlan:
    """Names of unit types: those that give supply, gather gas, make units, come before better units, and fight.

    ``army`` is in the order of preference; types not allowed or affordable yet are skipped.
    """

    worker: str
    supply: str
    gas: str
    producer: str
    tech: tuple[str, ...]
    army: tuple[str, ...]
    makers: tuple[str, ...]


PLANS: Final = {
    "protoss": ArmyPlan(
        worker="Probe",
        supply="Pylon",
        gas="Assimilator",
        producer="Gateway",
        tech=("CyberneticsCore",),
        army=("Stalker", "Zealot"),
        makers=("Gateway", "WarpGate"),
    ),
    "terran": ArmyPlan(
        worker="SCV",
        supply="SupplyDepot",
        gas="Refinery",
        producer="Barracks",
        tech=(),
        army=("Marine",),
        makers=("Barracks",),
    ),
    "zerg": ArmyPlan(
        worker="Drone",
        supply="Overlord",
        gas="Extractor",
        producer="SpawningPool",
        tech=("RoachWarren",),
        army=("Roach", "Zergling"),
        makers=("Larva",),
    ),
}
