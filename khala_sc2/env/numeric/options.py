"""What can be set of a numeric environment: the names and the defaults of SMAC's `StarCraft2Env`."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final

from khala_protocol.errors import ConfigError
from khala_simulator.tables.versions import BUILD_OF_VERSION

if TYPE_CHECKING:
    from collections.abc import Mapping

LEVELS = "123456789A"
"""SMAC's names of the computer player's levels, the easiest first."""


_PACKAGE: Final = "SMAC's own package plays on the simulator as well, see docs/how-to/train.md"
_INSTEAD: Final = {
    "heuristic_ai": f"step() takes the actions of your agents; {_PACKAGE}",
    "replay_dir": f"no replay is written; {_PACKAGE}",
    "replay_prefix": f"no replay is written; {_PACKAGE}",
    "window_size_x": "there is no window, and render() returns a picture of one size",
    "window_size_y": "there is no window, and render() returns a picture of one size",
    "debug": "nothing is logged; get_obs(), get_state() and get_avail_actions() return what you can log",
}
"""What to do instead of what other values of these options would mean."""
_SMACV2: Final = frozenset({
    "action_mask", "capability_config", "conic_fov", "fully_observable", "kill_unit_step_mul", "min_attack_range",
    "num_fov_actions", "obs_own_pos", "obs_starcraft", "prob_obs_enemy", "use_unit_ranges",
})  # fmt: skip


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
    game_version: str | None = None
    """The version whose tables the game has: 4.10 or 5.0.13; None: 4.10."""
    heuristic_rest: bool = False
    """Ignored, as in SMAC without `heuristic_ai`."""
    heuristic_ai: bool = False
    """Only False, and of the following only the default: they are here because files of settings name them."""
    replay_dir: str | None = ""
    replay_prefix: str | None = ""
    window_size_x: int = 1920
    window_size_y: int = 1200
    debug: bool = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in _INSTEAD and value not in (field.default, None):
                raise ConfigError(
                    f"{field.name} is {value!r} and can only be {field.default!r}: {_INSTEAD[field.name]}"
                )
        if self.game_version not in (None, *BUILD_OF_VERSION):
            known = " and ".join(BUILD_OF_VERSION)
            raise ConfigError(
                f"there are no tables of game_version {self.game_version!r}, only of {known}: leave it out"
            )
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


def options_of(given: Mapping[str, Any]) -> Options:
    """Return options from keyword arguments.

    Raises:
        ConfigError: there is no such option, or it has no such value.
    """
    known = {field.name for field in fields(Options)}
    for name in given:
        if name in _SMACV2:
            raise ConfigError(
                f"{name} is an option of SMACv2: play its own package on the simulator, see docs/how-to/train.md"
            )
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1)
            raise ConfigError(f"there is no option {name!r}{f': did you mean {close[0]}?' if close else ''}")
    return Options(**given)
