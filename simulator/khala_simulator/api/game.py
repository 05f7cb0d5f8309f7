"""A game as clients play it: the world, the clients' seats, and the log of all actions on it.

Actions and debug commands are noted with the loop they belong to and take effect when the world leaves that loop, in
the order in which they came. So the log, the setup and the seed are the whole game: a replay is the same class fed
from a log instead of a client.

Above: `joining.py`, `play.py`, `replay.py`. Below: `tick.py`, `actions.py`, `debug.py`.
"""

from __future__ import annotations

import bisect
import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from s2clientprotocol import common_pb2, debug_pb2, error_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import actions, debug
from khala_simulator.api.seat import PlayerSeat
from khala_simulator.api.sight import OBSERVER
from khala_simulator.api.types import types_of
from khala_simulator.tables.catalog import load_catalog, renumber
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import PlayerSetup

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.api.abilities import OrderPlan
    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.world.world import World

_VISIBLE = 2
_CENTRED_LOOP = 1
"""Loop in which the game itself points the cameras of a melee game; clients see that reported a loop later."""


@dataclasses.dataclass(frozen=True)
class Setup:
    """What a game is created from; players have the ids 1, 2, ... in this order."""

    game_map: GameMap
    map_data: bytes  # from which the map was read
    path: str  # the client's name of the map
    players: tuple[sc.PlayerSetup, ...]
    seed: int
    disable_fog: bool
    realtime: bool
    observers: tuple[sc.PlayerSetup, ...] = ()  # their ids follow those of the players


@dataclasses.dataclass(frozen=True)
class LogEntry:
    """One action on the game, when the world left `loop`."""

    loop: int
    player: int
    act: sc.Action | debug_pb2.DebugCommand


class _Judged(NamedTuple):
    """An action that was judged when it came: at which loop, after how many entries, and its plan."""

    entry: LogEntry
    loop: int
    done: int
    plan: OrderPlan | None


class HostedGame:
    """A running game. With a log it is a replay, and ends at `end_loop`."""

    def __init__(self, setup: Setup, version: str, log: Iterable[LogEntry] = (), end_loop: int | None = None) -> None:
        self.setup = setup
        self.end_loop = end_loop
        scenario = setup.game_map.scenario
        self.catalog = renumber(load_catalog(version, scenario.data), scenario.own_types)
        self.types = types_of(self.catalog)
        players = _player_setups(setup)
        self.world: World = new_game(
            setup.game_map, players, seed=setup.seed, catalog=self.catalog, fog=not setup.disable_fog
        )
        self.world.visibility[OBSERVER] = _VISIBLE
        self.seats: dict[int, PlayerSeat] = {}
        self.log: list[LogEntry] = list(log)
        self.not_before = 0  # what clients do takes effect at this loop at the earliest
        self.delay = 0  # loops from when a client acts until that takes effect
        self.unsent: list[LogEntry] | None = None  # what was done here since the last message to the other processes
        self._done = 0  # entries of the log that have taken effect
        self._judged: _Judged | None = None  # the first action since something took effect

    @property
    def over(self) -> bool:
        """Whether the game has a result, or its replay is at the end."""
        return self.world.ended or self.world.loop == self.end_loop

    def sit(self, player: int, options: sc.InterfaceOptions) -> PlayerSeat:
        """Give a player an interface."""
        seat = self.seats[player] = PlayerSeat(self.world, self.types, player, options)
        if self.end_loop is None and self.world.players[player].start is not None:
            self.note(LogEntry(_CENTRED_LOOP, player, _centre(seat)))
        return seat

    def act(self, player: int, action: sc.Action) -> error_pb2.ActionResult.ValueType:
        """Note an action of a player, and return how it would go at present."""
        judgement = actions.judge(self.seats[player], action)
        if action.ListFields():
            copy = sc.Action()
            copy.CopyFrom(action)
            entry = self._do(player, copy)
            if self._judged is None or self._judged.done < self._done:
                self._judged = _Judged(entry, self.world.loop, self._done, judgement.plan)
        return judgement.result

    def debug(self, player: int, command: debug_pb2.DebugCommand) -> None:
        """Note a debug command of a player."""
        copy = debug_pb2.DebugCommand()
        copy.CopyFrom(command)
        self._do(player, copy)

    def _do(self, player: int, act: sc.Action | debug_pb2.DebugCommand) -> LogEntry:
        entry = LogEntry(max(self.world.loop + self.delay, self.not_before), player, act)
        self.note(entry)
        if self.unsent is not None:
            self.unsent.append(entry)
        return entry

    def note(self, entry: LogEntry) -> None:
        """Put an entry into the log: ordered by loop, then by player, then by arrival."""
        bisect.insort(self.log, entry, lo=self._done, key=lambda e: (e.loop, e.player))

    def step(self, count: int) -> int:
        """Advance by up to `count` loops, fewer if the game ends, and return the loop that was reached."""
        target = self.world.loop + count
        if self.end_loop is not None:
            target = min(target, self.end_loop)
        while self.world.loop < target and not self.world.ended:
            self._take_effect()
            until = self.log[self._done].loop if self._done < len(self.log) else target
            advance(self.world, min(until, target) - self.world.loop)
            for seat in self.seats.values():
                seat.selection.forget_dead(self.world)
                seat.follow_script()
                if seat.unread:
                    seat.hands.forget()
        if self.world.loop == self.end_loop:
            self._take_effect()  # what ended the game that was recorded
        return self.world.loop

    @property
    def past(self) -> tuple[LogEntry, ...]:
        """The part of the log that has taken effect."""
        return tuple(self.log[: self._done])

    def results(self) -> list[sc.PlayerResult]:
        """Return the result of every player, once the game is over."""
        if not self.over:
            return []
        players = range(1, len(self.setup.players) + 1)
        return [sc.PlayerResult(player_id=player, result=_result(self.world, player)) for player in players]

    def _take_effect(self) -> None:
        while self._done < len(self.log) and self.log[self._done].loop <= self.world.loop:
            entry = self.log[self._done]
            self._done += 1
            if isinstance(entry.act, debug_pb2.DebugCommand):
                debug.execute(self.world, entry.player, entry.act)
            elif (seat := self.seats.get(entry.player)) is not None:
                actions.perform(seat, entry.act, self.world.loop, self._plan_of(entry))
                self._spread_chat(entry.player, entry.act)

    def _plan_of(self, entry: LogEntry) -> OrderPlan | None:
        """Return the plan of an action from its judgement, if nothing has taken effect since then."""
        judged = self._judged
        if judged is None or judged.entry is not entry:
            return None
        return judged.plan if (judged.loop, judged.done) == (self.world.loop, self._done - 1) else None

    def _spread_chat(self, sender: int, action: sc.Action) -> None:
        if not action.HasField("action_chat"):
            return
        chat = action.action_chat
        for player, seat in self.seats.items():
            if player == sender or chat.channel != sc.ActionChat.Team:
                seat.hands.chat.append(sc.ChatReceived(player_id=sender, message=chat.message))


def _centre(seat: PlayerSeat) -> sc.Action:
    """Return the camera's move to its present place, with which a melee game begins."""
    action = sc.Action()
    point = action.action_raw.camera_move.center_world_space
    point.x, point.y = seat.camera[0] - seat.origin[0], seat.camera[1] - seat.origin[1]
    return action


def _result(world: World, player: int) -> sc.Result.ValueType:
    number: sc.Result.ValueType = sc.Result.Value(sc.Result.Name(world.players[player].result))  # type: ignore[arg-type]  # same numbers
    return number


def _player_setups(setup: Setup) -> list[PlayerSetup]:
    """Return all players of the world: those of the request, and those that only the map knows; no open slots."""
    specs = setup.game_map.scenario.players
    taken = [number for number, spec in specs.items() if spec.control != "open"]
    players = []
    for number in range(1, max([len(setup.players), *taken]) + 1):
        asked = setup.players[number - 1] if number <= len(setup.players) else None
        spec = specs.get(number)
        control = "agent" if asked is not None and asked.type == sc.Participant else "computer"
        race: str = spec.race if spec is not None else "random"
        if race == "random":
            race = _race(setup, number, asked)
        players.append(
            PlayerSetup(
                id=number,
                race=race,
                control=control,
                name=asked.player_name if asked is not None else "",
                difficulty=asked.difficulty if asked is not None else 0,
                build=asked.ai_build if asked is not None else 0,
            )
        )
    return players


def _race(setup: Setup, number: int, asked: sc.PlayerSetup | None) -> str:
    """Return the requested race; the seed decides where it was left open."""
    if asked is not None and asked.race in _RACES:
        return _RACES[asked.race]
    draw = np.random.default_rng([setup.seed, number]).integers(len(_RACES))
    return list(_RACES.values())[int(draw)]


_RACES = {common_pb2.Terran: "terran", common_pb2.Zerg: "zerg", common_pb2.Protoss: "protoss"}
