"""The parts of `Observation.raw_data` other than units: effects on the ground, sources of power, radar.

Above: `observation.py`. Below: `effects.py`, which decides what the player perceives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.api.effects import power, seen_area_effects, seen_radars
from khala_simulator.api.sight import API_NEUTRAL, alliance_of

if TYPE_CHECKING:
    from s2clientprotocol import raw_pb2

    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.api.sight import Sight


def write_radar(raw: raw_pb2.ObservationRaw, seat: PlayerSeat) -> None:
    """Add the radars that the player knows of to the raw data."""
    for radar in seen_radars(seat.world, seat.player):
        ring = raw.radar.add(radius=radar.radius)
        x, y = radar.point
        ring.pos.x = x - seat.origin[0]
        ring.pos.y = y - seat.origin[1]
        ring.pos.z = seat.ground_z(x, y)


def write_effects(raw: raw_pb2.ObservationRaw, seat: PlayerSeat, *, through_fog: bool) -> None:
    """Add the effects that the player perceives to the raw data."""
    for area in seen_area_effects(seat.world, seat.player, through_fog=through_fog):
        side = int(alliance_of(np.array([area.owner]), seat.player)[0])
        effect = raw.effects.add(effect_id=area.effect, radius=area.radius, alliance=side)
        effect.owner = area.owner or API_NEUTRAL
        for x, y in area.points:
            effect.pos.add(x=x - seat.origin[0], y=y - seat.origin[1])


def write_power(raw: raw_pb2.ObservationRaw, seat: PlayerSeat, sight: Sight) -> None:
    """Add the player's sources of power to the raw data."""
    sources = power(sight, seat.types)
    if sources is None:
        return
    for row, radius in zip(sources.row.tolist(), sources.radius.tolist(), strict=True):
        source = raw.player.power_sources.add(radius=radius, tag=int(sight.tag[row]))
        x, y = sight.pos[row].tolist()
        source.pos.x = x - seat.origin[0]
        source.pos.y = y - seat.origin[1]
        source.pos.z = float(sight.z[row])
