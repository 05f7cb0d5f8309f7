"""A client without a socket: asks a session directly, for tests and measurements.

It speaks the same bytes as a client on the wire. It does not imitate a real client's behaviour; PySC2 does that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterable

    from s2clientprotocol import debug_pb2, error_pb2


class ResponseError(Exception):
    """The session answered with `Response.error`."""


def interface(*, screen: int = 128, minimap: int = 64, raw: bool = True) -> sc.InterfaceOptions:
    """Return the interface that PySC2 asks for by default, with square layers; 0 leaves the layers out."""
    options = sc.InterfaceOptions(raw=raw, score=True, raw_affects_selection=True)
    if screen:
        layers = options.feature_layer
        layers.width = 24
        layers.resolution.x = layers.resolution.y = screen
        layers.minimap_resolution.x = layers.minimap_resolution.y = minimap
    return options


class Client:
    """Requests as calls."""

    def __init__(self, session: Session | None = None) -> None:
        self.session = session or Session(data_dir=".")

    def ask(self, **request: Any) -> sc.Response:
        """Return the response to one request, given as `kind=message`.

        Raises:
            ResponseError: it was a usage error.
        """
        response = sc.Response.FromString(self.session.handle(sc.Request(**request).SerializeToString()))
        if response.error:
            raise ResponseError(*response.error)
        return response

    def create(self, map_name: str, *, seed: int | None = 1, disable_fog: bool = False) -> sc.ResponseCreateGame:
        """Create a game of one participant against the computer on a shipped map."""
        request = sc.RequestCreateGame(
            local_map=sc.LocalMap(map_path=map_name),
            player_setup=[
                sc.PlayerSetup(type=sc.Participant),
                sc.PlayerSetup(type=sc.Computer, race=common_pb2.Random, difficulty=sc.VeryHard),
            ],
            disable_fog=disable_fog,
        )
        if seed is not None:
            request.random_seed = seed
        return self.ask(create_game=request).create_game

    def play(
        self, map_name: str = "2s3z", options: sc.InterfaceOptions | None = None, *, seed: int | None = 1
    ) -> sc.ResponseObservation:
        """Create and join a game, and return the first observation."""
        self.create(map_name, seed=seed)
        self.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=options or interface()))
        return self.observe()

    def observe(self) -> sc.ResponseObservation:
        """Return an observation."""
        return self.ask(observation=sc.RequestObservation()).observation

    def step(self, count: int = 1) -> sc.ResponseObservation:
        """Step, and observe."""
        self.ask(step=sc.RequestStep(count=count))
        return self.observe()

    def act(self, *actions: sc.Action) -> list[error_pb2.ActionResult.ValueType]:
        """Send actions, and return their result codes."""
        return list(self.ask(action=sc.RequestAction(actions=actions)).action.result)

    def debug(self, *commands: debug_pb2.DebugCommand) -> None:
        """Send debug commands."""
        self.ask(debug=sc.RequestDebug(debug=commands))


def command(
    ability: int,
    tags: Iterable[int],
    *,
    target: int | None = None,
    point: tuple[float, float] | None = None,
    queue: bool = False,
) -> sc.Action:
    """Return a raw command to units, at a unit, a point or nothing."""
    action = sc.Action()
    raw = action.action_raw.unit_command
    raw.ability_id, raw.queue_command = ability, queue
    raw.unit_tags.extend(tags)
    if target is not None:
        raw.target_unit_tag = target
    elif point is not None:
        raw.target_world_space_pos.x, raw.target_world_space_pos.y = point
    return action
