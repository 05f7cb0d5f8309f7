"""A game on PySC2: plans drive the unmodified `SC2Env`.

PySC2 starts the game that SC2PATH names, speaks its API and checks inputs and outputs. Here its observations become
snapshots, and its exceptions become a `GameError` that says what to do. The proto of an observation is kept, since
only it has positions in world units. This module knows no agent, no team and no text.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import logging
from typing import TYPE_CHECKING, Any

from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.act.plan import PlanResult, PlanStep
from khala_bridge.catalogue.functions import check_against_pysc2
from khala_bridge.compat import protocol
from khala_bridge.errors import GameError, GameMissing
from khala_bridge.game.battle import Battle
from khala_bridge.game.game import GameConfig, GameIdentity, StepResult, check_install
from khala_bridge.game.meeting import env_of
from khala_bridge.game.processes import explain_errors
from khala_bridge.knowledge import facts_of
from khala_bridge.state import read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_bridge.state.grid import NO_GRID
from khala_protocol.files import MB, read_limited

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from khala_bridge.act.plan import GameAction, Plan
    from khala_bridge.game.invitation import Invitation
    from khala_bridge.game.processes import Processes
    from khala_bridge.state import EpisodeInfo, Snapshot
    from khala_bridge.state.grid import Grid

log = logging.getLogger(__name__)

_PLACING_LOOPS = 16
"""Loops that a map's script may take until it places the first unit; the battles need none or one."""
MAX_MAP_BYTES = 64 * MB
"""The largest map of the game's ladder has 6 MB."""


class PySC2Game:
    """One player against an opponent, or two against each other, on `SC2Env`.

    Two players have two processes of the game, which PySC2 joins over LAN ports of this machine. So do a player and an
    opponent who is not the computer; `khala_bridge.game.meeting` brings them together.
    """

    def __init__(
        self, config: GameConfig, processes: Processes | None = None, invitation: Invitation | None = None
    ) -> None:
        """Start the game.

        Args:
            config: which game, and how.
            processes: where the process of a game for one player that draws nothing comes from, and goes afterwards.
            invitation: how an opponent who joins is asked in.

        Raises:
            GameMissing: there is no game or no such map in the install.
            GameError: it could not be started.
            CatalogueError: the functions of this PySC2 are not those of the text actions.
        """
        self._config = config
        self._asks = config.abilities
        self._lifts_fog = config.opponent.kind != "lan"  # its clock may go on, and its host agreed to no such look
        self._met_enemy = False
        self._episode = 0
        self._ended = True
        self._maps: tuple[EpisodeInfo, ...] = ()
        self._creep: list[Grid] = []
        self._battle: Battle | None = None
        check_against_pysc2()
        check_install(config.sc2path)
        map_data = _map_data(config)
        self._env = env_of(config, processes, invitation)
        with explain_errors("the game could not be asked for its version"):
            ping = self._env._controllers[0].ping()  # noqa: SLF001  # PySC2 tells the version nowhere else
        self._info = GameIdentity(
            version=ping.game_version,
            data_version=ping.data_version,
            map_file=config.map.file,
            map_sha256=hashlib.sha256(map_data).hexdigest(),
        )

    @property
    def info(self) -> GameIdentity:
        """What plays."""
        return dataclasses.replace(self._info, opponent=self._env.met)

    def reset(self) -> tuple[Snapshot, ...]:
        """Begin an episode, and wait for the map's script to place its units."""
        with explain_errors("a new episode could not be begun"):
            if self._config.seed is not None:
                # `SC2Env` would begin every episode with the same seed, and has no parameter for another one
                self._env._random_seed = self._config.seed + self._episode  # noqa: SLF001
            steps = self._env.reset()
            self._episode += 1
            facts = facts_of(self._config.map.data)
            self._maps = tuple(read_info(info, facts) for info in self._env.game_info)
            self._creep = [NO_GRID] * len(self._maps)
            self._battle = None
            snapshots = self._snapshots(steps)
            for _ in range(_PLACING_LOOPS):
                if all(snapshot.own or snapshot.ended for snapshot in snapshots):
                    break
                snapshots = self._snapshots(self._env.step([[] for _ in snapshots], step_mul=1))
            if self._config.map.endless:
                self._battle = Battle(snapshots[0])
            return self._with_abilities(snapshots)

    def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        """Play one plan of each player, step by step, all players in the same steps."""
        if self._ended:
            raise GameError("the episode is over: reset the game before you play on")
        players = [_Player(plan) for plan in plans]
        snapshots: tuple[Snapshot, ...] = ()
        env_steps = 0
        with explain_errors("the game died or broke its contract"):
            while any(player.step for player in players) and not self._ended:
                loops = min(player.step.loops for player in players if player.step)
                steps = self._env.step([player.actions() for player in players], step_mul=loops)
                env_steps += 1
                snapshots = self._snapshots(steps, snapshots)
                for player, snapshot in zip(players, snapshots, strict=True):
                    player.pass_loops(loops, snapshot)
            snapshots = self._with_abilities(snapshots)
        for player in players:
            player.close()
        return tuple(StepResult(s, p.played, env_steps) for s, p in zip(snapshots, players, strict=True))

    def whole(self) -> Snapshot | None:
        """Return the whole map as it is now, from the first player's place; None if the game does not show it.

        The request does not go through PySC2's `observe`, which keeps the last observation of a game that ends.
        """
        if self._ended or not self._lifts_fog:
            return None
        client = self._env._controllers[0]._client  # noqa: SLF001  # see above
        with explain_errors("the game died when it was asked for the whole map"):
            try:
                answer = client.send(observation=sc_pb.RequestObservation(disable_fog=True))
            except protocol.ProtocolError as error:
                log.warning("the game does not show the whole map; scenes have what the sides see: %s", error)
                self._lifts_fog = False
                return None
        seen = read_snapshot(answer, self._maps[0], through_fog=True)
        return seen if self._is_whole(seen) else None

    def _is_whole(self, seen: Snapshot) -> bool:
        """Return whether the game took the fog away: nothing is remembered, and an opponent had something at least."""
        units = seen.known.values()
        self._met_enemy = self._met_enemy or any(unit.is_enemy for unit in units)
        nobody_there = self._config.map.opponent is not None and not self._met_enemy
        return not nobody_there and not any(unit.is_remembered for unit in units)

    def kill(self) -> None:
        """Kill the game's processes; a call that waits for them fails then."""
        for process in self._env._sc2_procs or ():  # noqa: SLF001  # the only way to a process that hangs
            if process.running:
                process._proc.kill()  # noqa: SLF001

    def close(self) -> None:
        """End the game in good order; may be called twice."""
        with contextlib.suppress(Exception):  # it may be dead already, and then there is nothing to do
            self._env.close()

    def _snapshots(self, steps: Iterable[Any], before: Sequence[Snapshot] = ()) -> tuple[Snapshot, ...]:
        made = []
        for index, (step, info) in enumerate(zip(steps, self._maps, strict=True)):
            response: sc_pb.ResponseObservation = step.observation["_response_observation"]()
            earlier = before[index] if before else None
            made.append(
                read_snapshot(
                    response,
                    info,
                    functions=frozenset(int(number) for number in step.observation["available_actions"]),
                    dead=earlier.dead if earlier else frozenset(),
                    errors=earlier.errors if earlier else (),
                    ended=bool(step.last()),
                    creep=self._creep[index],
                )
            )
            self._creep[index] = made[-1].creep
            step.observation.clear()  # it is its own attributes, a circle that would keep 2 MB until a collection
        if self._battle:
            made[0] = self._battle.judge(made[0])
        self._ended = made[0].ended
        if made[0].outcome == "win" and self._env.forfeit:
            made[0] = dataclasses.replace(made[0], forfeit=self._env.forfeit)
        return tuple(made)

    def _with_abilities(self, snapshots: Sequence[Snapshot]) -> tuple[Snapshot, ...]:
        """Ask once for each player what its units can do; a finished game takes no questions."""
        if self._ended or not self._asks:
            return tuple(snapshots)
        controllers = self._env._controllers  # noqa: SLF001  # `SC2Env` has no query of its own
        return tuple(
            dataclasses.replace(snapshot, abilities=available(controller.query(question(snapshot))))
            for snapshot, controller in zip(snapshots, controllers, strict=True)
        )


class _Player:
    """One plan while it is played: its next step, and how much of that step has passed."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._fresh = True
        self.played = PlanResult()
        self.step: PlanStep | None = None
        self._advance(None)

    def actions(self) -> list[GameAction]:
        """Return the actions of the step, once."""
        fresh, self._fresh = self._fresh, False
        return list(self.step.actions) if self.step and fresh else []

    def pass_loops(self, loops: int, snapshot: Snapshot) -> None:
        """Count game loops that have passed; when the step is over, go on to the next one."""
        if self.step is None:
            return
        if self.step.loops > loops and not snapshot.ended:
            self.step = PlanStep(self.step.actions, self.step.loops - loops)
        else:
            self._advance(snapshot)

    def close(self) -> None:
        """End a plan that the end of the episode cut short."""
        self._plan.close()

    def _advance(self, snapshot: Snapshot | None) -> None:
        self._fresh = True
        try:
            self.step = next(self._plan) if snapshot is None else self._plan.send(snapshot)
        except StopIteration as done:
            self.step = None
            self.played = done.value


def _map_data(config: GameConfig) -> bytes:
    path: Path = config.sc2path / "Maps" / config.map.file
    try:
        return read_limited(path, MAX_MAP_BYTES)
    except FileNotFoundError:
        raise GameMissing(
            f"there is no map {config.map.file} in {config.sc2path / 'Maps'}: copy it there, or play with the simulator"
        ) from None
    except OSError as error:
        raise GameMissing(f"the map {path} cannot be read: {error.strerror}") from None
