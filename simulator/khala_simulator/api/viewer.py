"""The seat of a client that only watches: an observer of a game, or the viewer of a replay.

It watches everything (player 0), or one player's fog, selection, reports, and camera until its client looks elsewhere.
It changes nothing in the world. The alliance of units for an observer of everything was never published: here they are
all enemies, and their owners differ.

Above: `joining.py`, `viewing.py`, `play.py`. Below: `seat.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.api.seat import PlayerSeat
from khala_simulator.api.sight import OBSERVER

if TYPE_CHECKING:
    from s2clientprotocol import sc2api_pb2 as sc

    from khala_simulator.api.game import HostedGame


class Viewer(PlayerSeat):
    """An interface without hands."""

    def __init__(self, game: HostedGame, player: int, options: sc.InterfaceOptions) -> None:
        super().__init__(game.world, game.types, player, options)
        self._seats = game.seats
        self._own = self.hands
        self._guide = player  # the player whose camera this one follows
        self._units: tuple[int, ...] = ()  # tags of those that the camera follows instead
        self.watch(player)

    def watch(self, player: int) -> None:
        """Watch another player."""
        self.player = player
        followed = self._seats.get(player)
        self.hands = followed.hands if followed is not None else self._own
        for seat in self._seats.values():
            seat.unread = seat is not followed
            seat.reported = self.views if seat is followed else seat.views

    @property
    def camera(self) -> tuple[float, float]:
        """The world point at which the camera looks."""
        slots = [slot for slot in map(self.world.slot_of, self._units) if slot >= 0]
        if slots:
            x, y = self.world.pos[slots].mean(axis=0).tolist()
            self._point(x, y)
        elif (guide := self._seats.get(self._guide)) is not None:
            return guide.camera
        return self._own.camera

    @property
    def camera_z(self) -> float:
        """Height of the ground there."""
        return self.ground_z(*self.camera)

    def obey(self, action: sc.ObserverAction) -> None:
        """Change the observer's own view as it asks; players and units that are not there change nothing."""
        match action.WhichOneof("action"):
            case "player_perspective":
                player = action.player_perspective.player_id
                if player < len(self.world.players):
                    self._guide = player
                    self._units = ()
                    self.watch(player)
            case "camera_move":
                point = action.camera_move.world_pos
                if np.isfinite((point.x, point.y)).all():
                    self._guide = OBSERVER
                    self._units = ()
                    self._point(point.x + self.origin[0], point.y + self.origin[1])
            case "camera_follow_player":
                if action.camera_follow_player.player_id in self._seats:
                    self._guide = action.camera_follow_player.player_id
                    self._units = ()
            case "camera_follow_units":
                self._units = tuple(action.camera_follow_units.unit_tags)

    def _point(self, x: float, y: float) -> None:
        self._own.camera = self.playable.clamp(x, y)
