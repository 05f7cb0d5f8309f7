"""How PySC2's environment is started: which install, which process of the game, which map and players.

Above: `khala_bridge.game.pysc2_game`, which plays in it, and `khala_bridge.game.meeting`, whose environments share the
game with a player that is not Khala's.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from absl import flags

from khala_bridge.compat import maps, remote_controller, run_configs, sc2_env
from khala_bridge.errors import GameError
from khala_bridge.game.game import GameConfig, check_install

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_bridge.state import Forfeit
    from khala_bridge.task.maps import MapSpec

_environment = threading.RLock()
_LISTENS_AFTER_S = 0.2
"""The simulator listens 0.05 s after its start, 0.15 s on a busy machine. Who comes later waits for a second more."""


class Launched:
    """A process of the game that has no map yet: it takes any, and so can be started before the match is known.

    PySC2 tries to connect as soon as it has started a process, is refused, and sleeps for a second. Here it connects
    when the process is taken, which most often listens by then.
    """

    def __init__(self, sc2path: Path, environment: dict[str, str] | None = None) -> None:
        """Start the process; arguments and errors as in `GameConfig` and `PySC2Game`."""
        check_install(sc2path)
        _settle_flags()
        with _sc2path(sc2path), explained("the game could not be started"):
            run_config = run_configs.get()
            run_config.env = environment_of(run_config, environment)
            self._process: Any = run_config.start(want_rgb=False, connect=False)
        self._started_s = time.monotonic()

    def take(self) -> Any:
        """Return the process, connected, once, and only if it still runs; the taker ends it."""
        process, self._process = self._process, None
        if process is None or not process.running:
            return None
        time.sleep(max(0.0, self._started_s + _LISTENS_AFTER_S - time.monotonic()))
        try:  # as `StarcraftProcess` does
            process._controller = remote_controller.RemoteController(process.host, process.port, process)  # noqa: SLF001
        except BaseException:
            process.close()
            raise
        return process

    def close(self) -> None:
        """End the process, if nobody took it."""
        process, self._process = self._process, None
        if process is not None:
            process.close()


class Env(sc2_env.SC2Env):  # type: ignore[misc]  # PySC2 is untyped
    """`SC2Env` whose game gets an environment of its own, where PySC2 passes on ours, with every key that is in it."""

    met = ""
    """Who the opponent says it is; "" if the task knows it."""
    forfeit: Forfeit | None = None
    """How the opponent went away."""

    def __init__(self, config: GameConfig, launched: Launched | None = None) -> None:
        """Start the game; arguments as in `PySC2Game`."""
        self._config = config
        self._launched = launched
        super().__init__(
            map_name=Map(config.map),
            players=_players(config),
            agent_interface_format=_interface(config),
            game_steps_per_episode=config.limit_loops,
            random_seed=config.seed,
            ensure_available_actions=False,
        )

    def _launch_game(self) -> None:
        draws = any(interface.HasField("render") for interface in self._interface_options)
        alone = self._num_agents == 1 and not draws  # several players have ports in their command lines
        if not alone:
            self._run_config.env = environment_of(self._run_config, self._config.environment)
            super()._launch_game()
            return
        process = self._launched and self._launched.take()
        process = process or Launched(self._config.sc2path, self._config.environment).take()
        if process is None:
            raise GameError("the game could not be started: it ended before it listened")
        self._ports: list[int] = []
        self._sc2_procs = [process]
        self._controllers = [process.controller]


class Map(maps.Map):  # type: ignore[misc]  # PySC2 is untyped
    """A map as PySC2 takes it. The class has no file name, which keeps it out of PySC2's global table of maps."""

    def __init__(self, spec: MapSpec) -> None:
        file = PurePosixPath(spec.file)
        self.players = 1 if spec.opponent is None else 2
        self._name = spec.name
        self.directory = str(file.parent)
        self.filename = file.name

    @property
    def name(self) -> str:
        """Its name in the table of maps."""
        return self._name


def environment_of(run_config: Any, environment: dict[str, str] | None) -> dict[str, str] | None:
    """Return the environment of a process of the game, in which it finds its libraries."""
    ours: dict[str, str] | None = run_config.env  # on Linux, with the libraries of the game
    if environment is None:
        return ours
    return environment | {name: (ours or {})[name] for name in ("LD_LIBRARY_PATH",) if name in (ours or {})}


def _settle_flags() -> None:
    if not flags.FLAGS.is_parsed():  # PySC2 reads absl flags; it needs their defaults, not our command line
        flags.FLAGS.mark_as_parsed()


def started(env: Env, config: GameConfig, *given: Any) -> Any:
    """Return an environment that is ready to be reset.

    Args:
        env: one that is made, but not initialised: a start that fails leaves no process.
        config: which game, and how.
        given: what its kind takes in addition.
    """
    _settle_flags()
    flags.FLAGS["sc2_timeout"].value = config.start_timeout_s
    try:
        with _sc2path(config.sc2path), explained("the game could not be started"):
            env.__init__(config, *given)  # type: ignore[misc]  # see above
    except BaseException:
        env.close()
        raise
    return env


def _interface(config: GameConfig) -> Any:
    pictures = config.render_px and sc2_env.Dimensions(screen=config.render_px, minimap=config.render_px)
    return sc2_env.AgentInterfaceFormat(
        feature_dimensions=sc2_env.Dimensions(screen=config.screen_px, minimap=config.minimap_px),
        rgb_dimensions=pictures or None,
        action_space=sc2_env.ActionSpace.FEATURES,
        camera_width_world_units=config.camera_width,
        use_feature_units=True,
        use_raw_units=True,
        send_observation_proto=True,
        hide_specific_actions=False,  # a general action would do what the unit can, not what the call says
    )


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
def explained(what: str) -> Iterator[None]:
    """Turn any exception of PySC2 into an error for the user; they have no common base class."""
    try:
        yield
    except GameError:
        raise
    except Exception as error:
        detail = " ".join(str(error).split()) or type(error).__name__
        raise GameError(f"{what}: {detail}") from error
