"""SMAC's `StarCraft2Env` on the simulator, in this process: its methods, its numbers, without StarCraft II or PySC2.

    env = StarCraft2Env("3m", seed=1)
    obs, state = env.reset()
    reward, terminated, info = env.step([1, 1, 1])

The order of what happens is SMAC's own, down to the game loops in which an episode begins, so that the same seed and
actions make the same worlds as SMAC's package on the simulator's server. Above: the environments of other interfaces.
Below: `khala.env.numeric.features`, `khala.env.numeric.rewards`, `khala_simulator.battle`.
"""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala.env.numeric import rewards, sizes
from khala.env.numeric.features import FIRST_MOVE, FIRST_TARGET, MOVES, NO_OP, STOP, BattleScene, Board
from khala.env.numeric.forces import enemy_force, look, own_force
from khala.env.numeric.maps import smac_map
from khala.env.numeric.names import SmacNames
from khala.env.numeric.options import options_of
from khala_simulator.battle import Battle
from khala_simulator.tables.versions import DEFAULT_VERSION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from khala.env.numeric.forces import Force, OwnForce

    Bools = NDArray[np.bool_]
    Floats32 = NDArray[np.float32]

ATTACK, MOVE, STOP_ORDER, HEAL = 23, 16, 4, 386
_RESTART_LOOPS: Final = 2
_MOST_SEED = 2**31
PICTURE_PX: Final = (512, 512)


class StarCraft2Env(SmacNames):
    """One battle after the other on a SMAC map.

    Attributes:
        options: as given.
        n_agents, n_enemies, n_actions, episode_limit: as in SMAC.
        max_reward: of the best episode, before it is scaled; known after the first `reset`.
    """

    def __init__(self, map_name: str = "8m", *, episode_limit: int | None = None, **options: Any) -> None:
        """Take a map and options; nothing is started.

        Args:
            map_name: of SMAC's 23 maps.
            episode_limit: steps of an episode, if not those of SMAC.
            **options: see `khala.env.numeric.options.Options`.

        Raises:
            ConfigError: there is no such map, or an option has no such value.
        """
        self._spec = smac_map(map_name)
        self.map_name = map_name
        self.options = options_of(options)
        self.n_agents, self.n_enemies = self._spec.agents, self._spec.enemies
        self.n_actions = sizes.actions(self._spec)
        self.episode_limit = episode_limit or self._spec.limit
        self.max_reward = 0.0
        self.battles_won = self.battles_game = self.timeouts = 0
        self._seed = self.options.seed
        self._battle: Battle | None = None
        self._ended = False
        self._steps = 0
        self._last_action = np.zeros((self.n_agents, self.n_actions))
        self._codes = np.eye(self.n_actions)
        self._board: Board
        self._own: OwnForce
        self._enemy: Force
        self._scene: BattleScene

    @property
    def battle(self) -> Battle:
        """The running game.

        Raises:
            RuntimeError: there is none yet.
        """
        return self._require_battle()

    def _sides(self) -> tuple[OwnForce, Force]:
        self._require_battle()
        return self._own, self._enemy

    def _map(self) -> Board:
        self._require_battle()
        return self._board

    def _require_battle(self) -> Battle:
        if self._battle is None:
            raise RuntimeError("no episode has begun: call reset() first")
        return self._battle

    # playing ------------------------------------------------------------------------------------------------------

    def reset(self, *, seed: int | None = None) -> tuple[list[Floats32], Floats32]:
        """Begin an episode, and return `get_obs()` and `get_state()`.

        The game goes on from the episode before, over or not, and so does its chance. With a seed it is a new game.
        SMAC's package does so too, except before its first episode is over: then it starts another game from the seed.
        """
        if seed is not None:
            self._seed = seed
            self._battle = None
        self._steps = 0
        if self._battle is None:
            self._launch()
        else:
            self.battle.kill(np.concatenate([f.now.tag[f.alive] for f in (self._own, self._enemy)]).tolist())
            self.battle.advance(_RESTART_LOOPS)
            self.battle.forget_past()
        self._ended = False
        self._last_action = np.zeros_like(self._last_action)
        self._own, self._enemy = self._arrivals()
        self.max_reward = rewards.most_reward(self._enemy, self.options)
        self._look()
        return self.get_obs(), self.get_state()

    def _launch(self) -> None:
        seed = secrets.randbelow(_MOST_SEED) if self._seed is None else self._seed
        version = self.options.game_version or DEFAULT_VERSION
        name = f"SMAC_Maps/{self.map_name}"
        self._battle = Battle(name, seed=seed, difficulty=self.options.level, version=version)
        self._board = Board.of(self._battle.ground(), self.options.move_amount)

    def _arrivals(self) -> tuple[OwnForce, Force]:
        """Return both sides, once all units are there."""
        while True:
            own = own_force(self.battle, self._spec)
            enemy = enemy_force(self.battle, self._spec)
            if (len(own), len(enemy)) == (self.n_agents, self.n_enemies):
                return own, enemy
            self.battle.advance(1)

    def step(self, actions: Sequence[int] | NDArray[np.integer[Any]]) -> tuple[float, bool, dict[str, Any]]:
        """Play a step, and return the team's reward, whether the episode is over, and what happened in it.

        Args:
            actions: an available one for each agent: 0 for the dead, 1 to stop, 2 to 5 to move north, south, east or
                west, from 6 on to attack an enemy; a Medivac heals an ally instead.

        Raises:
            ValueError: an action is not available.
        """
        numbers = [int(action) for action in actions]
        self._check(numbers)
        self._last_action = self._codes[numbers]
        for agent, action in enumerate(numbers):
            self._order(agent, action)
        self.battle.advance(self.options.step_mul)
        self._steps += 1
        look(self.battle, self._own, self._enemy)
        self._look()
        return self._outcome()

    def _check(self, actions: Sequence[int]) -> None:
        if self._battle is None or self._ended:
            raise ValueError("the episode is over: call reset() first")
        if len(actions) != self.n_agents:
            raise ValueError(f"there are {len(actions)} actions for {self.n_agents} agents")
        for agent, action in enumerate(actions):
            if not (0 <= action < self.n_actions and self._scene.masks[agent, action]):
                can = np.flatnonzero(self._scene.masks[agent]).tolist()
                raise ValueError(f"agent {agent} cannot perform action {action}: it can perform {can}")

    def _order(self, agent: int, action: int) -> None:
        own = self._own
        tag = int(self._own.now.tag[agent])
        if action == NO_OP:
            return
        if action == STOP:
            self.battle.order(STOP_ORDER, tag)
        elif action < FIRST_TARGET:
            dx, dy = MOVES[action - FIRST_MOVE]
            far = self.options.move_amount
            point = float(own.now.x[agent]) + dx * far, float(own.now.y[agent]) + dy * far
            self.battle.order(MOVE, tag, point=point)
        elif own.heals[agent]:
            self.battle.order(HEAL, tag, target=int(own.now.tag[action - FIRST_TARGET]))
        else:
            self.battle.order(ATTACK, tag, target=int(self._enemy.now.tag[action - FIRST_TARGET]))

    def _look(self) -> None:
        self._scene = BattleScene(self._spec, self.options, self._board, self._own, self._enemy)

    def _outcome(self) -> tuple[float, bool, dict[str, Any]]:
        """Return what `step` returns, and count the battle if it is over."""
        own, enemy = self._own, self._enemy
        ending = rewards.ending_of(own, enemy)
        info: dict[str, Any] = {
            "battle_won": ending == "won",
            "dead_allies": int((~own.alive).sum()),
            "dead_enemies": int((~enemy.alive).sum()),
        }
        self.battles_won += ending == "won"
        timeout = ending is None and self._steps >= self.episode_limit
        if timeout:
            self.timeouts += 1
            if self.options.continuing_episode:
                info["episode_limit"] = True
        self._ended = timeout or ending is not None
        self.battles_game += self._ended
        reward = rewards.of_end(ending, self.options, rewards.of_battle(own, enemy, self.options))
        if self.options.reward_scale:
            reward /= self.max_reward / self.options.reward_scale_rate
        self.reward = reward
        return reward, self._ended, info

    @property
    def timed_out(self) -> bool:
        """Whether the episode ended at its limit, and not with the battle."""
        return self._ended and rewards.ending_of(self._own, self._enemy) is None

    # seeing -------------------------------------------------------------------------------------------------------

    @property
    def _progress(self) -> float:
        return self._steps / self.episode_limit

    def observations(self) -> Floats32:
        """Return [agents, size] what each agent sees."""
        return self._scene.observations(self._last_action, self._progress)

    def masks(self) -> Bools:
        """Return [agents, actions] which actions are available."""
        return self._scene.masks

    def possible(self, actions: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
        """Return the actions, with stop in place of each that is not available, and nothing for the dead."""
        available = self.masks()
        chosen: NDArray[np.int64] = np.where(available[np.arange(self.n_agents), actions], actions, STOP)
        return np.where(available[:, NO_OP], NO_OP, chosen)

    def get_obs(self) -> list[Floats32]:
        """Return what each agent sees."""
        return list(self.observations())

    def get_obs_agent(self, agent_id: int) -> Floats32:
        """Return what an agent sees."""
        seen: Floats32 = self.observations()[agent_id]
        return seen

    def get_obs_size(self) -> int:
        """Return the length of an observation, as SMAC counts it."""
        return sizes.observation(self._spec, self.options)

    def get_state(self) -> Floats32:
        """Return the state, for training alone."""
        return self._scene.state(self._last_action, self._progress)

    def get_state_size(self) -> int:
        """Return the length of the state."""
        return sizes.state(self._spec, self.options)

    def get_state_dict(self) -> dict[str, Any]:
        """Return the parts of the state by name."""
        allies, enemies = self._scene.state_parts()
        parts: dict[str, Any] = {"allies": allies, "enemies": enemies}
        if self.options.state_last_action:
            parts["last_action"] = self._last_action
        if self.options.state_timestep_number:
            parts["timestep"] = self._progress
        return parts

    def get_avail_actions(self) -> list[list[int]]:
        """Return 1 for each action that an agent may take and 0 for the others, by agent."""
        available: list[list[int]] = self.masks().astype(int).tolist()
        return available

    def get_avail_agent_actions(self, agent_id: int) -> list[int]:
        """Return the same of one agent."""
        return self.get_avail_actions()[agent_id]

    def get_total_actions(self) -> int:
        """Return the number of actions."""
        return self.n_actions

    def get_visibility_matrix(self) -> Bools:
        """Return [agents, agents + enemies] which units each agent sees; nobody sees itself."""
        return self._scene.in_sight()

    def get_unit_types(self) -> list[int]:
        """Return the game's type of each unit, agents first."""
        return [*self._own.now.type_id.tolist(), *self._enemy.now.type_id.tolist()]

    # about --------------------------------------------------------------------------------------------------------

    def get_env_info(self) -> dict[str, Any]:
        """Return sizes and the limit of an episode, and the names of a unit's values in the state."""
        agent, enemy = sizes.state_names(self._spec)
        return {
            "state_shape": self.get_state_size(),
            "obs_shape": self.get_obs_size(),
            "n_actions": self.n_actions,
            "n_agents": self.n_agents,
            "episode_limit": self.episode_limit,
            "agent_features": agent,
            "enemy_features": enemy,
        }

    def get_stats(self) -> dict[str, float]:
        """Return how many battles were won, and how many ended at the limit."""
        return {
            "battles_won": self.battles_won,
            "battles_game": self.battles_game,
            "battles_draw": self.timeouts,
            "win_rate": self.battles_won / max(self.battles_game, 1),
            "timeouts": self.timeouts,
            "restarts": 0,
        }

    def seed(self) -> int | None:
        """Return the seed of the game."""
        return self._seed

    def render(self, mode: str = "rgb_array") -> NDArray[np.uint8]:
        """Return a picture of the battle, [height, width, 3] RGB.

        Raises:
            ValueError: the mode is not `rgb_array`: there is no window.
        """
        if mode != "rgb_array":
            raise ValueError(f"mode {mode!r} is not there: 'rgb_array' returns a picture, and there is no window")
        return self.battle.picture(*PICTURE_PX)

    def close(self) -> None:
        """Forget the game."""
        self._battle = None
