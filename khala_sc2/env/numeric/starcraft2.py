"""SMAC's `StarCraft2Env` on the simulator, in this process: its methods, its numbers, without StarCraft II or PySC2.

    env = StarCraft2Env("3m", seed=1)
    obs, state = env.reset()
    reward, terminated, info = env.step([1, 1, 1])

The order of what happens is SMAC's own, down to the game loops in which an episode begins, so that the same seed and
actions make the same worlds as SMAC's package on the simulator's server. Above: the environments of other interfaces.
Below: `khala_sc2.env.numeric.forces`, `khala_sc2.env.numeric.rewards`, `khala_simulator.smac`,
`khala_simulator.battle`.
"""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from khala_sc2.env.numeric import rewards, sizes
from khala_sc2.env.numeric.forces import fighters_of
from khala_sc2.env.numeric.maps import smac_map
from khala_sc2.env.numeric.names import SmacNames
from khala_sc2.env.numeric.options import options_of
from khala_simulator.battle import Battle
from khala_simulator.smac.board import Board
from khala_simulator.smac.orders import give_orders
from khala_simulator.smac.rules import GOES_ON, NOTHING, WON
from khala_simulator.smac.scene import BattleScene, SceneLayout
from khala_simulator.tables.versions import DEFAULT_VERSION

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from khala_sc2.env.numeric.maps import SmacMap
    from khala_sc2.env.numeric.options import Options
    from khala_simulator.smac.fighters import Fighters

    Bools = NDArray[np.bool_]
    Floats32 = NDArray[np.float32]

_RESTART_LOOPS: Final = 2
_MOST_SEED = 2**31
_OVER: Final = "the episode is over: call reset() first"
PICTURE_PX: Final = (512, 512)


class BattleStep(NamedTuple):
    """What a step was worth, how the episode stands, and the dead of both sides."""

    reward: float
    terminated: bool
    """The battle is over."""
    truncated: bool
    """The episode ended at its limit."""
    battle_won: bool
    dead_allies: int
    dead_enemies: int
    elapsed: int
    """Steps of the episode."""

    @property
    def over(self) -> bool:
        """Whether the episode is over."""
        return self.terminated or self.truncated


BEGUN: Final = BattleStep(0.0, False, False, False, 0, 0, 0)
"""An episode before its first step."""


class StarCraft2Env(SmacNames):
    """One battle after the other on a SMAC map.

    Attributes:
        options: as given.
        n_agents, n_enemies, n_actions, episode_limit: as in SMAC.
        max_reward: of the best episode, before it is scaled; known after the first `reset`.
        over: whether the episode is over.
    """

    def __init__(self, map_name: str = "8m", *, episode_limit: int | None = None, **options: Any) -> None:
        """Take a map and options; nothing is started.

        Args:
            map_name: of SMAC's 23 maps.
            episode_limit: steps of an episode, if not those of SMAC.
            **options: see `khala_sc2.env.numeric.options.Options`.

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
        self._outcome = BEGUN
        self.over = False
        self._layout = _layout(self._spec, self.options, self.n_actions)
        self._board: Board
        self._scene: BattleScene

    @property
    def battle(self) -> Battle:
        """The running game.

        Raises:
            RuntimeError: there is none yet.
        """
        return self._require_battle()

    def _units(self) -> Fighters:
        self._require_battle()
        return self._scene.fighters

    def _map(self) -> Board:
        self._require_battle()
        return self._board

    def _last(self) -> NDArray[np.int64]:
        nothing = np.full(self.n_agents, NOTHING, dtype=np.int64)
        return nothing if self._battle is None else self._scene.last

    def _require_battle(self) -> Battle:
        if self._battle is None:
            raise RuntimeError("no episode has begun: call reset() first")
        return self._battle

    # playing ------------------------------------------------------------------------------------------------------

    def reset(self, *, seed: int | None = None) -> tuple[list[Floats32], Floats32]:
        """Begin an episode as `begin` does, and return `get_obs()` and `get_state()`."""
        self.begin(seed)
        return self.get_obs(), self.get_state()

    def begin(self, seed: int | None = None) -> None:
        """Begin an episode.

        The game goes on from the episode before, over or not, and so does its chance. With a seed it is a new game.
        SMAC's package does so too, except before its first episode is over: then it starts another game from the seed.
        """
        if seed is not None:
            self._seed = seed
            self._battle = None
        self._outcome = BEGUN
        self.over = False
        if self._battle is None:
            self._launch()
        else:
            fighters = self._scene.fighters
            self.battle.kill(fighters.tag[fighters.alive].tolist())
            self.battle.advance(_RESTART_LOOPS)
            self.battle.forget_past()
        fighters = self._arrivals()
        self.max_reward = rewards.most_reward(fighters, self.options)
        self._scene = BattleScene(self._layout, self._board, fighters)
        self._scene.look()

    def _launch(self) -> None:
        seed = secrets.randbelow(_MOST_SEED) if self._seed is None else self._seed
        version = self.options.game_version or DEFAULT_VERSION
        name = f"SMAC_Maps/{self.map_name}"
        self._battle = Battle(name, seed=seed, difficulty=self.options.level, version=version)
        self._board = Board.of(self._battle.ground(), self.options.move_amount)

    def _arrivals(self) -> Fighters:
        """Return both sides, once all units are there."""
        while (fighters := fighters_of(self.battle, self._spec)) is None:
            self.battle.advance(1)
        return fighters

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
        outcome = self.play(np.array(numbers))
        return outcome.reward, outcome.over, self.info()

    def play(self, actions: NDArray[np.int64]) -> BattleStep:
        """Play a step as `step` does; a unit stops in place of an action that is not available."""
        if self._battle is None or self.over:
            raise ValueError(_OVER)
        scene, battle = self._scene, self._battle
        scene.take(actions)
        give_orders(battle.world, scene.fighters, scene.last, self.options.move_amount)
        battle.advance(self.options.step_mul)
        scene.see(battle.world, battle.types)
        outcome = self._outcome = self._judge(scene.fighters)
        self.over = outcome.over
        self.reward = outcome.reward
        return outcome

    def info(self) -> dict[str, Any]:
        """Return what happened in the last step, as SMAC names it."""
        last = self._outcome
        info = {
            "battle_won": last.battle_won,
            "dead_allies": last.dead_allies,
            "dead_enemies": last.dead_enemies,
        }
        if last.truncated and self.options.continuing_episode:
            info["episode_limit"] = True
        return info

    def _check(self, actions: Sequence[int]) -> None:
        if self._battle is None or self.over:
            raise ValueError(_OVER)
        if len(actions) != self.n_agents:
            raise ValueError(f"there are {len(actions)} actions for {self.n_agents} agents")
        for agent, action in enumerate(actions):
            if not (0 <= action < self.n_actions and self._scene.masks[agent, action]):
                can = np.flatnonzero(self._scene.masks[agent]).tolist()
                raise ValueError(f"agent {agent} cannot perform action {action}: it can perform {can}")

    def _judge(self, fighters: Fighters) -> BattleStep:
        """Return what a step was worth and how it ended, and count the battle if it is over."""
        options = self.options
        ending = fighters.ending()
        ended = ending != GOES_ON
        steps = self._outcome.elapsed + 1
        timeout = not ended and steps >= self.episode_limit
        if ended or timeout:
            self.battles_won += ending == WON
            self.timeouts += timeout
            self.battles_game += 1
        reward = rewards.of_step(fighters, ending, options)
        if options.reward_scale:
            reward /= self.max_reward / options.reward_scale_rate
        return BattleStep(reward, ended, timeout, ending == WON, *fighters.counts(), steps)

    @property
    def steps(self) -> int:
        """Steps of the episode so far."""
        return self._outcome.elapsed

    @property
    def timed_out(self) -> bool:
        """Whether the episode ended at its limit, and not with the battle."""
        return self._outcome.truncated

    # seeing -------------------------------------------------------------------------------------------------------

    @property
    def _progress(self) -> float:
        return self._outcome.elapsed / self.episode_limit

    def see(self, observations: Floats32, state: Floats32) -> None:
        """Write [agents, size] what each agent sees, and [size] the state, into contiguous arrays of these sizes."""
        progress = self._progress
        self._scene.observe(observations, progress)
        self._scene.describe(state, progress)

    def show(self, observations: Floats32, state: Floats32, masks: NDArray[np.int8]) -> None:
        """Do as `see`, and write [agents, actions] which actions are available."""
        self._scene.show(observations, state, masks, self._progress)

    def observations(self) -> Floats32:
        """Return [agents, size] what each agent sees."""
        seen = np.empty((self.n_agents, sizes.seen(self._spec, self.options)), dtype=np.float32)
        self._scene.observe(seen, self._progress)
        return seen

    def masks(self) -> Bools:
        """Return [agents, actions] which actions are available."""
        return self._scene.masks

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
        state = np.empty(sizes.whole_state(self._spec, self.options), dtype=np.float32)
        self._scene.describe(state, self._progress)
        return state

    def get_state_size(self) -> int:
        """Return the length of the state."""
        return sizes.state(self._spec, self.options)

    def get_state_dict(self) -> dict[str, Any]:
        """Return the parts of the state by name."""
        allies, enemies = self._scene.units()
        parts: dict[str, Any] = {"allies": allies, "enemies": enemies}
        if self.options.state_last_action:
            parts["last_action"] = self.last_action
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
        scene = self._scene
        seen: Bools = scene.seen & scene.fighters.alive[: self.n_agents, None]
        np.fill_diagonal(seen, val=False)
        return seen

    def get_unit_types(self) -> list[int]:
        """Return the game's type of each unit, agents first."""
        types: list[int] = self._units().type_id.tolist()
        return types

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


def _layout(spec: SmacMap, options: Options, actions: int) -> SceneLayout:
    """Return what observations and states consist of."""
    own_shields, enemy_shields = (race == "P" for race in spec.races)
    return SceneLayout(
        actions=actions,
        move_amount=options.move_amount,
        own_shields=own_shields,
        enemy_shields=enemy_shields,
        obs_all_health=options.obs_all_health,
        obs_own_health=options.own_health,
        obs_last_action=options.obs_last_action,
        obs_pathing_grid=options.obs_pathing_grid,
        obs_terrain_height=options.obs_terrain_height,
        obs_timestep_number=options.obs_timestep_number,
        obs_instead_of_state=options.obs_instead_of_state,
        state_last_action=options.state_last_action,
        state_timestep_number=options.state_timestep_number,
    )
