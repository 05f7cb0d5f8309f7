"""What is known of the game: unit types, abilities, upgrades of every race, with facts and words.

    knowledge()  unit types by name        abilities()  by id        upgrades()  by name

    model   the records          load   reads the files of `bridge/data/knowledge`, once

What happens in a running game is no knowledge but an observation: health, energy and the like of a unit come from
there; here is what the game does not say of an enemy, and what an order would cost and need.
"""

from bridge.knowledge.load import (
    RACES,
    VERSION,
    VERSIONS,
    abilities,
    ability_of,
    is_armed,
    knowledge,
    stand_ins,
    upgrades,
)
from bridge.knowledge.model import AbilityFacts, UnitType, UpgradeFacts, Weapon

__all__ = [
    "RACES",
    "VERSION",
    "VERSIONS",
    "AbilityFacts",
    "UnitType",
    "UpgradeFacts",
    "Weapon",
    "abilities",
    "ability_of",
    "is_armed",
    "knowledge",
    "stand_ins",
    "upgrades",
]
