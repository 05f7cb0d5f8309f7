"""Environments of PySC2 whose opponent has a client of the game of its own: a guest that comes, or a host to go to.

`SC2Env` joins the players of a game only if all of them are its own, and `LanSC2Env` of PySC2 4.0.0 fails at its first
reset. Here `SC2Env` keeps one agent, and only how the game is created and joined is different. Both clients then step,
each by its own stride: a client gets ahead of the other one by no game loop.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.compat import features, run_configs, sc2_env
from khala_bridge.errors import GameError
from khala_bridge.game.env import Env, start
from khala_bridge.game.invitation import Invitation
from khala_bridge.game.lan import LanGame
from khala_bridge.game.manners import LanPorts
from khala_bridge.game.ports import pick_port, pick_ports
from khala_bridge.game.processes import environment_of

if TYPE_CHECKING:
    from khala_bridge.game.game import GameConfig
    from khala_bridge.game.guest import Guest
    from khala_bridge.game.processes import Processes
    from khala_bridge.state import Forfeit


def env_of(config: GameConfig, processes: Processes | None, invitation: Invitation | None) -> Any:
    """Return the environment of a game, started; arguments and errors as in `PySC2Game`."""
    kinds: dict[str, type[Env]] = {"guest": GuestEnv, "lan": LanEnv}
    try:
        if (kind := kinds.get(config.opponent.kind)) is None:
            return start(object.__new__(Env), config, processes)
        return start(object.__new__(kind), config, invitation or Invitation())
    finally:
        if processes is not None:
            processes.began()


class _MeetingEnv(Env):
    """One agent in one process of the game, which meets another client of the game on LAN ports."""

    _lan_ports: LanPorts

    def __init__(self, config: GameConfig, invitation: Invitation) -> None:
        self._invitation = invitation
        super().__init__(config)

    def _meet(self, join: sc_pb.RequestJoinGame) -> None:
        """Join the game together with the other client."""
        raise NotImplementedError

    def _launch_game(self) -> None:
        self._run_config.env = environment_of(self._run_config, self._config.environment)
        (interface,) = self._interface_options
        ports = list(self._lan_ports[2:])
        draws = interface.HasField("render")
        process = self._run_config.start(extra_ports=ports, want_rgb=draws, port=pick_port())
        self._sc2_procs, self._controllers = [process], [process.controller]
        process.controller._client._sock.settimeout(None)  # noqa: SLF001  # `GamePatience` says how long a step may take

    def _create_join(self) -> None:
        """Join the game, and set what `SC2Env` wants to know of it."""
        (played,) = self._maps
        self._map_name, self._step_mul = played.name, played.step_mul
        self._score_index, self._score_multiplier = played.score_index, played.score_multiplier
        self._episode_length = self._config.limit_loops or sc2_env.MAX_STEP_COUNT
        join = sc_pb.RequestJoinGame(options=self._interface_options[0], player_name=self._players[0].name)
        join.race = self._players[0].race[0]
        self._lan_ports.write(join)
        self._meet(join)
        info = self._controllers[0].game_info()
        self._game_info = [info]
        self._features = [
            features.features_from_game_info(
                game_info=info, agent_interface_format=self._interface_formats[0], map_name=self._map_name
            )
        ]
        self._requested_races = {player.player_id: player.race_requested for player in info.player_info}


class GuestEnv(_MeetingEnv):
    """A game that Khala creates, and to which a bot comes by the convention of ladders."""

    _guest: Guest | None = None

    @property
    def met(self) -> str:  # type: ignore[override]  # known when it has joined
        """Who the guest says it is."""
        return self._guest.name if self._guest else ""

    @property
    def forfeit(self) -> Forfeit | None:  # type: ignore[override]  # it may go away at any time
        """How the guest went away."""
        return self._guest.forfeit if self._guest else None

    def close(self) -> None:
        """End the game, the guest's last: it reads its result first."""
        guest, self._guest = self._guest, None
        if guest is not None:
            guest.close(farewell=self._over)
        super().close()

    def _launch_game(self) -> None:
        self._ports = pick_ports(len(LanPorts._fields))
        self._lan_ports = LanPorts(*self._ports)
        super()._launch_game()

    def _meet(self, join: sc_pb.RequestJoinGame) -> None:
        from khala_bridge.game.guest import Guest  # noqa: PLC0415  # aiohttp: 0.3 s, for guests alone

        (host,) = self._controllers
        theirs = self._run_config.start(extra_ports=list(self._lan_ports[2:]), want_rgb=False, port=pick_port())
        self._sc2_procs = [self._sc2_procs[0], theirs]
        self._guest = guest = Guest(theirs, self._lan_ports, self._config.opponent, self._invitation)
        data = self._maps[0].data(self._run_config)
        for controller in (host, theirs.controller):
            controller.save_map(self._maps[0].path, data)
        host.create_game(self._create_request())
        environment = self._config.environment
        guest.invite(None if environment is None else environment | {"SC2PATH": str(self._config.sc2path)})
        self._parallel.run([(host.join_game, join), guest.until_joined])

    def _create_request(self) -> sc_pb.RequestCreateGame:
        create = sc_pb.RequestCreateGame(local_map=sc_pb.LocalMap(map_path=self._maps[0].path))
        if self._random_seed is not None:
            create.random_seed = self._random_seed
        for _ in range(2):
            create.player_setup.add(type=sc_pb.Participant)
        return create

    def _restart(self) -> None:
        """Begin again with a new process of the guest: a bot of a ladder plays one game."""
        assert self._guest is not None
        self._guest.close(farewell=self._over)
        self._controllers[0].leave()
        self._create_join()

    @property
    def _over(self) -> bool:
        return any(seen is not None and seen.player_result for seen in getattr(self, "_obs", ()))


class LanEnv(_MeetingEnv):
    """A game that somebody else hosts, as PySC2's `play_vs_agent --human` does."""

    _lan: LanGame | None = None

    def close(self) -> None:
        """Leave the game."""
        lan, self._lan = self._lan, None
        super().close()
        if lan is not None:
            lan.close()

    def _launch_game(self) -> None:
        self._lan = lan = LanGame(self._config.opponent, self._config.map.name, self._invitation)
        self._check(lan)
        self._realtime, self._lan_ports = lan.realtime, lan.ports
        self._ports: list[int] = []
        self._run_config = run_configs.get(version=lan.game_version)
        super()._launch_game()

    def _check(self, lan: LanGame) -> None:
        own = hashlib.sha256(self._maps[0].data(self._run_config)).digest()
        if hashlib.sha256(lan.map_data).digest() != own:
            raise GameError(
                f"the game at {self._config.opponent.at} is on the map {lan.map_name}, but the task "
                f"is on another map, or on another version of it: {self._config.map.file}"
            )
        if lan.realtime and not self._config.realtime:
            raise GameError(
                f"the game at {self._config.opponent.at} goes on in real time: play with --clock realtime, or host it "
                "without --realtime"
            )

    def _meet(self, join: sc_pb.RequestJoinGame) -> None:
        assert self._lan is not None
        (controller,) = self._controllers
        controller.save_map(self._lan.map_path, self._lan.map_data)
        joined = controller.join_game(join)
        names = {player.player_id: player for player in controller.game_info().player_info}
        del names[joined.player_id]
        for other in names.values():
            race = common_pb2.Race.Name(other.race_requested).lower()
            self.met = f"player {other.player_name or 'without a name'} over LAN, {race}"

    def _restart(self) -> None:
        raise GameError("a game over LAN is played once: its host has to begin the next one")
