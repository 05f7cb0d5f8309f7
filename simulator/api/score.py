"""`Observation.score` and `player_common`: sums over a player's units and counters.

The names are the API's. What the game's own total is made of was never published; here it is the value of what a
player has plus the value of what he killed, which is an estimate. Values are the catalog's `score_make`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from s2clientprotocol import sc2api_pb2, score_pb2

from simulator.orders import OrderKind

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from simulator.api.types import Types
    from simulator.players import Player, Spent, Vitals
    from simulator.world import World

FOOD_LIMIT = 200


class Holdings:
    """What a player has at this loop."""

    def __init__(self, world: World, types: Types, player: int) -> None:
        self.player: Player = world.players[player]
        self.types = types
        slots = world.units_of(player)
        self.rows = world.type[slots]
        self._idle = world.order_kind[slots] == OrderKind.IDLE
        structure, worker = types.structure[self.rows], types.worker[self.rows]
        self.worker: NDArray[np.bool_] = worker
        self.units: NDArray[np.bool_] = ~structure
        self.structures: NDArray[np.bool_] = structure
        town_hall = structure & (types.provides[self.rows] > 0) & (types.minerals[self.rows] >= 300)
        self.category = {
            "army": self.units & ~worker,
            "economy": worker | town_hall,
            "technology": structure & ~town_hall,
        }

    def total(self, column: NDArray[np.float64], which: NDArray[np.bool_] | None = None) -> float:
        """Sum of a column of the types over the player's units, or over some of them."""
        rows = self.rows if which is None else self.rows[which]
        return float(column[rows].sum())

    def common(self) -> sc2api_pb2.PlayerCommon:
        """The counters at the top of the player's screen; supply in whole points."""
        types, player = self.types, self.player
        food_used, food_workers = self.total(types.supply), self.total(types.supply, self.worker)
        common = sc2api_pb2.PlayerCommon(
            player_id=player.id,
            minerals=int(player.minerals),
            vespene=int(player.vespene),
            food_cap=min(FOOD_LIMIT, int(self.total(types.provides))),
            food_used=int(food_used),
            food_army=int(food_used - food_workers),
            food_workers=int(food_workers),
            idle_worker_count=int((self.worker & self._idle).sum()),
            army_count=int(types.army[self.rows].sum()),
            warp_gate_count=int(types.warp_gate[self.rows].sum()),
        )
        if player.race == "zerg":
            common.larva_count = int(types.larva[self.rows].sum())
        return common

    def score(self) -> score_pb2.Score:
        """The score with its details."""
        types, counted = self.types, self.player.score
        details = score_pb2.ScoreDetails(
            idle_production_time=0,
            idle_worker_time=0,
            total_value_units=self.total(types.score_make, self.units),
            total_value_structures=self.total(types.score_make, self.structures),
            killed_value_units=counted.killed_value_units,
            killed_value_structures=counted.killed_value_structures,
            collected_minerals=0,
            collected_vespene=0,
            collection_rate_minerals=0,
            collection_rate_vespene=0,
            spent_minerals=0,
            spent_vespene=0,
            killed_minerals=_spent(counted.killed, 0),
            killed_vespene=_spent(counted.killed, 1),
            lost_minerals=_spent(counted.lost, 0),
            lost_vespene=_spent(counted.lost, 1),
            total_damage_dealt=_vitals(counted.damage_dealt),
            total_damage_taken=_vitals(counted.damage_taken),
            total_healed=_vitals(counted.healed),
            friendly_fire_minerals=score_pb2.CategoryScoreDetails(),
            friendly_fire_vespene=score_pb2.CategoryScoreDetails(),
            current_apm=0,
            current_effective_apm=0,
        )
        for message, column in (
            (details.food_used, types.supply),
            (details.used_minerals, types.minerals),
            (details.used_vespene, types.vespene),
        ):
            self._by_category(message, column)
        _add(details.total_used_minerals, details.used_minerals, details.lost_minerals)
        _add(details.total_used_vespene, details.used_vespene, details.lost_vespene)
        total = (
            details.total_value_units
            + details.total_value_structures
            + details.killed_value_units
            + details.killed_value_structures
        )
        return score_pb2.Score(score_type=score_pb2.Score.Melee, score=int(total), score_details=details)

    def _by_category(self, message: score_pb2.CategoryScoreDetails, column: NDArray[np.float64]) -> None:
        message.none = message.upgrade = 0
        message.army, message.economy, message.technology = (
            self.total(column, which) for which in self.category.values()
        )


def _spent(spent: Spent, resource: int) -> score_pb2.CategoryScoreDetails:
    return score_pb2.CategoryScoreDetails(
        none=0,
        army=spent.army[resource],
        economy=spent.economy[resource],
        technology=spent.technology[resource],
        upgrade=0,
    )


def _add(total: score_pb2.CategoryScoreDetails, *parts: score_pb2.CategoryScoreDetails) -> None:
    for name in ("none", "army", "economy", "technology", "upgrade"):
        setattr(total, name, sum(getattr(part, name) for part in parts))


def _vitals(vitals: Vitals) -> score_pb2.VitalScoreDetails:
    return score_pb2.VitalScoreDetails(life=vitals.life, shields=vitals.shields, energy=vitals.energy)
