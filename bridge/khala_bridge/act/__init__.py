"""From the words of agents to commands: recognise → translate → execute.

`recognise` matches calls with the catalogue. `translate` turns them into commands, which name units and world points
and no frame. `raw_executor` and `screen_executor` play the same commands in two ways, as plans of steps that
`khala_bridge.game.game` carries out. `actor` runs all of it.
"""

from khala_bridge.act.actor import Actor, JointAction, executor_of
from khala_bridge.act.casts import Casts
from khala_bridge.act.plan import Executor, GameRefusal, Plan, PlanResult, PlanStep
from khala_bridge.act.translate import Command

__all__ = [
    "Actor",
    "Casts",
    "Command",
    "Executor",
    "GameRefusal",
    "JointAction",
    "Plan",
    "PlanResult",
    "PlanStep",
    "executor_of",
]
