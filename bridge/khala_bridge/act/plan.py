"""Plans: an executor turns commands into one, and `khala_bridge.game.game` plays it step by step.

A plan is a generator and touches no game: it yields the input of one `SC2Env.step`, receives the snapshot after that
step, and returns what it played. So both executors can be tested without a game, and the game does not know executors.
A plan ends when it receives a snapshot of an episode that is over.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from khala_bridge.act.recognise import CallRejected, reject
from khala_bridge.names import order_name
from khala_bridge.state import Snapshot

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_bridge.act.translate import Command
    from khala_protocol.messages import Rejection

GameAction: TypeAlias = Any
"""A `sc_pb.Action` or a PySC2 function call; `SC2Env.step` takes both."""


@dataclass(frozen=True, slots=True)
class PlanStep:
    """The input of one `SC2Env.step`."""

    actions: tuple[GameAction, ...]
    loops: int
    """Game loops that pass during the step, at least 1."""


@dataclass(frozen=True, slots=True)
class GameRefusal:
    """A command that failed while it was played."""

    agent: str
    rejection: Rejection


@dataclass(frozen=True, slots=True)
class PlanResult:
    """The result of a plan."""

    functions: tuple[str, ...] = ()
    """What entered the game, in PySC2's words."""
    refusals: tuple[GameRefusal, ...] = ()


Plan: TypeAlias = Generator[PlanStep, Snapshot, PlanResult]


class Executor(Protocol):
    """Plays commands in one of two ways."""

    def begin(self) -> None:
        """Forget the episode before."""

    def plan(self, commands: Sequence[Command], snapshot: Snapshot, loops: int) -> Plan:
        """Return a plan that carries the commands out in `loops` game loops, or more if it needs them."""


def refuse(command: Command, why: str) -> GameRefusal | None:
    """Return the refusal of a command by the game; None for the host's own command. `why` ends a sentence."""
    said = command.said
    if said is None:
        return None
    message = f"The game refused {said.action.name}: {why}."
    return GameRefusal(said.team.agent, reject(said.call, CallRejected("refused_by_game", message), said.team.name))


def refused_by_game(commands: Sequence[Command], after: Snapshot) -> tuple[GameRefusal, ...]:
    """Return the refusals among the errors that the game reported; one for each command at most.

    An error says which ability failed, sometimes another one than was ordered. If it is one that units use by
    themselves, nobody ordered it: two Medivacs choose the same Marine while the army attacks.
    """
    found: dict[int, GameRefusal | None] = {}
    for error in after.errors:
        suspects = [i for i, command in enumerate(commands) if error.unit_tag in command.units]
        ordered = {i: order_name(commands[i].function.ability_id) for i in suspects}
        same = [i for i in suspects if ordered[i] == order_name(error.ability_id)]
        for index in (same or ([] if _by_itself(after, error.ability_id) else suspects))[-1:]:
            found.setdefault(index, refuse(commands[index], words(error.result)))
    return tuple(refusal for _, refusal in sorted(found.items()) if refusal is not None)


def _by_itself(after: Snapshot, ability_id: int) -> bool:
    """Return True if units use an ability without an order."""
    facts = after.facts.abilities.get(ability_id)
    return facts is not None and facts.autocast is not None


def words(result: str) -> str:
    """Return the name of an action error of the game in words, `CantTargetAirUnits` → `cant target air units`."""
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in result).strip()


def written(name: str, *arguments: object) -> str:
    """Return a function as reports show it, `Attack_unit(now, [0x1, 0x2], 0x3)`."""
    return f"{name}({', '.join(map(str, arguments))})"


def tag_list(tags: Iterable[int]) -> str:
    """Return tags as reports show them."""
    return f"[{', '.join(map(hex, tags))}]"
