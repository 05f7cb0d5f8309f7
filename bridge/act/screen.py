"""The screen executor: camera, selection and functions of the screen, one in a game loop, as the paper plays.

For each team that has commands: move the camera to its head, select who is meant, call the function. It costs a game
loop and an `SC2Env.step` for each of these; what a picture of the real screen shows, and what can be compared with
the paper's runs, is bought with that. Positions are taken from the snapshot of the moment, since units move on
while others are being told.

| team | selected by |
|---|---|
| kind `select`, or some units of a team | `select_point` on the first, `toggle` on the others |
| kind `select_all_type` | `select_point` with `select_all_type` on the head |
| kind `group` with a control group | recall; the group is set when its units are not in it yet |
"""

from __future__ import annotations

import contextlib
import math
from itertools import groupby
from typing import TYPE_CHECKING, TypeAlias

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bridge.act.plan import Plan, Played, Refusal, Step, refuse, refused_by_game, written
from bridge.compat import actions as pysc2
from bridge.frames import CAMERA_WIDTH, MapFrame, WorldPoint
from protocol.messages import Frames

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from bridge.act.plan import GameAction
    from bridge.act.translate import Command
    from bridge.observe.teams import Team
    from bridge.snapshot import Snapshot

Pixel: TypeAlias = tuple[int, int]
SAME_PLACE = 0.25
"""World units within which the camera is where it should be; it snaps to a grid in the game."""


class ScreenExecutor:
    """Plays commands through camera, selection and screen; remembers who is in which control group."""

    def __init__(self) -> None:
        self._groups: dict[int, frozenset[int]] = {}

    def begin(self) -> None:
        """Control groups are empty in a new game."""
        self._groups = {}

    def plan(self, commands: Sequence[Command], snapshot: Snapshot, loops: int) -> Plan:
        """One step for each move of the camera, selection and function, then what is left of `loops`."""
        tour = _Tour(snapshot, self._groups)
        places = {_team(command): place for place, command in reversed(list(enumerate(commands)))}
        in_order = sorted(commands, key=lambda command: places[_team(command)])
        with contextlib.suppress(_EpisodeOver):
            for _, of_team in groupby(in_order, key=_team):
                yield from tour.visit(list(of_team))
            if tour.loops < loops:
                yield from tour.step(None, loops - tour.loops)
        return Played(tuple(tour.functions), (*tour.refusals, *refused_by_game(commands, tour.now)))


def _team(command: Command) -> tuple[str, str]:
    team = command.said.team.team
    return team.agent, team.name


class _EpisodeOver(Exception):
    """Ends a tour where the game ended."""


class _Tour:
    """One round of the teams: where the game is now, and what was played so far."""

    def __init__(self, snapshot: Snapshot, groups: dict[int, frozenset[int]]) -> None:
        self.now = snapshot
        self.loops = 0
        self.functions: list[str] = []
        self.refusals: list[Refusal] = []
        self._groups = groups
        self._wanted: WorldPoint | None = None

    def step(self, action: GameAction | None, loops: int = 1) -> Generator[Step, Snapshot, None]:
        self.now = yield Step(() if action is None else (action,), loops)
        self.loops += loops
        if self.now.ended:
            raise _EpisodeOver

    def visit(self, commands: Sequence[Command]) -> Generator[Step, Snapshot, None]:
        """Carries out the commands of one team."""
        camera = commands[0].said.team.camera
        selected: frozenset[int] = frozenset()
        yield from self._look_at(WorldPoint(camera.x, camera.y))
        for command in commands:
            alive = [tag for tag in command.units if tag in self.now.units]
            if not alive:
                self.refusals.append(refuse(command, "its units are gone"))
                continue
            if selected & self.now.units.keys() != set(alive):
                yield from self._select(command.said.team.team, alive)
                yield from self._look_at(WorldPoint(camera.x, camera.y))
                selected = frozenset(alive)
            yield from self._call(command)

    # --- the hands --------------------------------------------------------------------------------------------

    def _look_at(self, world: WorldPoint) -> Generator[Step, Snapshot, None]:
        if self._wanted is not None and math.dist(world, self._wanted) < SAME_PLACE:
            return
        self._wanted = world
        action = sc_pb.Action()
        action.action_raw.camera_move.center_world_space.CopyFrom(common_pb2.Point(x=world.x, y=world.y, z=0))
        self.functions.append(written("camera_move", f"[{world.x:.1f}, {world.y:.1f}]"))
        yield from self.step(action)

    def _select(self, team: Team, alive: Sequence[int]) -> Generator[Step, Snapshot, None]:
        whole = set(alive) == {tag for tag in team.tags if tag in self.now.units}
        group = team.control_group
        if whole and team.kind == "select_all_type":
            yield from self._click(alive[0], "select_all_type")
        elif whole and team.kind == "group" and group is not None:
            if not set(alive) <= self._groups.get(group, frozenset()):
                yield from self._click_all(alive)
                yield from self._function("select_control_group", "set", group)
                self._groups[group] = frozenset(
                    t for t in alive if t in self.now.units and self.now.units[t].is_selected
                )
            else:
                yield from self._function("select_control_group", "recall", group)
        else:
            yield from self._click_all(alive)

    def _click_all(self, tags: Sequence[int]) -> Generator[Step, Snapshot, None]:
        for place, tag in enumerate(tags):
            yield from self._click(tag, "toggle" if place else "select")

    def _click(self, tag: int, how: str) -> Generator[Step, Snapshot, None]:
        unit = self.now.units.get(tag)
        if unit is not None and self._pixel(unit.pos.x, unit.pos.y) is None:
            yield from self._look_at(WorldPoint(unit.pos.x, unit.pos.y))
            unit = self.now.units.get(tag)
        pixel = None if unit is None else self._pixel(unit.pos.x, unit.pos.y)
        if pixel is not None:
            yield from self._function("select_point", how, pixel)

    def _call(self, command: Command) -> Generator[Step, Snapshot, None]:
        function = pysc2.FUNCTIONS[command.function.id]
        if function.id not in self.now.functions:
            self.refusals.append(refuse(command, f"{function.name} is not available to what is selected"))
            return
        place = command.target
        if isinstance(place, int):
            unit = self.now.units.get(place)
            if unit is None:
                self.refusals.append(refuse(command, "the target is gone"))
                return
            place = WorldPoint(unit.pos.x, unit.pos.y)
        arguments: list[object] = []
        for argument in function.args:
            if argument.name == "queued":
                arguments.append("queued" if command.queued else "now")
                continue
            assert place is not None  # the catalogue gives functions with a target to actions with a target
            pixel = self._minimap_pixel(place) if argument.name == "minimap" else self._pixel(place.x, place.y)
            if pixel is None:
                self.refusals.append(refuse(command, "the target is not on the screen"))
                return
            arguments.append(pixel)
        yield from self._function(function.name, *arguments)

    def _function(self, name: str, *arguments: object) -> Generator[Step, Snapshot, None]:
        shown = [list(value) if isinstance(value, tuple) else value for value in arguments]
        self.functions.append(written(name, *shown))
        yield from self.step(pysc2.FUNCTIONS[name](*arguments))

    # --- the eyes ---------------------------------------------------------------------------------------------

    def _pixel(self, x: float, y: float) -> Pixel | None:
        """Where a world position is on the real screen; None if it is not on it."""
        size = self.now.info.options.feature_layer.resolution
        camera = self.now.response.observation.raw_data.player.camera
        px = math.floor((x - camera.x) * size.x / CAMERA_WIDTH + size.x / 2)
        py = math.floor((camera.y - y) * size.y / CAMERA_WIDTH + size.y / 2)
        return (px, py) if 0 <= px < size.x and 0 <= py < size.y else None

    def _minimap_pixel(self, place: WorldPoint) -> Pixel:
        size = self.now.info.options.feature_layer.minimap_resolution
        world = MapFrame.of(self.now.info, Frames(minimap=float(size.x)))
        x, y = world.minimap(place.x, place.y)
        return min(math.floor(x), size.x - 1), min(math.floor(y), size.y - 1)
