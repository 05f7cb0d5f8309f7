"""The present stage of each team's task, per episode.

A stage ends when the middle of the team's screen is at its place, or when the clock shows its time. A team with one
text for all the time has no stages, and does not appear here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_bridge.state.teams import Team
    from khala_bridge.task.variant import Stage
    from khala_protocol.messages import Point


class Stages:
    """The stages that a side's teams have reached in an episode."""

    def __init__(self) -> None:
        self._reached: dict[tuple[str, str], int] = {}

    def task(self, team: Team, minimap: Point | None, time_s: float) -> str:
        """Return the present task of a team, after moving on to the stage that it has reached.

        Args:
            team: the team; each unit of a team of the kind `select` has a stage of its own.
            minimap: the middle of its screen; None if it has none.
            time_s: seconds on the game's clock.
        """
        stages = team.config.stages
        at = self._reached.get((team.agent, team.name), 0)
        while at + 1 < len(stages) and _over(stages[at], minimap, time_s):
            at += 1
        self._reached[team.agent, team.name] = at
        return stages[at].task if stages else ""


def _over(stage: Stage, minimap: Point | None, time_s: float) -> bool:
    there = stage.at is not None and minimap is not None and math.dist(stage.at, minimap) <= stage.within
    return there or (stage.until_s is not None and time_s >= stage.until_s)
