"""The raw executor: every command is one raw unit command, and all of them enter the game in one step.

No camera, no selection, no screen: tags and world points name units and targets, so a joint action costs one
`SC2Env.step` for any number of teams and agents.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.act.plan import Plan, PlanResult, PlanStep, refused_by_game, tag_list, written
from khala_bridge.state.requests import autocast_switch, unit_order

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.act.plan import GameAction
    from khala_bridge.act.translate import Command
    from khala_bridge.state import Snapshot


class RawExecutor:
    """Plays commands through the raw interface; keeps no state."""

    def begin(self) -> None:
        """Do nothing: there is no state."""

    def plan(self, commands: Sequence[Command], snapshot: Snapshot, loops: int) -> Plan:  # noqa: ARG002  # the other executor looks at it
        """Return a plan of one step with all commands, `loops` game loops long."""
        after = yield PlanStep(tuple(_action(command) for command in commands), loops)
        return PlanResult(tuple(_as_function(command) for command in commands), refused_by_game(commands, after))


def _action(command: Command) -> GameAction:
    """Return a command as an action of the SC2 API."""
    ability_id = command.function.ability_id
    if command.function.kind == "autocast":
        return autocast_switch(ability_id, command.units)
    return unit_order(ability_id, command.units, command.target, queued=command.queued)


def _as_function(command: Command) -> str:
    """Return a command as a raw function of PySC2, `Attack_unit(now, [0x1], 0x2)`."""
    stem = command.function.stem
    units = tag_list(command.units)
    if command.function.kind == "autocast":
        return written(f"{stem}_autocast", units)
    when = "queued" if command.queued else "now"
    if isinstance(command.target, int):
        return written(f"{stem}_unit", when, units, hex(command.target))
    if command.target is not None:
        return written(f"{stem}_pt", when, units, f"[{command.target.x:.1f}, {command.target.y:.1f}]")
    return written(f"{stem}_quick", when, units)
