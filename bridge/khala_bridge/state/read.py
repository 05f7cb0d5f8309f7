"""The reader: messages of the SC2 API in, values out.

    info = read_info(controller.game_info(), facts_of(data))      once an episode
    snapshot = read_snapshot(controller.observe(), info)                   once a step

Every attribute of a message is read once: 100 units take a third of a millisecond. Placeholders (structures that are
planned and not begun) are not units: they appear in the orders of their builders.

With `khala_bridge.state.pictures`, the only place that knows the layout of the API's observations.
"""

from __future__ import annotations

import functools
import operator
from typing import TYPE_CHECKING, Any, NamedTuple

from s2clientprotocol import common_pb2, error_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.frames import WorldPoint
from khala_bridge.names import unit_name, upgrade_name
from khala_bridge.state.episode import EpisodeInfo, PictureSizes
from khala_bridge.state.fog import known_creep
from khala_bridge.state.grid import NO_GRID, Grid
from khala_bridge.state.pictures import GamePictures
from khala_bridge.state.snapshot import ActionError, Effect, PlayerScore, PlayerState, PowerSource, Snapshot
from khala_bridge.state.unit import Alliance, Display, Unit, UnitOrder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from s2clientprotocol import score_pb2

    from khala_bridge.knowledge import MapFacts, UnitFacts
    from khala_protocol.messages import Outcome

_OUTCOMES: dict[int, Outcome] = {sc_pb.Victory: "win", sc_pb.Defeat: "loss", sc_pb.Tie: "draw"}
_ALLIANCES = (Alliance.NEUTRAL, Alliance.OWN, Alliance.ALLY, Alliance.NEUTRAL, Alliance.ENEMY)
_DISPLAYS = (None, Display.VISIBLE, Display.REMEMBERED, Display.HIDDEN, None)
_OWN, _REMEMBERED = Alliance.OWN, Display.REMEMBERED  # an attribute of an enumeration takes ten times a global
_CLOAKED = frozenset({raw_pb2.Cloaked, raw_pb2.CloakedDetected, raw_pb2.CloakedAllied})


def read_info(info: sc_pb.ResponseGameInfo, facts: MapFacts) -> EpisodeInfo:
    """Return the map of an episode, with the facts of the data that it depends on, and its picture sizes."""
    raw, layers, render = info.start_raw, info.options.feature_layer, info.options.render
    area = raw.playable_area
    return EpisodeInfo(
        facts,
        size=(raw.map_size.x, raw.map_size.y),
        playable=(area.p0.x, area.p0.y, area.p1.x, area.p1.y),
        enemy_race=_enemy_race(info),
        starts=tuple(WorldPoint(round(p.x, 3), round(p.y, 3)) for p in raw.start_locations),
        placement=_grid(raw.placement_grid),
        pathing=_grid(raw.pathing_grid),
        height=_grid(raw.terrain_height),
        pictures=PictureSizes(
            (layers.resolution.x, layers.resolution.y),
            (layers.minimap_resolution.x, layers.minimap_resolution.y),
            layers.width,
            render.width,
        ),
    )


def _enemy_race(info: sc_pb.ResponseGameInfo) -> str:
    """Return the race that the opponent chose; the game tells a player only of its own actual race."""
    others = (p.race_requested for p in info.player_info if p.type != sc_pb.Observer and not p.race_actual)
    race = next(others, common_pb2.NoRace)
    return common_pb2.Race.Name(race).lower() if race else ""


def read_snapshot(
    response: sc_pb.ResponseObservation,
    info: EpisodeInfo,
    *,
    abilities: Mapping[int, frozenset[int]] | None = None,
    functions: frozenset[int] = frozenset(),
    dead: frozenset[int] = frozenset(),
    errors: tuple[ActionError, ...] = (),
    ended: bool = False,
    outcome: Outcome | None = None,
    creep: Grid | None = None,
    through_fog: bool = False,
) -> Snapshot:
    """Return the snapshot of an observation.

    Args:
        response: of the API; it must not be changed afterwards.
        info: of the episode.
        abilities: by tag of an own unit, what the game would take from it; None if it was not asked.
        functions: ids of the PySC2 functions that the selection allows.
        dead: tags of the units that died in earlier observations that no agent has seen.
        errors: refusals of the game in these.
        ended: whether the episode is over.
        outcome: the player's result, if the response does not have it.
        creep: of the snapshot before, `NO_GRID` for the first one; None if nobody remembers what was seen.
        through_fog: whether the game was asked for the map without fog: then creep is as it is.
    """
    observation = response.observation
    raw = observation.raw_data
    known = _units(raw.units, info.facts)
    units = {tag: unit for tag, unit in known.items() if unit.display_type is not _REMEMBERED}
    player = _player(observation.player_common)
    camera = raw.player.camera
    visibility = _grid(raw.map_state.visibility)
    real = _grid(raw.map_state.creep)
    return Snapshot(
        info=info,
        game_loop=observation.game_loop,
        known=known,
        units=units,
        own=tuple([unit for unit in units.values() if unit.alliance is _OWN]),
        player=player,
        score=_score(observation.score),
        upgrades=tuple(map(upgrade_name, sorted(raw.player.upgrade_ids))),
        power_sources=tuple([PowerSource(s.tag, _point(s.pos), s.radius) for s in raw.player.power_sources]),
        effects=tuple([_effect(effect) for effect in raw.effects]),
        alerts=tuple(map(_alert, observation.alerts)),
        camera=WorldPoint(camera.x, camera.y),
        creep=real if through_fog else known_creep(real, visibility, creep),
        visibility=visibility,
        pictures=GamePictures(observation),
        abilities=abilities,
        functions=functions,
        dead=dead.union(raw.event.dead_units),
        errors=(*errors, *map(_error, response.action_errors)),
        ended=ended,
        outcome=outcome or _outcome(response, player.player_id),
    )


# --- units ------------------------------------------------------------------------------------------------------


def _units(messages: Iterable[raw_pb2.Unit], facts: MapFacts) -> dict[int, Unit]:
    """Return the units by tag, in ascending order; the last one of those with the same tag."""
    found = [unit for message in messages if (unit := read_unit(message, facts)) is not None]
    found.sort(key=_tag)
    return {unit.tag: unit for unit in found}


_tag = operator.attrgetter("tag")


class _Type(NamedTuple):
    """The values that all units of a type share."""

    name: str
    facts: UnitFacts | None


@functools.lru_cache(4096)
def _type(unit_type: int, facts: MapFacts) -> _Type:
    name = unit_name(unit_type)
    return _Type(name, facts.units.get(name))


def _fields(first: str, last: str) -> Callable[[raw_pb2.Unit], tuple[Any, ...]]:
    """Return a reader of those fields of `Unit`, in their order, that the API has under the same names."""
    names = Unit._fields
    return operator.attrgetter(*names[names.index(first) : names.index(last) + 1])


_of_all = _fields("tag", "vespene_contents")
_of_own = _fields("is_powered", "buff_duration_remain")


def read_unit(unit: raw_pb2.Unit, facts: MapFacts) -> Unit | None:
    """Return the value of one unit on a map with these facts; None for a placeholder."""
    display = _DISPLAYS[unit.display_type]
    if display is None:
        return None
    pos, buffs = unit.pos, unit.buff_ids
    name, known = _type(unit.unit_type, facts)
    alliance = _ALLIANCES[unit.alliance]
    place = WorldPoint(pos.x, pos.y)
    is_cloaked = unit.cloak in _CLOAKED
    first = (name, known, alliance, display, place, is_cloaked, tuple(buffs) if buffs else ())
    return Unit._make(first + _of_all(unit) + (_only_own(unit) if alliance is _OWN else _NOTHING_OWN))


def _only_own(unit: raw_pb2.Unit) -> tuple[Any, ...]:
    """Return the API's values for the player's own units, in the order of the fields of `Unit`."""
    passengers, orders = unit.passengers, unit.orders
    inside = tuple([unit_name(passenger.unit_type) for passenger in passengers]) if passengers else ()
    return (*_of_own(unit), inside, tuple([_order(order) for order in orders]) if orders else ())


_NOTHING_OWN = tuple(Unit._field_defaults.values())


def _order(order: raw_pb2.UnitOrder) -> UnitOrder:
    target = order.WhichOneof("target")
    tag = order.target_unit_tag if target == "target_unit_tag" else 0
    place = _point(order.target_world_space_pos) if target == "target_world_space_pos" else None
    return UnitOrder(order.ability_id, tag, place, order.progress)


# --- the rest ---------------------------------------------------------------------------------------------------


def _player(common: sc_pb.PlayerCommon) -> PlayerState:
    return PlayerState(
        player_id=common.player_id,
        minerals=common.minerals,
        vespene=common.vespene,
        food_cap=common.food_cap,
        food_used=common.food_used,
        food_army=common.food_army,
        food_workers=common.food_workers,
        idle_worker_count=common.idle_worker_count,
        army_count=common.army_count,
    )


def _score(score: score_pb2.Score) -> PlayerScore:
    details = score.score_details
    return PlayerScore(
        total=float(score.score),
        killed=_total(details.killed_minerals) + _total(details.killed_vespene),
        lost=_total(details.lost_minerals) + _total(details.lost_vespene),
        income=(details.collection_rate_minerals, details.collection_rate_vespene),
        spent=(details.spent_minerals, details.spent_vespene),
    )


def _total(category: score_pb2.CategoryScoreDetails) -> float:
    return category.none + category.army + category.economy + category.technology + category.upgrade


def _effect(effect: raw_pb2.Effect) -> Effect:
    places = tuple(map(_point, effect.pos))
    return Effect(effect.effect_id, _ALLIANCES[effect.alliance], effect.radius, places, effect.owner)


def _alert(alert: sc_pb.Alert.ValueType) -> str:
    return sc_pb.Alert.Name(alert)


def _error(error: sc_pb.ActionError) -> ActionError:
    return ActionError(error.unit_tag, error.ability_id, error_pb2.ActionResult.Name(error.result))


def _outcome(response: sc_pb.ResponseObservation, player: int) -> Outcome | None:
    return next((_OUTCOMES.get(r.result) for r in response.player_result if r.player_id == player), None)


def _grid(image: common_pb2.ImageData) -> Grid:
    data = image.data
    return Grid(image.size.x, image.size.y, image.bits_per_pixel, data) if data else NO_GRID


def _point(point: common_pb2.Point | common_pb2.Point2D) -> WorldPoint:
    return WorldPoint(point.x, point.y)
