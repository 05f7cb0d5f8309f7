"""The host's rules for what an agent left open: which unit trains, where a building stands, which way to scout.

A rule never overrides an agent; it finds the missing argument, or says why there is none. What it cannot find whatever
the arguments are is known beforehand: `lack` asks it, so that no observation offers what no call could get.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.auto.army import army_attack, army_defend, army_retreat, army_with_base, free_army, home_army
from khala_bridge.auto.build import any_place, build_at, build_auto, build_near, lock_base
from khala_bridge.auto.cast import cancel_building, cast, recall_near, stop_building
from khala_bridge.auto.chrono import (
    chrono_economy,
    chrono_military,
    chrono_research,
    chrono_unit,
    researching,
    training_army,
    training_workers,
)
from khala_bridge.auto.produce import morph_warpgates, producers, research, train
from khala_bridge.auto.rule import Check, NotAvailable, Rule, RuleOrder, RuleRequest
from khala_bridge.auto.scouting import scout
from khala_bridge.auto.spread import creep_tumor, fields_at_bases, free_creep, inject, mule, needy_hatcheries
from khala_bridge.auto.warp import any_field, warp_auto, warp_near

if TYPE_CHECKING:
    from khala_bridge.catalogue.action import Action
    from khala_bridge.rules import Ledger
    from khala_bridge.state import Snapshot

__all__ = ["RULES", "NotAvailable", "Rule", "RuleOrder", "RuleRequest", "lack"]

RULES: dict[str, Rule] = {
    "train": train,
    "research": research,
    "morph_warpgates": morph_warpgates,
    "build_at": build_at,
    "build_near": build_near,
    "build_auto": build_auto,
    "lock_base": lock_base,
    "warp_near": warp_near,
    "warp_auto": warp_auto,
    "army_attack": army_attack,
    "army_defend": army_defend,
    "army_retreat": army_retreat,
    "scout": scout,
    "cast": cast,
    "recall_near": recall_near,
    "stop_building": stop_building,
    "cancel_building": cancel_building,
    "chrono_economy": chrono_economy,
    "chrono_military": chrono_military,
    "chrono_research": chrono_research,
    "chrono_unit": chrono_unit,
    "mule": mule,
    "inject": inject,
    "creep_tumor": creep_tumor,
}
"""Every rule by the name under which the catalogue asks for it."""

CHECKS: dict[str, Check] = {
    "train": producers,
    "build_auto": any_place,
    "warp_auto": any_field,
    "army_attack": free_army,
    "army_defend": home_army,
    "army_retreat": army_with_base,
    "chrono_economy": training_workers,
    "chrono_military": training_army,
    "chrono_research": researching,
    "mule": fields_at_bases,
    "inject": needy_hatcheries,
    "creep_tumor": free_creep,
}
"""By rule, what it looks for beside a unit that can: the part that may find nothing, at a fraction of the cost."""


def lack(action: Action, snapshot: Snapshot, ledger: Ledger) -> str | None:
    """Return in short what an action's rule would not find for the whole side; None if it would find everything.

    Whether a unit can do it is not asked again: `khala_bridge.rules` judged it.

    Args:
        action: of the whole side.
        snapshot: the present state.
        ledger: the accounts before the first call.
    """
    check = CHECKS.get(action.rule or "")
    if check is None:
        return None
    try:
        check(RuleRequest(action, snapshot, ledger))
    except NotAvailable as missing:
        return missing.lack
    return None
