"""Knowledge of the game: unit types, abilities and upgrades of every race, as facts and as words.

    facts_of(data)   all that holds on maps with these data: units, abilities and upgrades; for judgements
    knowledge()      unit types by name    abilities()  by id    upgrades(), buffs()  by name; of ladder maps

    model   the records                                words      fills numbers into sentences
    facts   reads what was generated, by version       load       facts and words together, once
    prompt  the lines of a prompt                      map_facts  what a judgement may know
    lookup  everything, for people

The state of a running game is not knowledge but observation: a unit's health and energy come from there. Here is what
the game does not say of an enemy, and what an order costs and needs.
"""

from khala_bridge.knowledge.facts import VERSION, VERSIONS, DataSet, version_of
from khala_bridge.knowledge.load import (
    RACES,
    WORKERS,
    abilities,
    buffs,
    is_structure,
    is_worker,
    knowledge,
    race_of,
    upgrades,
)
from khala_bridge.knowledge.map_facts import MapFacts, facts_of
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
    "MapFacts",
    "UnitFacts",
    "UpgradeFacts",
    "WeaponFacts",
    "abilities",
    "advice",
    "buffs",
    "facts_of",
    "is_structure",
    "is_worker",
    "knowledge",
    "race_of",
    "short",
    "upgrades",
    "version_of",
]
