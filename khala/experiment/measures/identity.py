"""Which episode a row is about, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Identity:
    """Episode and result. A row is found by `run`, `episode` and `side`."""

    run: str
    """Name of the run."""
    task: str
    """Name of the task."""
    side: str
    """The side that the numbers are about."""
    episode: int
    """Number of the episode in its run, from 0."""
    seed: int
    """Seed of the episode: that of the run card, and 1 more for each episode."""
    map: str
    """Name of the map."""
    game: str
    """The game and its version, as on the run card."""
    clock: str
    """Rule of the clock: `frozen`, `budget`, `token` or `realtime`."""
    opponent: str
    """Who the side played against, in words."""
    outcome: str
    """`win`, `draw`, `loss`, `aborted` by the host, or `unfinished` if the recording has no result of the episode."""
    cause: str
    """Why it ended, such as `enemy defeated`; empty if it is unfinished."""
    valid: bool
    """Whether the episode says something about its agents; false if it is unfinished."""
    invalid_because: str
    """Why it does not; empty if it does."""
    steps: int
    """Steps of the side."""
    game_s: float
    """Seconds on the game's clock."""
    wall_s: float | None
    """Seconds of wall time; null if it is unfinished, like all that follows."""
    killed_value: float | None
    """Minerals and vespene that the killed units had cost."""
    killed_units: int | None
    """Number of units killed."""
    lost_value: float | None
    """Minerals and vespene that the lost units had cost."""
    lost_units: int | None
    """Number of units lost."""
    kd: float | None
    """Value killed / value lost; null if nothing was lost."""
    score: float | None
    """The game's score at the end."""
