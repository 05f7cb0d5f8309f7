"""What the words of agents do: recognise → translate → execute.

`recognise` reads calls by the catalogue; `translate` makes commands of them that know units and world points and no
frame; `raw` and `screen` play the same commands in two ways, as plans of steps that `khala_bridge.game.game` carries
out.
`actor` is the way through all of it.
"""

from khala_bridge.act.actor import Actor, JointAction, executor_of
from khala_bridge.act.plan import Executor, GameRefusal, Plan, PlanStep, Played
from khala_bridge.act.translate import Command

__all__ = ["Actor", "Command", "Executor", "GameRefusal", "JointAction", "Plan", "PlanStep", "Played", "executor_of"]
