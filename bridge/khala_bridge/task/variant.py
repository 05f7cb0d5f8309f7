"""What the paper says of a task where its published files do something else, and how a task becomes that variant.

A task plays what the files do unless it says `variant: paper`. The map then plays what the paper says
(`khala_bridge.task.maps.PapersMap`), and the fields of `PapersTask` replace those of the task. Above:
`khala_bridge.task.config`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from pydantic import Field

from khala_bridge.catalogue.catalogue import catalogue, chosen
from khala_protocol.messages import Frozen, Point

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

ORDERS: Final = ("No_Operation", "Hold_Position", "Move_Screen", "Move_Minimap", "Select_Unit_Move_Screen",
                 "Select_Unit_Move_Minimap")  # fmt: skip
"""Orders of the paper's table B1 that it gives to every unit."""
ATTACKS: Final = ("Attack_Unit", "Select_Unit_Attack_Unit")
"""Those that it gives to units that can attack."""
NOT_IN_PAPER: Final = "orders"
"""The group of orders that the paper leaves out."""


class Stage(Frozen):
    """One part of a team's task, until the next one begins; the last part stays."""

    task: str
    at: Point | None = None
    """Place on the minimap that ends the stage when the middle of the team's screen is there."""
    within: float = Field(default=4.0, gt=0)
    """Cells of the minimap that count as being there."""
    until_s: float | None = Field(default=None, ge=0)
    """Time on the game's clock that ends the stage, in seconds."""


class PapersTeam(Frozen):
    """The task of a team in the paper's variant."""

    task: str = ""
    stages: tuple[Stage, ...] = ()


class PapersTask(Frozen):
    """What is different in a task with `variant: paper`; fields that are not given stay."""

    description: str | None = None
    task: str | None = None
    teams: dict[str, PapersTeam] = Field(default_factory=dict)
    """By name of the team."""
    orders: bool = False
    """Whether every type of unit has the orders of the paper's table B1, those that attack as far as it can, and none
    that the paper leaves out."""

    def over(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of a task with these differences; fields that no task can have stay as they are."""
        changed: dict[str, Any] = {
            name: text for name in ("description", "task") if (text := getattr(self, name)) is not None
        }
        agents = fields.get("agents")
        if isinstance(agents, list | tuple) and (self.teams or self.orders):
            dumped = [agent.model_dump() if isinstance(agent, Frozen) else agent for agent in agents]
            changed["agents"] = [self._agent(agent) if isinstance(agent, dict) else agent for agent in dumped]
        return {**fields, **changed}

    def _agent(self, agent: dict[str, Any]) -> dict[str, Any]:
        teams = [
            {**team, **self.teams[team["name"]].model_dump(exclude_unset=True)}
            if isinstance(team, dict) and team.get("name") in self.teams
            else team
            for team in agent.get("teams") or ()
        ]
        actions = agent.get("actions")
        if self.orders and isinstance(actions, dict):
            actions = {kind: list(_with_orders(kind, names)) for kind, names in actions.items()}
        return {**agent, "teams": teams, **({"actions": actions} if actions else {})}


def _with_orders(kind: str, names: Iterable[str]) -> Iterator[str]:
    """Yield the orders of table B1 for a type of unit, then its actions that are no orders."""
    own = [name for name in chosen(names, kind) if catalogue()[name].group != NOT_IN_PAPER]
    orders = (*ORDERS, *(ATTACKS if ATTACKS[0] in own else ()))
    yield from dict.fromkeys((*orders, *own))
