"""Queens: larvae for the nearest base, and its defence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.scripted.skilled.combat import fight
from khala_agents.scripted.skilled.kinds import TOWN_HALLS
from khala_agents.scripted.skilled.space import nearest

if TYPE_CHECKING:
    from khala_agents.scripted.skilled.plan import ReplyPlan

INJECT_ENERGY = 25.0


def tend(plan: ReplyPlan) -> None:
    """Fight what is in sight, else inject larvae once a Queen has the energy."""
    if fight(plan):
        return
    halls = [unit for unit in plan.team.allies if unit.type in TOWN_HALLS and unit.built >= 100]
    for queen in plan.team.own:
        hall = nearest(queen, halls)
        if hall and queen.energy >= INJECT_ENERGY and not queen.order:
            plan.cast("Effect_InjectLarva_Unit", queen, hall.tag)
