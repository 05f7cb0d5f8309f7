"""What can be set of a numeric environment: the names and the defaults of SMAC's `StarCraft2Env`."""

from __future__ import annotations

from dataclasses import dataclass

from khala_protocol.errors import ConfigError

LEVELS = "123456789A"
"""SMAC's names of the computer player's levels, the easiest first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options of observations, states, rewards and the game."""

    step_mul: int = 8
    """Game loops of a step."""
    move_amount: float = 2
    """How far a unit is ordered to move, in world units."""
    difficulty: str = "7"
    """Level of the computer player: 1 to 9, or A."""
    seed: int | None = None
    """Of the game; None: another one each time."""
    continuing_episode: bool = False
    """Whether `info` says that an episode ended at its limit."""
    obs_all_health: bool = True
    """Observations have the health of all units in sight."""
    obs_own_health: bool = True
    """Observations have the agent's own health; always, with `obs_all_health`."""
    obs_last_action: bool = False
    """Observations have the last actions of allies in sight."""
    obs_pathing_grid: bool = False
    """Observations have whether 8 points around can be walked on."""
    obs_terrain_height: bool = False
    """Observations have the height of 9 points around."""
    obs_instead_of_state: bool = False
    """The state is the observations of all agents, one after the other."""
    obs_timestep_number: bool = False
    """Observations end with the part of the episode that is over."""
    state_last_action: bool = True
    """The state has the last actions of all agents."""
    state_timestep_number: bool = False
    """The state ends with the part of the episode that is over."""
    reward_sparse: bool = False
    """1 for a win, -1 for a defeat, and nothing else."""
    reward_only_positive: bool = True
    """What enemies do to the agents costs nothing."""
    reward_death_value: float = 10
    """For a killed enemy; without `reward_only_positive` also against a killed agent."""
    reward_win: float = 200
    reward_defeat: float = 0
    reward_negative_scale: float = 0.5
    """Weight of losses, without `reward_only_positive`."""
    reward_scale: bool = True
    """Divide by the reward of the best episode, and multiply by `reward_scale_rate`."""
    reward_scale_rate: float = 20

    def __post_init__(self) -> None:
        if self.difficulty not in LEVELS or len(self.difficulty) != 1:
            raise ConfigError(f"difficulty {self.difficulty!r} is not a level: give one of {', '.join(LEVELS)}")
        if self.step_mul < 1:
            raise ConfigError(f"step_mul is {self.step_mul}: a step has at least one game loop")

    @property
    def level(self) -> int:
        """The API's number of the computer player's level."""
        return LEVELS.index(self.difficulty) + 1

    @property
    def own_health(self) -> bool:
        """Whether an observation has the agent's own health."""
        return self.obs_all_health or self.obs_own_health
