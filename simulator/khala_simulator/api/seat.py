"""One client's place in a game: what it asked to see, its camera and selection, and what to report to it next.

State only. `actions.py` changes it, `observation.py` reads it and consumes what is reported once.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.layers import FeatureLayers
from khala_simulator.api.map_state import GroundImages
from khala_simulator.api.projection import DEFAULT_WIDTH, ImagePair, Minimap, Rect, ScreenView, view_of
from khala_simulator.api.selection import PlayerSelection
from khala_simulator.api.sight import Sight, look

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.api.render import Renders
    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World

_WITHOUT_IMAGES = ScreenView(1, 1, DEFAULT_WIDTH)


@dataclasses.dataclass
class Hands:
    """A player's use of the interface: its camera, its selection, and the reports on its actions."""

    camera: tuple[float, float]
    camera_z: float  # of the ground there
    selection: PlayerSelection = dataclasses.field(default_factory=PlayerSelection)
    echoes: list[sc.Action] = dataclasses.field(default_factory=list)
    errors: list[sc.ActionError] = dataclasses.field(default_factory=list)
    chat: list[sc.ChatReceived] = dataclasses.field(default_factory=list)

    def forget(self) -> None:
        """Forget the reports that have been sent."""
        self.echoes, self.errors, self.chat = [], [], []


class PlayerSeat:
    """A player's interface to the world."""

    def __init__(self, world: World, types: Types, player: int, options: sc.InterfaceOptions) -> None:
        self.world, self.types, self.player, self.options = world, types, player, options
        width, height = world.map.terrain.size
        self.playable = Rect(*world.map.terrain.playable)
        crop = options.raw_crop_to_playable_area
        self.origin: tuple[float, float] = (self.playable.x0, self.playable.y0) if crop else (0.0, 0.0)
        self.ground = GroundImages(world.map.terrain.playable if crop else (0, 0, width, height))
        whole = Rect(0, 0, width, height)
        self.views: dict[str, ImagePair] = {}  # by the field of an Action with clicks on them
        self.layers: FeatureLayers | None = None
        self.renders: Renders | None = None
        if options.HasField("feature_layer"):
            layers = options.feature_layer
            view = view_of(layers, self.playable if crop or layers.crop_to_playable_area else whole)
            self.views["action_feature_layer"] = view
            self.layers = FeatureLayers(layers, view)
        if options.HasField("render"):
            render = options.render
            otherwise = options.feature_layer.width or DEFAULT_WIDTH
            view = view_of(render, self.playable if crop or render.crop_to_playable_area else whole, otherwise)
            self.views["action_render"] = view
            self.renders = _renders(view, types)
        self.reported = self.views  # the view in whose pixels clicks are reported: a viewer's, if one watches
        self.view: ImagePair = next(iter(self.views.values()), ImagePair(_WITHOUT_IMAGES, Minimap(1, 1, whole)))
        self.sees_all = False  # looks through the fog, which a viewer of a replay may
        self.unread = False  # no client asks for the reports
        camera = world.players[player].camera or world.map.camera
        self.hands = Hands(camera, self.ground_z(*camera))
        self._followed = 0  # selections of the map's script that have been made here
        self.follow_script()
        self.deaths_told = 0
        self.mishaps_told = 0
        self.alerts_told = 0
        self.known: frozenset[int] = frozenset()  # tags in the last observation
        self.observed_loop = -1
        self.alarm_loop = -(1 << 30)  # when an attack was last reported

    @property
    def screen(self) -> ScreenView:
        """The screen that decides whether a unit is in view."""
        return self.view.screen

    @property
    def camera(self) -> tuple[float, float]:
        """The world point at which the camera looks."""
        return self.hands.camera

    @property
    def camera_z(self) -> float:
        """Height of the ground there."""
        return self.hands.camera_z

    @property
    def selection(self) -> PlayerSelection:
        """The selected units and the control groups."""
        return self.hands.selection

    def follow_script(self) -> None:
        """Apply the selections that the map's script has made for the player since the last call."""
        made = self.world.script.selections
        for player, tags in made[self._followed :]:
            if player == self.player:
                self.hands.selection.choose(tags)
        self._followed = len(made)

    def look(self, *, through_fog: bool = False) -> Sight:
        """Return what the player perceives now."""
        return look(
            self.world,
            self.types,
            self.player,
            show_cloaked=self.options.show_cloaked,
            show_placeholders=self.options.show_placeholders,
            through_fog=through_fog or self.sees_all,
        )

    def on_screen(self, sight: Sight) -> NDArray[np.bool_]:
        """Return [n] whether each unit's centre is in the camera's view."""
        column, row = self.screen.to_pixels(sight.pos[:, 0], sight.pos[:, 1], self.camera)
        shown: NDArray[np.bool_] = (
            (column >= 0) & (column < self.screen.columns) & (row >= 0) & (row < self.screen.rows)
        )
        return shown

    def ground_z(self, x: float, y: float) -> float:
        """Return the height of the ground at a world point."""
        return self.world.map.terrain.heights.at(x, y)

    def move_camera(self, x: float, y: float) -> None:
        """Point the camera at a world point, or at the nearest one of the playable area."""
        self.hands.camera = self.playable.clamp(x, y)
        self.hands.camera_z = self.ground_z(*self.hands.camera)

    def report(self, loop: int) -> sc.Action:
        """Return a new entry of the actions that the next observation reports."""
        action = sc.Action(game_loop=loop)
        self.hands.echoes.append(action)
        return action


def _renders(view: ImagePair, types: Types) -> Renders:
    from khala_simulator.api.render import Renders  # noqa: PLC0415  # with it comes OpenCV, which few games need

    return Renders(view, types)
