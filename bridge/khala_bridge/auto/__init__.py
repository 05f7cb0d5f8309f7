"""The host's rules for what an agent left open: which unit trains, where a building stands, which way to scout.

A rule never overrides an agent; it finds the missing argument, or says why there is none.
"""

from khala_bridge.auto.army import army_attack, army_defend, army_retreat
from khala_bridge.auto.build import build_at, build_auto, build_near, lock_base
from khala_bridge.auto.cast import cancel_building, cast, recall_near, stop_building
from khala_bridge.auto.chrono import chrono_economy, chrono_military, chrono_research
from khala_bridge.auto.produce import morph_warpgates, research, train
from khala_bridge.auto.rule import NotAvailable, Rule, RuleOrder, RuleRequest
from khala_bridge.auto.scouting import scout
from khala_bridge.auto.spread import creep_tumor, inject, mule
from khala_bridge.auto.warp import warp_auto, warp_near

__all__ = ["RULES", "NotAvailable", "Rule", "RuleOrder", "RuleRequest"]

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
    "mule": mule,
    "inject": inject,
    "creep_tumor": creep_tumor,
}
"""Every rule by the name under which the catalogue asks for it."""
