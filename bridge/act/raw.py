"""The raw executor: every command is one raw unit command, and all of them enter the game in one step.

No camera, no selection, no screen: units and targets are named by their tags and by points of the world, so a joint
action costs one `SC2Env.step` however many teams and agents had a part in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bridge.act.plan import Plan, Played, Step, listed, refused_by_game, written

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bridge.act.translate import Command
    from bridge.snapshot import Snapshot


class RawExecutor:
    """Plays commands through the raw interface; keeps no state."""

    def begin(self) -> None:
        """Nothing is remembered."""

    def plan(self, commands: Sequence[Command], snapshot: Snapshot, loops: int) -> Plan:  # noqa: ARG002  # the other executor looks at it
        """One step with all commands, and `loops` game loops."""
        after = yield Step(tuple(unit_command(command) for command in commands), loops)
        return Played(tuple(_words(command) for command in commands), refused_by_game(commands, after))


def unit_command(command: Command) -> sc_pb.Action:
    """A command in the words of the SC2 API: an order to units, or a switch of what they do by themselves."""
    action = sc_pb.Action()
    if command.function.kind == "autocast":
        action.action_raw.toggle_autocast.ability_id = command.function.ability_id
        action.action_raw.toggle_autocast.unit_tags.extend(command.units)
        return action
    order = action.action_raw.unit_command
    order.ability_id = command.function.ability_id
    order.unit_tags.extend(command.units)
    order.queue_command = command.queued
    if isinstance(command.target, int):
        order.target_unit_tag = command.target
    elif command.target is not None:
        order.target_world_space_pos.CopyFrom(common_pb2.Point2D(x=command.target.x, y=command.target.y))
    return action


def _words(command: Command) -> str:
    """As PySC2's raw functions are written, `Attack_unit(now, [0x1], 0x2)`."""
    stem, units = command.function.stem, listed(command.units)
    if command.function.kind == "autocast":
        return written(f"{stem}_autocast", units)
    when = "queued" if command.queued else "now"
    if isinstance(command.target, int):
        return written(f"{stem}_unit", when, units, hex(command.target))
    if command.target is not None:
        return written(f"{stem}_pt", when, units, f"[{command.target.x:.1f}, {command.target.y:.1f}]")
    return written(f"{stem}_quick", when, units)
