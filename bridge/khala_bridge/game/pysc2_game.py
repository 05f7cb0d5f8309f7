"""A game on PySC2: plans drive the unmodified `SC2Env`.

PySC2 starts the game that SC2PATH names, speaks its API and checks inputs and outputs. Here its observations become
snapshots, and its exceptions become a `GameError` that says what to do. The proto of an observation is kept, since
only it has positions in world units. This module knows no agent, no team and no text.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import os
import threading
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from absl import flags

from khala_bridge.act.plan import PlanStep, Played
from khala_bridge.catalogue.functions import check_against_pysc2
from khala_bridge.compat import maps, run_configs, sc2_env
from khala_bridge.errors import GameError, GameMissing
from khala_bridge.game.game import GameConfig, GameIdentity, StepResult, check_install
from khala_bridge.state import read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_protocol.files import MB, read_limited

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.act.plan import GameAction, Plan
    from khala_bridge.state import EpisodeInfo, Snapshot
    from khala_bridge.task.maps import MapSpec

_PLACING_LOOPS = 16
"""Loops that a map's script may take until it places the first unit; the battles need none or one."""
MAX_MAP_BYTES = 64 * MB
"""The largest map of the game's ladder has 6 MB."""
_environment = threading.Lock()


class PySC2Game:
    """One player against the computer, or two against each other, on `SC2Env`.

    Two players have two processes of the game, which PySC2 joins over LAN ports of this machine.
    """

    def __init__(self, config: GameConfig, launched: Launched | None = None) -> None:
        """Start the game.

        Args:
            config: which game, and how.
            launched: a process of this install that is there already; used if it fits, ended if not.

        Raises:
            GameMissing: there is no game or no such map in the install.
            GameError: it could not be started.
            CatalogueError: the functions of this PySC2 are not those of the text actions.
        """
        self._config = config
        self._asks = config.abilities
        self._episode = 0
        self._ended = True
        self._maps: tuple[EpisodeInfo, ...] = ()
        check_against_pysc2()
        check_install(config.sc2path)
        map_data = _map_data(config)
        self._env = _start(config, launched)
        with _explained("the game could not be asked for its version"):
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
        return self._info

    def reset(self) -> tuple[Snapshot, ...]:
        """Begin an episode, and wait for the map's script to place its units."""
        with _explained("a new episode could not be begun"):
            if self._config.seed is not None:
                # `SC2Env` would begin every episode with the same seed, and has no parameter for another one
                self._env._random_seed = self._config.seed + self._episode  # noqa: SLF001
            steps = self._env.reset()
            self._episode += 1
            self._maps = tuple(map(read_info, self._env.game_info))
            snapshots = self._snapshots(steps)
            for _ in range(_PLACING_LOOPS):
                if all(snapshot.own or snapshot.ended for snapshot in snapshots):
                    break
                snapshots = self._snapshots(self._env.step([[] for _ in snapshots], step_mul=1))
            return self._with_abilities(snapshots)

    def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        """Play one plan of each player, step by step, all players in the same steps."""
        if self._ended:
            raise GameError("the episode is over: the game has to be reset before it is played on")
        players = [_Player(plan) for plan in plans]
        snapshots: tuple[Snapshot, ...] = ()
        env_steps = 0
        with _explained("the game died or broke its contract"):
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
                )
            )
        self._ended = made[0].ended
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


class Launched:
    """A process of the game that has no map yet: it takes any, and so can be started before the match is known."""

    def __init__(self, sc2path: Path, environment: dict[str, str] | None = None) -> None:
        """Start the process; arguments and errors as in `GameConfig` and `PySC2Game`."""
        check_install(sc2path)
        _settle_flags()
        with _sc2path(sc2path), _explained("the game could not be started"):
            run_config = run_configs.get()
            run_config.env = _environment_of(run_config, environment)
            self._process: Any = run_config.start(want_rgb=False)

    def take(self) -> Any:
        """Return the process, once, and only if it still runs; the taker ends it."""
        process, self._process = self._process, None
        return process if process is not None and process.running else None

    def close(self) -> None:
        """End the process, if nobody took it."""
        if (process := self.take()) is not None:
            process.close()


class _Env(sc2_env.SC2Env):  # type: ignore[misc]  # PySC2 is untyped
    """`SC2Env` whose game gets an environment of its own, where PySC2 passes on ours, with every key that is in it."""

    environment: dict[str, str] | None = None
    launched: Launched | None = None

    def _launch_game(self) -> None:
        draws = any(interface.HasField("render") for interface in self._interface_options)
        alone = self._num_agents == 1 and not draws  # several players have ports in their command lines
        if self.launched is not None and alone and (process := self.launched.take()) is not None:
            self._ports: list[int] = []
            self._sc2_procs = [process]
            self._controllers = [process.controller]
            return
        self._run_config.env = _environment_of(self._run_config, self.environment)
        super()._launch_game()


class _Map(maps.Map):  # type: ignore[misc]  # PySC2 is untyped
    """A map as PySC2 takes it. The class has no file name, which keeps it out of PySC2's global table of maps."""

    def __init__(self, spec: MapSpec) -> None:
        file = PurePosixPath(spec.file)
        self.players = 1 if spec.opponent is None else 2
        self._name = spec.name
        self.directory = str(file.parent)
        self.filename = file.name

    @property
    def name(self) -> str:
        return self._name


class _Player:
    """One plan while it is played: its next step, and how much of that step has passed."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._fresh = True
        self.played = Played()
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
            self.step, self.played = None, done.value


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


def _environment_of(run_config: Any, environment: dict[str, str] | None) -> dict[str, str] | None:
    ours: dict[str, str] | None = run_config.env  # on Linux, with the libraries of the game
    if environment is None:
        return ours
    return environment | {name: (ours or {})[name] for name in ("LD_LIBRARY_PATH",) if name in (ours or {})}


def _settle_flags() -> None:
    if not flags.FLAGS.is_parsed():  # PySC2 reads absl flags; it needs their defaults, not our command line
        flags.FLAGS.mark_as_parsed()


def _start(config: GameConfig, launched: Launched | None = None) -> Any:
    pictures = config.render_px and sc2_env.Dimensions(screen=config.render_px, minimap=config.render_px)
    interface = sc2_env.AgentInterfaceFormat(
        feature_dimensions=sc2_env.Dimensions(screen=config.screen_px, minimap=config.minimap_px),
        rgb_dimensions=pictures or None,
        action_space=sc2_env.ActionSpace.FEATURES,
        camera_width_world_units=config.camera_width,
        use_feature_units=True,
        use_raw_units=True,
        send_observation_proto=True,
        hide_specific_actions=False,  # a general action would do what the unit can, not what the call says
    )
    _settle_flags()
    flags.FLAGS["sc2_timeout"].value = config.start_timeout_s
    env: Any = object.__new__(_Env)  # kept while it starts, so that a start that fails leaves no process
    env.environment, env.launched = config.environment, launched
    try:
        with _sc2path(config.sc2path), _explained("the game could not be started"):
            env.__init__(
                map_name=_Map(config.map),
                players=_players(config),
                agent_interface_format=interface,
                game_steps_per_episode=config.limit_loops,
                random_seed=config.seed,
                ensure_available_actions=False,
            )
    except BaseException:
        env.close()
        raise
    finally:
        if launched is not None:
            launched.close()
    return env


def _players(config: GameConfig) -> list[Any]:
    """Return the players as PySC2 takes them; it starts a process of the game for each agent."""
    spec = config.map
    players: list[Any] = [sc2_env.Agent(sc2_env.Race[spec.race], "Khala")]
    if spec.opponent is None:
        return players
    race = sc2_env.Race[spec.opponent]
    if config.players == 2:
        return [*players, sc2_env.Agent(race, "Khala")]
    # PySC2 would draw the build `random` from Python's own generator
    return [*players, sc2_env.Bot(race, sc2_env.Difficulty[spec.difficulty], sc2_env.BotBuild.macro)]


@contextlib.contextmanager
def _sc2path(directory: Path) -> Iterator[None]:
    """Point SC2PATH to this install; PySC2 reads it once, while it starts."""
    with _environment:
        before = os.environ.get("SC2PATH")
        os.environ["SC2PATH"] = str(directory)
        try:
            yield
        finally:
            if before is None:
                del os.environ["SC2PATH"]
            else:
                os.environ["SC2PATH"] = before


@contextlib.contextmanager
def _explained(what: str) -> Iterator[None]:
    """Turn any exception of PySC2 into an error for the user; they have no common base class."""
    try:
        yield
    except GameError:
        raise
    except Exception as error:
        detail = " ".join(str(error).split()) or type(error).__name__
        raise GameError(f"{what}: {detail}") from error
