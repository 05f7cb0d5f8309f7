"""What became of casts: an order that was accepted is not yet a cast.

The caster walks there first; on the way it may die, or get another order. The game does not tell any of it. What tells
it is the caster itself: a cast costs energy, or its ability is not ready afterwards. `Casts` follows each cast that an
agent ordered until it is done or given up, and says so once for each change.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.rules import facts_for
from khala_protocol.messages import LOOPS_PER_S, CastView

if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Mapping, Sequence

    from khala_bridge.act.plan import GameRefusal
    from khala_bridge.act.translate import Command
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.state import Snapshot, Unit

NO_CASTS = frozenset({"train", "research", "build", "warp_in", "morph"})
"""Kinds of abilities whose results an agent sees by themselves."""


class _Cast(NamedTuple):
    """A cast that an agent ordered and that is neither done nor given up."""

    agent: str
    call: str
    ability: int
    facts: AbilityFacts
    units: tuple[int, ...]


@dataclass
class Casts:
    """The casts of one side that are under way."""

    _open: list[_Cast] = field(default_factory=list)

    def begin(self) -> None:
        """Forget the episode before."""
        self._open = []

    def follow(
        self, commands: Sequence[Command], before: Snapshot, after: Snapshot, refusals: Sequence[GameRefusal] = ()
    ) -> Mapping[str, Sequence[CastView]]:
        """Return by agent what became of its casts in a step, and follow those that are under way.

        Args:
            commands: of the step.
            before: the state in which they were given.
            after: the state at the end of the step.
            refusals: of these commands, by the game: their agents hear of them anyway.
        """
        ordered = {tag for command in commands for tag in command.units}
        replaced = [cast for cast in self._open if not ordered.isdisjoint(cast.units)]
        new = list(_casts(commands, before, {(r.agent, r.rejection.team, r.rejection.start) for r in refusals}))
        fates = [(cast, _fate(cast, before, after, replaced=cast in replaced)) for cast in (*self._open, *new)]
        told: dict[str, list[CastView]] = {}
        for cast, fate in fates:
            if fate is not None and (fate.end != "under way" or cast in new):
                told.setdefault(cast.agent, []).append(fate)
        self._open = [cast for cast, fate in fates if fate is not None and fate.end == "under way"]
        return told


def _casts(commands: Sequence[Command], before: Snapshot, refused: Container[object]) -> Iterator[_Cast]:
    """Yield the commands that are casts and whose end can be seen, but those of refused calls."""
    if before.abilities is None:
        return
    upgrades = frozenset(before.upgrades)
    for command in commands:
        said = command.said
        if said is None or not command.units or command.function.kind == "autocast":
            continue
        if (said.team.agent, said.team.name, said.call.start) in refused:
            continue
        ability = command.function.ability_id
        facts = facts_for(before.facts, ability, before.units[command.units[0]].name, upgrades)
        if facts and facts.does not in NO_CASTS and (facts.energy or facts.cooldown_s):
            yield _Cast(said.team.agent, said.text, ability, facts, command.units)


def _fate(cast: _Cast, before: Snapshot, after: Snapshot, *, replaced: bool) -> CastView | None:
    """Return what became of a cast in a step; None if nothing shows it.

    Args:
        cast: it was under way before, or was ordered in the step.
        before: the state at the beginning of the step.
        after: the state at its end.
        replaced: its units got another order in the step.
    """
    units = [(before.units.get(tag), after.units.get(tag)) for tag in cast.units]
    here = [(then, now) for then, now in units if then is not None and now is not None]
    if any(_did(cast, then, now, before, after) for then, now in here):
        return CastView(call=cast.call, end="cast")
    if any(
        order.ability_id in (cast.ability, cast.facts.id, cast.facts.general) for _, u in here for order in u.orders
    ):
        return CastView(call=cast.call, end="under way")
    if not here:
        gone = "its casters" if len(cast.units) > 1 else "its caster"
        dead = not after.dead.isdisjoint(cast.units)
        return CastView(call=cast.call, end="not cast", why=f"{gone} died" if dead else f"{gone} left the map")
    if cast.facts.cooldown_s and cast.facts.cooldown_s < (after.game_loop - before.game_loop) / LOOPS_PER_S:
        return None
    why = "another order took its place" if replaced else "the order ended without it"
    return CastView(call=cast.call, end="not cast", why=why)


def _did(cast: _Cast, then: Unit, now: Unit, before: Snapshot, after: Snapshot) -> bool:
    """Return True if a unit has cast: by its energy, or by an ability that was ready and is not any more."""
    if cast.facts.energy:
        return then.energy - now.energy > cast.facts.energy / 2
    if before.abilities is None or after.abilities is None:
        return False
    could = cast.ability in before.abilities.get(then.tag, ())
    return could and cast.ability not in after.abilities.get(now.tag, ())
