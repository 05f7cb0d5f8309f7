"""Knowledge of the game: unit types, abilities and upgrades of every race, as facts and as words.

    knowledge()  unit types by name    abilities()  by id    upgrades(), buffs()  by name

    model   the records                                words   fills numbers into sentences
    facts   reads what was generated, by version       load    facts and words together, once
    prompt  the lines of a prompt                      lookup  everything, for people

The state of a running game is not knowledge but observation: a unit's health and energy come from there. Here is what
the game does not say of an enemy, and what an order costs and needs.
"""

from khala_bridge.knowledge.facts import VERSION, VERSIONS, DataSet, version_of
from khala_bridge.knowledge.load import (
    RACES,
    WORKERS,
    abilities,
    ability_of,
    buffs,
    is_armed,
    is_structure,
    is_worker,
    knowledge,
    stand_ins,
    upgrades,
)
from khala_bridge.knowledge.model import AbilityFacts, BuffFacts, UnitFacts, UpgradeFacts, WeaponFacts
from khala_bridge.knowledge.prompt import advice, short

__all__ = [
    "RACES",
    "VERSION",
    "VERSIONS",
    "WORKERS",
    "AbilityFacts",
    "BuffFacts",
    "DataSet",
    "UnitFacts",
    "UpgradeFacts",
    "WeaponFacts",
    "abilities",
    "ability_of",
    "advice",
    "buffs",
    "is_armed",
    "is_structure",
    "is_worker",
    "knowledge",
    "short",
    "stand_ins",
    "upgrades",
    "version_of",
]
