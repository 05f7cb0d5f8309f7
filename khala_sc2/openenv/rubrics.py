"""What a step is worth to the agents of a session, by OpenEnv's rubrics.

`Battle` is the server's own: a weighted sum of four. `khala openenv --rubric my_rewards:Mine` takes one of yours: any
`Rubric`, or a function that makes one. It is called with the action and the observation after it, and reset with each
episode.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from openenv.core.rubrics import Rubric

from khala_sc2.env.rewards import VALUE, WIN

if TYPE_CHECKING:
    from openenv.core.env_server.types import Action

    from khala_sc2.openenv.models import KhalaObservation

MINUTE_S = 60.0


class Win(Rubric):
    """1 for a win, -1 for a loss, at the end of an episode; else 0."""

    def forward(self, action: Action, observation: KhalaObservation) -> float:  # noqa: ARG002  # the standard's
        """Return the score."""
        ends = {"win": WIN, "loss": -WIN}
        return ends.get(observation.result.outcome, 0.0) if observation.result else 0.0


class Value(Rubric):
    """What was destroyed minus what was lost, in thousands of minerals and vespene."""

    def forward(self, action: Action, observation: KhalaObservation) -> float:  # noqa: ARG002
        """Return the score."""
        return (observation.killed_value - observation.lost_value) / VALUE


class Legality(Rubric):
    """Minus the share of calls that were refused: 0 if none was, and if there were none."""

    def forward(self, action: Action, observation: KhalaObservation) -> float:  # noqa: ARG002
        """Return the score."""
        calls = observation.accepted + observation.refused
        return -observation.refused / calls if calls else 0.0


class Tempo(Rubric):
    """Minus the time that has passed, in minutes of the game."""

    def forward(self, action: Action, observation: KhalaObservation) -> float:  # noqa: ARG002
        """Return the score."""
        return -observation.elapsed_s / MINUTE_S


class Battle(Rubric):
    """The sum of `win`, `value`, `legality` and `tempo`, each with a weight.

    With the weights 1, 1, 0 and 0 it is `khala_sc2.env.rewards.battle`, the reward of the environments of PettingZoo.
    """

    def __init__(self, *, win: float = 1.0, value: float = 1.0, legality: float = 0.1, tempo: float = 0.1) -> None:
        """Take the weights."""
        super().__init__()
        self.win = Win()
        self.value = Value()
        self.legality = Legality()
        self.tempo = Tempo()
        self.weights = {"win": win, "value": value, "legality": legality, "tempo": tempo}

    def forward(self, action: Action, observation: KhalaObservation) -> float:
        """Return the score."""
        return float(sum(self.weights[name] * part(action, observation) for name, part in self.named_children()))
