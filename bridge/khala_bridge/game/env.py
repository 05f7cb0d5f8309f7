"""How PySC2's environment is started: which process of the game, which map and players.

Above: `khala_bridge.game.pysc2_game`, which plays in it, and `khala_bridge.game.meeting`, whose environments share the
game with a player that is not Khala's. Below: `khala_bridge.game.processes`.
"""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from absl import flags

from khala_bridge.compat import maps, sc2_env
from khala_bridge.game.ports import pick_port, pick_ports
from khala_bridge.game.processes import environment_of, explain_errors, new_process, pointed_to, settle_flags

if TYPE_CHECKING:
    from khala_bridge.game.game import GameConfig
    from khala_bridge.game.processes import Processes
    from khala_bridge.state import Forfeit
    from khala_bridge.task.maps import MapSpec


class Env(sc2_env.SC2Env):  # type: ignore[misc]  # PySC2 is untyped
    """`SC2Env` whose game gets an environment of its own, where PySC2 passes on ours, with every key that is in it."""

    met = ""
    """Who the opponent says it is; "" if the task knows it."""
    forfeit: Forfeit | None = None
    """How the opponent went away."""
    _ports: list[int]
    _is_alone = False
    """Whether its process is one that any game for one player can use."""
    _processes: Processes | None = None

    def __init__(self, config: GameConfig, processes: Processes | None = None) -> None:
        """Start the game; arguments as in `PySC2Game`."""
        self._config = config
        self._processes = processes
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
        if self._num_agents > 1 or draws:  # several players have ports in their command lines
            self._run_config.env = environment_of(self._run_config, self._config.environment)
            self._ports = pick_ports(2 * self._num_agents) if self._num_agents > 1 else []
            self._sc2_procs = [
                self._run_config.start(extra_ports=self._ports, want_rgb=interface.HasField("render"), port=pick_port())
                for interface in self._interface_options
            ]
            self._controllers = [process.controller for process in self._sc2_procs]
            return
        process = self._processes and self._processes.take(self._config.sc2path)
        process = process or new_process(self._config.sc2path, self._config.environment)
        self._is_alone = True
        self._ports = []
        self._sc2_procs = [process]
        self._controllers = [process.controller]

    def close(self) -> None:
        """End the game, and its process, unless that is kept for the next game."""
        if self._is_alone and self._sc2_procs and self._processes:
            (process,) = self._sc2_procs
            if self._processes.keep(process, self._config.sc2path):
                self._sc2_procs, self._controllers = [], []
        super().close()


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


def start(env: Env, config: GameConfig, *given: Any) -> Any:
    """Return an environment that is ready to be reset.

    Args:
        env: one that is made, but not initialised: a start that fails leaves no process.
        config: which game, and how.
        given: what its kind takes in addition.
    """
    settle_flags()
    flags.FLAGS["sc2_timeout"].value = config.start_timeout_s
    try:
        with pointed_to(config.sc2path), explain_errors("the game could not be started"):
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
