"""The answer to `observation`: everything that a player knows at this loop.

Small parts are messages; units, images and the frame around them are joined as bytes (`wire.py`), because an
observation with feature layers is half a megabyte and is asked for after every step.

Above: `play.py`. Below: `raw.py`, `layers.py`, `ui.py`, `score.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import common_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import ui, wire
from khala_simulator.api.abilities import result_of, usable_by_any
from khala_simulator.api.effects import seen_buffs
from khala_simulator.api.layers import Frame
from khala_simulator.api.raw import PerceivedUnits
from khala_simulator.api.raw_effects import write_effects, write_power, write_radar
from khala_simulator.api.score import Holdings
from khala_simulator.api.sight import Alliance, Display

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.game import HostedGame
    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.api.sight import Sight
    from khala_simulator.api.wire import Part

_OBSERVATION = sc.ResponseObservation.DESCRIPTOR.fields_by_name["observation"].number
_RAW = sc.Observation.DESCRIPTOR.fields_by_name["raw_data"].number
_LAYERS = sc.Observation.DESCRIPTOR.fields_by_name["feature_layer_data"].number
_RENDERS = sc.Observation.DESCRIPTOR.fields_by_name["render_data"].number
_MAP_STATE = raw_pb2.ObservationRaw.DESCRIPTOR.fields_by_name["map_state"].number
_ALARM_PAUSE_LOOPS = 160
"""Loops between two reports of attacks on a player (an estimate: the game's own pause was never published)."""


def observe(game: HostedGame, seat: PlayerSeat, *, disable_fog: bool = False) -> list[Part]:
    """Return the parts of a `ResponseObservation`; consume what is reported only once."""
    world = game.world
    sight = seat.look(through_fog=disable_fog)
    selected = seat.selection.rows(sight)
    attacked = _raise_alarm(seat, sight)
    told = sc.ResponseObservation(
        actions=seat.hands.echoes,
        action_errors=[*seat.hands.errors, *_mishaps(seat)],
        player_result=game.results(),
        chat=seat.hands.chat,
    )
    holdings = Holdings(world, game.types, seat.player)
    first = sc.Observation(player_common=holdings.common(), abilities=_abilities(seat))
    if seat.options.score:
        first.score.CopyFrom(holdings.score())
    parts: list[Part] = [first.SerializeToString()]
    through_fog = disable_fog or seat.sees_all
    if seat.options.raw:
        parts += wire.embed(_RAW, _encode_raw(seat, sight, selected, through_fog=through_fog))
    last = sc.Observation(game_loop=world.loop, alerts=_alerts(seat, sight, attacked))
    last.ui_data.CopyFrom(ui.panel(world, game.types, seat.selection, seat.player))
    parts.append(last.SerializeToString())
    if seat.views:
        fogged = world.fog and not through_fog
        frame = Frame(world, game.types, seat.player, sight, selected, seat.camera, sight.pos[attacked], fogged)
        if seat.layers is not None:
            parts += wire.embed(_LAYERS, seat.layers.encode(frame))
        if seat.renders is not None:
            parts += wire.embed(_RENDERS, seat.renders.encode(frame))
    _note_observed(seat, sight, through_fog=disable_fog)
    return [told.SerializeToString(), *wire.embed(_OBSERVATION, parts)]


def _note_observed(seat: PlayerSeat, sight: Sight, *, through_fog: bool) -> None:
    seat.hands.forget()
    seat.deaths_told = len(seat.world.deaths)
    seat.mishaps_told = len(seat.world.mishaps)
    seat.alerts_told = len(seat.world.alerts)
    if through_fog:  # a look without fog tells of no deaths in it later
        seat.known |= frozenset(sight.tag[sight.display == Display.VISIBLE.value].tolist())
    else:
        seat.known = frozenset(sight.tag.tolist())
    seat.observed_loop = seat.world.loop


def _mishaps(seat: PlayerSeat) -> list[sc.ActionError]:
    """Return the player's orders since the last observation that could not be carried out after all."""
    return [
        sc.ActionError(unit_tag=m.tag, ability_id=m.ability, result=result_of(m.refusal))
        for m in seat.world.mishaps[seat.mishaps_told :]
        if m.player == seat.player
    ]


def _abilities(seat: PlayerSeat) -> list[common_pb2.AvailableAbility]:
    """Return the abilities that the selection can use now; none for a foreign unit."""
    world = seat.world
    own = [s for s in seat.selection.slots(world) if world.owner[s] == seat.player]
    return [
        common_pb2.AvailableAbility(ability_id=ability.id, requires_point=ability.requires_point)
        for ability in usable_by_any(world, own)
    ]


def _raise_alarm(seat: PlayerSeat, sight: Sight) -> NDArray[np.intp]:
    """Raise an alarm if it is due; return the rows of own units damaged since the last observation, or none."""
    world = seat.world
    if world.loop - seat.alarm_loop < _ALARM_PAUSE_LOOPS:
        return np.zeros(0, np.intp)
    own = sight.alliance == Alliance.SELF.value
    rows = np.flatnonzero(own & (world.damaged_loop[sight.slot] > seat.observed_loop))
    if rows.size:
        seat.alarm_loop = world.loop
    return rows


def _alerts(seat: PlayerSeat, sight: Sight, attacked: NDArray[np.intp]) -> list[sc.Alert.ValueType]:
    structures = seat.types.structure[sight.row[attacked]]
    told = seat.world.alerts[seat.alerts_told :]
    alerts = [sc.Alert.Value(alert.name) for alert in told if alert.player == seat.player]
    alerts += [sc.BuildingUnderAttack] if structures.any() else []
    return [*alerts, sc.UnitUnderAttack] if (~structures).any() else alerts


def _encode_raw(seat: PlayerSeat, sight: Sight, selected: NDArray[np.bool_], *, through_fog: bool) -> list[Part]:
    """Return the parts of an `ObservationRaw`, its fields in the order of their numbers."""
    world = seat.world
    first, last = raw_pb2.ObservationRaw(), raw_pb2.ObservationRaw()
    x, y = seat.camera
    camera = first.player.camera
    camera.x, camera.y = x - seat.origin[0], y - seat.origin[1]
    camera.z = seat.camera_z
    first.player.upgrade_ids.extend(world.players[seat.player].upgrades)
    write_power(first, seat, sight)
    worn = seen_buffs(world, sight)
    units = PerceivedUnits(world, seat.types, sight, selected, seat.on_screen(sight), seat.origin, worn, seat.player)
    dead = (d.tag for d in world.deaths[seat.deaths_told :] if d.owner == seat.player or d.tag in seat.known)
    last.event.dead_units.extend(dead)
    write_effects(last, seat, through_fog=through_fog)
    write_radar(last, seat)
    ground = wire.embed(_MAP_STATE, seat.ground.encode(world, seat.player))
    return [first.SerializeToString(), units.encode(), *ground, last.SerializeToString()]
