"""`Observation.score` and `player_common`: sums over a player's units and counters.

Where the map has a score of its own, or scores gathered resources, that is the score, and its type is Curriculum.

The names are the API's. How the game computes its own total was never published; here it is what the player has in the
bank, the value of its units and structures, and that of its kills, which is an estimate. Values are the catalog's
`score_make`. A Terran or Protoss starts with 1050, as in the game.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import sc2api_pb2, score_pb2

from khala_simulator.economy import supply
from khala_simulator.numeric.arrays import which
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.world.players import SpentResources, Vitals, WorldPlayer
    from khala_simulator.world.world import World

RATE_LOOPS = 240
"""Loops over which the rates of collection are measured: in recorded games they are multiples of 28, 5 per 240 loops,
from loop 320 on, and at loop 160 multiples of 42, 5 per 160."""
FASTER_LOOPS = 22.4
TOWN_HALL_MINERALS = 300
"""From this price on, a structure that provides supply is a town hall: Pylons, depots and extractors cost less."""

CATEGORIES = ("army", "economy", "technology")


class Holdings:
    """The property of a player at this loop."""

    def __init__(self, world: World, types: Types, player: int) -> None:
        self.player: WorldPlayer = world.players[player]
        self.kind = world.map.scenario.score
        slots = which(world.alive & (world.owner == player) & ~world.hallucination)  # passengers count, too
        rows = world.type[slots]
        names, columns = _columns(types)
        totals = np.bincount(rows, minlength=len(columns)) @ columns
        self.totals: dict[str, float] = dict(zip(names, totals.tolist(), strict=True))
        idle = (world.order_kind[slots] == OrderKind.IDLE.value) & types.worker[rows]
        self.idle_workers = int(idle.sum())
        self.food = supply.in_use(world, player), supply.cap(world, player)
        loops = max(min(world.loop, RATE_LOOPS), 1)
        self.lately = [60.0 * FASTER_LOOPS / loops * sum(amounts) for amounts in self._recent(world.loop)]

    def _recent(self, loop: int) -> tuple[list[float], list[float]]:
        """Return the minerals and vespene delivered in the last loops."""
        rows = [row for row in self.player.score.deliveries if row[0] > loop - RATE_LOOPS]
        return [minerals for _, minerals, __ in rows], [vespene for _, __, vespene in rows]

    def common(self) -> sc2api_pb2.PlayerCommon:
        """Return the counters at the top of the player's screen; supply in whole points."""
        player, totals = self.player, self.totals
        common = sc2api_pb2.PlayerCommon(
            player_id=player.id,
            minerals=int(player.minerals),
            vespene=int(player.vespene),
            food_cap=int(self.food[1]),
            food_used=int(self.food[0]),
            food_army=int(self.food[0] - totals["supply of workers"]),
            food_workers=int(totals["supply of workers"]),
            idle_worker_count=self.idle_workers,
            army_count=int(totals["army"]),
            warp_gate_count=int(totals["warp gates"]),
        )
        if player.race == "zerg":
            common.larva_count = int(totals["larvae"])
        return common

    def score(self) -> score_pb2.Score:
        """Return the score with its details."""
        counted, totals = self.player.score, self.totals
        details = score_pb2.ScoreDetails(
            idle_production_time=counted.idle_production_s,
            idle_worker_time=counted.idle_worker_s,
            total_value_units=totals["value of units"],
            total_value_structures=totals["value of structures"],
            killed_value_units=counted.killed_value_units,
            killed_value_structures=counted.killed_value_structures,
            collected_minerals=counted.collected[0],
            collected_vespene=counted.collected[1],
            collection_rate_minerals=self.lately[0],
            collection_rate_vespene=self.lately[1],
            spent_minerals=counted.spent[0],
            spent_vespene=counted.spent[1],
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
        self._by_category(details.food_used, "supply")
        self._by_category(details.used_minerals, "minerals")
        self._by_category(details.used_vespene, "vespene")
        _add(details.total_used_minerals, details.used_minerals, details.lost_minerals)
        _add(details.total_used_vespene, details.used_vespene, details.lost_vespene)
        if self.kind != "melee":
            given = counted.curriculum if self.kind == "curriculum" else sum(counted.collected)
            return score_pb2.Score(score_type=score_pb2.Score.Curriculum, score=int(given), score_details=details)
        total = (
            int(self.player.minerals)
            + int(self.player.vespene)
            + details.total_value_units
            + details.total_value_structures
            + details.killed_value_units
            + details.killed_value_structures
        )
        return score_pb2.Score(score_type=score_pb2.Score.Melee, score=int(total), score_details=details)

    def _by_category(self, message: score_pb2.CategoryScoreDetails, what: str) -> None:
        message.none = message.upgrade = 0
        message.army, message.economy, message.technology = (self.totals[f"{what}, {c}"] for c in CATEGORIES)


@functools.lru_cache(maxsize=4)
def _columns(types: Types) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Return names and values [rows, k] of the quantities that are summed over a player's units."""
    town_hall = types.structure & (types.provides > 0) & (types.minerals >= TOWN_HALL_MINERALS)
    economy = types.worker | town_hall
    categories = (~types.structure & ~types.worker, economy, types.structure & ~town_hall)
    columns: dict[str, NDArray[np.float64]] = {
        "supply": types.supply,
        "supply of workers": types.supply * types.worker,
        "army": types.army.astype(np.float64),
        "warp gates": types.warp_gate.astype(np.float64),
        "larvae": types.larva.astype(np.float64),
        "value of units": types.score_make * ~types.structure,
        "value of structures": types.score_make * types.structure,
    }
    for name, column in (("supply", types.supply), ("minerals", types.minerals), ("vespene", types.vespene)):
        columns |= {f"{name}, {c}": column * which for c, which in zip(CATEGORIES, categories, strict=True)}
    return tuple(columns), np.stack(list(columns.values()), axis=1)


def _spent(spent: SpentResources, resource: int) -> score_pb2.CategoryScoreDetails:
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
