"""A game in which units are made, ordered, watched and removed again, one probe after another.

The computer player is there because the game wants two; it loses its workers, and its units are ordered by us. Above:
the probes. Below: `setting`, `connection` and `ground`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from s2clientprotocol import debug_pb2, query_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.calibrate.ground import Ground, Point, grid
from khala_bridge.calibrate.setting import Setting, new_game
from khala_bridge.errors import GameError
from khala_bridge.knowledge.facts import VERSION, unit_facts
from khala_bridge.knowledge.load import is_structure, is_worker

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.calibrate.connection import Connection

ME: Final = 1
ENEMY: Final = 2
NEUTRAL: Final = 16

LOOPS_PER_SECOND: Final = 22.4
"""Of the speed "faster", which is that of ladder games."""

MOVE, ATTACK, STOP, HOLD, SMART = 3794, 3674, 3665, 3793, 1
"""Ids of general abilities; they are the same in every build."""

_TOWN_HALLS = frozenset({"CommandCenter", "Nexus", "Hatchery"})
_WEEDING_LOOPS = 112
"""A computer player that has lost its workers trains new ones; in so short a time they do nothing."""
_QUIET_LOOPS = 120
"""The longest effect that stays on the ground, a Psionic Storm, is over by then."""
_PER_REQUEST = 60
"""Units made by one request: a real game builds their models in one frame."""


class GameOver(GameError):
    """A game that is measured ended."""


class Put(NamedTuple):
    """A unit to be made."""

    kind: str
    at: Point
    owner: int = ME


class Lab:
    """One game, seen by its first player."""

    def __init__(self, connection: Connection, setting: Setting, *, seed: int) -> None:
        """Begin a game; arguments and errors are those of `new_game`."""
        self._connection = connection
        self.seed = seed
        self.begin(setting, seed)

    def begin(self, setting: Setting, seed: int) -> None:
        """Begin another game in the same process; errors as above."""
        self.setting = setting
        self._cheats: set[int] = set()
        new_game(self._connection, setting, seed)
        known = self._connection.send(data=sc.RequestData(unit_type_id=True))
        kinds = {kind.unit_id: kind for kind in known.units if kind.name}
        self.types: dict[str, Any] = {
            name: kinds[facts.id] for name, facts in unit_facts(VERSION).items() if facts.id in kinds
        }
        """Names are PySC2's: those of the game differ, and ids do not."""
        self.name_of: dict[int, str] = {kind.unit_id: name for name, kind in self.types.items()}
        self.units: dict[int, Any] = {}
        self.observation: Any = None
        self._watch(0)
        self.first = frozenset(self.units)
        """Units of the start."""
        self._made: set[int] = set()
        self._held: set[int] = set()
        self._kept = {tag for tag, unit in self.units.items() if self.name_of.get(unit.unit_type) in _TOWN_HALLS}
        info = self._connection.send(game_info=sc.RequestGameInfo())
        self.ground = Ground(info.start_raw, (_place(self.units[tag]) for tag in self._kept))
        self.height = grid(info.start_raw.terrain_height)
        """Of each cell of the map, [y, x]: 8 are one world unit."""
        if setting.peaceful:
            self._cheat(debug_pb2.control_enemy)
            self.victim = NEUTRAL if self._makes(NEUTRAL) else ME
            """Owner of targets that do nothing: nobody, if the game makes such units."""
            self.clear()

    # time -------------------------------------------------------------------------------------------------------------

    @property
    def loop(self) -> int:
        """The game loop of the last observation."""
        return int(self.observation.observation.game_loop)

    def step(self, loops: int = 1) -> None:
        """Play some loops, and look; what the computer player makes by itself is removed.

        Raises:
            GameOver: the game ended.
        """
        for start in range(0, loops, _WEEDING_LOOPS):
            if standing := self._held & self.units.keys():
                self.order(HOLD, sorted(standing))
            self._watch(min(loops - start, _WEEDING_LOOPS))
            if self.setting.peaceful:
                self._keep_peace()

    def _watch(self, loops: int) -> None:
        if loops:
            self._connection.send(step=sc.RequestStep(count=loops))
        self.observation = self._connection.send(observation=sc.RequestObservation())
        if self.observation.player_result:
            raise GameOver(f"the game on {self.setting.map} ended in loop {self.loop}")
        self.units = {unit.tag: unit for unit in self.observation.observation.raw_data.units}

    def _keep_peace(self) -> None:
        if weeds := [tag for tag in self.units if self._is_weed(tag)]:
            self.kill(*weeds)
        for tag in self._kept & self.units.keys():
            if self.units[tag].health < self.units[tag].health_max:  # who loses the last structure loses the game
                self.set(tag, Life=self.units[tag].health_max)

    def _is_weed(self, tag: int) -> bool:
        unit = self.units[tag]
        kind = self.name_of.get(unit.unit_type, "")
        return (
            unit.owner == ENEMY
            and tag not in self._made
            and tag not in self._kept
            and (is_worker(kind) or is_structure(kind))
        )

    # units ------------------------------------------------------------------------------------------------------------

    def has(self, *kinds: str) -> bool:
        """Return True if the game knows all of these types."""
        return all(kind in self.types for kind in kinds)

    def make(self, *wanted: Put) -> list[int]:
        """Make units, wait one loop, and return their tags in the same order; 0 for one that did not appear."""
        before = set(self.units)
        for start in range(0, len(wanted), _PER_REQUEST):
            self.debug(*(self._creation(put) for put in wanted[start : start + _PER_REQUEST]))
        self._watch(1)
        fresh = [unit for tag, unit in self.units.items() if tag not in before]
        tags = [self._take(put, fresh) for put in wanted]
        self._made.update(tags)
        return tags

    def _creation(self, put: Put) -> debug_pb2.DebugCommand:
        command = debug_pb2.DebugCommand()
        made = command.create_unit
        made.unit_type = self.types[put.kind].unit_id
        made.owner = put.owner
        made.quantity = 1
        made.pos.x, made.pos.y = put.at
        return command

    def _take(self, put: Put, fresh: list[Any]) -> int:
        kind = self.types[put.kind].unit_id
        fits = [unit for unit in fresh if unit.unit_type == kind and unit.owner == put.owner]
        if not fits:
            return 0
        nearest = min(fits, key=lambda unit: math.dist(_place(unit), put.at))
        fresh.remove(nearest)
        return int(nearest.tag)

    def _makes(self, owner: int) -> bool:
        return self.make(Put("Marine", self.ground.places(4, 4)[0], owner))[0] != 0

    def at(self, tag: int) -> Point:
        """Return the place of a unit.

        Raises:
            KeyError: it is not there any more.
        """
        return _place(self.units[tag])

    def life(self, tag: int) -> float:
        """Return life and shields of a unit, 0 if it is dead."""
        unit = self.units.get(tag)
        return float(unit.health + unit.shield) if unit is not None else 0.0

    def of(self, kind: str, owner: int = ME) -> list[int]:
        """Return the tags of all units of a type and a player."""
        number = self.types[kind].unit_id
        return [tag for tag, unit in self.units.items() if unit.unit_type == number and unit.owner == owner]

    def order(
        self,
        ability: int,
        tags: int | Iterable[int],
        *,
        target: int | None = None,
        point: Point | None = None,
        queue: bool = False,
    ) -> bool:
        """Order units, of either player; return whether the game takes it."""
        action = sc.Action()
        raw = action.action_raw.unit_command
        raw.ability_id, raw.queue_command = ability, queue
        raw.unit_tags.extend([tags] if isinstance(tags, int) else tags)
        if target is not None:
            raw.target_unit_tag = target
        elif point is not None:
            raw.target_world_space_pos.x, raw.target_world_space_pos.y = point
        return list(self._connection.send(action=sc.RequestAction(actions=[action])).result) == [1]

    def hold(self, tags: Iterable[int]) -> None:
        """Have enemies hold their position, and tell them again in each step: the computer player orders them, too."""
        self._held.update(tag for tag in tags if tag)
        self.order(HOLD, sorted(self._held & self.units.keys()))

    def abilities(self, tag: int) -> frozenset[int]:
        """Return the ids of what a unit can be ordered to do now."""
        query = query_pb2.RequestQuery(abilities=[query_pb2.RequestQueryAvailableAbilities(unit_tag=tag)])
        answer = self._connection.send(query=query)
        return frozenset(ability.ability_id for available in answer.abilities for ability in available.abilities)

    def set(self, tag: int, **values: float) -> None:
        """Set a unit's `Life`, `Shields` or `Energy`."""
        kinds = debug_pb2.DebugSetUnitValue.UnitValue
        self.debug(
            *(
                debug_pb2.DebugCommand(
                    unit_value=debug_pb2.DebugSetUnitValue(unit_value=kinds.Value(name), value=value, unit_tag=tag)
                )
                for name, value in values.items()
            )
        )

    def kill(self, *tags: int) -> None:
        """Remove units."""
        self.debug(debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=tags)))

    def clear(self) -> None:
        """Remove everything but town halls of the start and the map's own units, and wait until nothing lingers."""
        self._held.clear()
        for cheat in sorted(self._cheats - {debug_pb2.control_enemy}):
            self._cheat(cheat)
        for _ in range(_QUIET_LOOPS):
            left = [tag for tag in self.units if not self._stays(tag)]
            if left:
                self.kill(*left)
            elif not self.observation.observation.raw_data.effects:
                return
            self._watch(1)

    def _stays(self, tag: int) -> bool:
        unit = self.units[tag]
        return tag in self._kept or (unit.owner == NEUTRAL and tag in self.first)

    # means ------------------------------------------------------------------------------------------------------------

    def cheat(self, *names: str) -> None:
        """Switch debug states on until the next `clear`: `tech_tree`, `food`, `free`, `cooldown`."""
        for name in names:
            self._cheat(debug_pb2.DebugGameState.Value(name))

    def earn(self) -> None:
        """Get 5000 of each resource."""
        self.debug(debug_pb2.DebugCommand(game_state=debug_pb2.all_resources))

    def _cheat(self, number: int) -> None:
        self._cheats ^= {number}
        self.debug(debug_pb2.DebugCommand(game_state=number))  # type: ignore[arg-type]  # stubs want the enum's own type

    def debug(self, *commands: debug_pb2.DebugCommand) -> None:
        """Send debug commands."""
        self._connection.send(debug=sc.RequestDebug(debug=commands))


def _place(unit: Any) -> Point:
    return float(unit.pos.x), float(unit.pos.y)
