"""The screen executor: camera, selection and functions of the screen, one in a game loop, as the paper plays.

For each team with commands: move the camera to its head, select the units, call the function. Each of these costs a
game loop and an `SC2Env.step`; in return there are pictures of the real screen, and runs that compare with the paper's.
Positions come from the newest snapshot, since units move on while others get their orders. The selection is read back
from the game: a wrong click is repeated. A command whose units cannot be selected is refused, never given to others.

| units of the command | how they are selected |
|---|---|
| a whole team of kind `group` with a control group | recall; the group is set when its units are not in it yet |
| WarpGates that warp in | `select_warp_gates`: the game takes one that is ready |
| Larvae that hatch | a click on their hatchery, `select_larva`: the game takes one of them |
| the only idle worker; the whole army | `select_idle_worker`; `select_army` |
| any others | `select_point`: all of a type on the screen at once if all of them are meant, else one by one |

The camera moves to a target that is not on the screen, or back to the team if the team's screen shows the target.
"""

from __future__ import annotations

import contextlib
import math
from itertools import groupby
from typing import TYPE_CHECKING

from khala_bridge.act.aim import RealScreen
from khala_bridge.act.plan import GameRefusal, Plan, PlanResult, PlanStep, refuse, refused_by_game, written
from khala_bridge.act.select import Hand, Missed
from khala_bridge.catalogue.functions import raw_forms
from khala_bridge.compat import actions as pysc2
from khala_bridge.frames import central
from khala_bridge.state.requests import camera_move

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from khala_bridge.act.aim import Pixel
    from khala_bridge.act.plan import GameAction
    from khala_bridge.act.translate import Command
    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Snapshot, Unit

SAME_PLACE = 0.25
"""World units by which the camera may be off; it snaps to a grid in the game."""


class ScreenExecutor:
    """Plays commands through camera, selection and screen; remembers the units of each control group."""

    def __init__(self) -> None:
        self._groups: dict[int, frozenset[int]] = {}

    def begin(self) -> None:
        """Forget the control groups, which are empty in a new game."""
        self._groups = {}

    def plan(self, commands: Sequence[Command], snapshot: Snapshot, loops: int) -> Plan:
        """Return a plan: one step for each camera move, selection and function, then the rest of `loops`."""
        tour = _Tour(snapshot, self._groups)
        places = {_team(command): place for place, command in reversed(list(enumerate(commands)))}
        in_order = sorted(commands, key=lambda command: (command.said is None, places[_team(command)]))
        with contextlib.suppress(_EpisodeOver):
            for _, of_team in groupby(in_order, key=_team):
                yield from tour.visit(list(of_team))
            if tour.loops < loops:
                yield from tour.step(None, loops - tour.loops)
        return PlanResult(tuple(tour.functions), (*tour.refusals, *refused_by_game(commands, tour.now)))


def _team(command: Command) -> tuple[str, str]:
    """Return the team of a command; the host's own commands form a group of their own, which comes last."""
    if command.said is None:
        return "", ""
    team = command.said.team
    return team.agent, team.name


class _EpisodeOver(Exception):
    """Raised to end a tour when the game has ended."""


class _Tour:
    """One round of the teams: the present snapshot, and what was played so far."""

    def __init__(self, snapshot: Snapshot, groups: dict[int, frozenset[int]]) -> None:
        self.now = snapshot
        self._start = snapshot
        self.loops = 0
        self.functions: list[str] = []
        self.refusals: list[GameRefusal] = []
        self._hand = Hand(self, groups)
        self._wanted: WorldPoint | None = None

    def step(self, action: GameAction | None, loops: int = 1) -> Generator[PlanStep, Snapshot, None]:
        """Play one step with these actions."""
        self.now = yield PlanStep(() if action is None else (action,), loops)
        self.loops += loops
        if self.now.ended:
            raise _EpisodeOver

    def look_at(self, place: WorldPoint) -> Generator[PlanStep, Snapshot, None]:
        """Move the camera, unless it is there already or was last sent there."""
        if self._wanted is not None and math.dist(place, self._wanted) < SAME_PLACE:
            return
        self._wanted = place
        self.functions.append(written("camera_move", f"[{place.x:.1f}, {place.y:.1f}]"))
        yield from self.step(camera_move(place))

    def function(self, name: str, *arguments: object) -> Generator[PlanStep, Snapshot, None]:
        """Call a function of PySC2."""
        shown = [list(value) if isinstance(value, tuple) else value for value in arguments]
        self.functions.append(written(name, *shown))
        yield from self.step(pysc2.FUNCTIONS[name](*arguments))

    def visit(self, commands: Sequence[Command]) -> Generator[PlanStep, Snapshot, None]:
        """Carry out the commands of one team."""
        home = self._home(commands[0])
        if home is not None:
            yield from self.look_at(home)
        for command in commands:
            try:
                yield from self._hand.select(command)
                yield from self._call(command)
            except Missed as missed:
                self._note_refusal(command, str(missed))

    def _note_refusal(self, command: Command, why: str) -> None:
        if refusal := refuse(command, why):
            self.refusals.append(refusal)

    def _call(self, command: Command) -> Generator[PlanStep, Snapshot, None]:
        function = command.function
        if function.id not in self.now.functions:
            raise Missed(f"{function.name} is not available to what is selected")
        arguments: list[object] = []
        for argument in function.args:
            match argument:
                case "queued":
                    arguments.append("queued" if command.queued else "now")
                case "minimap":
                    arguments.append(RealScreen(self.now).minimap(self._place(command)))
                case _:
                    arguments.append((yield from self._pixel(command)))
        yield from self.function(function.name, *arguments)

    def _home(self, command: Command) -> WorldPoint | None:
        """Return where a team's middle was at the start of the tour; None for a team without a screen of its own."""
        if command.said is None or command.said.team.camera is None:
            return None
        places = [self._start.units[tag].pos for tag in command.said.team.tags if tag in self._start.units]
        return places[central(places)] if places else None

    # --- the target -------------------------------------------------------------------------------------------

    def _place(self, command: Command) -> WorldPoint:
        """Return where the target is now."""
        assert command.target is not None  # the catalogue gives functions with a target to actions with a target
        if not isinstance(command.target, int):
            return command.target
        return self._unit(command.target).pos

    def _unit(self, tag: int) -> Unit:
        """Return a target that is a unit, even one that is only remembered, as a geyser under the fog of war."""
        if unit := self.now.known.get(tag):
            return unit
        raise Missed("the target is gone")

    def _pixel(self, command: Command) -> Generator[PlanStep, Snapshot, Pixel]:
        """Return where to click for the target, with the camera moved if that is needed."""
        for place in (None, self._home(command), self._place(command)):
            if place is not None:
                yield from self.look_at(place)
            if RealScreen(self.now).pixel(self._place(command)) is not None:
                return self._hit(command)
        raise Missed("the target is beyond the reach of the camera")

    def _hit(self, command: Command) -> Pixel:
        screen = RealScreen(self.now)
        place = self._place(command)
        if isinstance(command.target, int):
            pixel = screen.hit(self._unit(command.target))
        elif "unit" in raw_forms(command.function.ability_id):
            pixel = screen.bare(place)  # a click on a unit would mean the unit and not the place
        else:
            pixel = screen.pixel(place)
        if pixel is None:
            raise Missed("the target cannot be clicked, something stands over it")
        return pixel
