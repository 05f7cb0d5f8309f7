"""Recognised actions → commands to the game, checked against the present state, also if they were meant earlier.

A command holds units, a function, a unit or a world point as its target, and whether it waits behind earlier orders.
It has no frame: `raw_executor` and `screen_executor` beside it make the calls of the game from the same commands.

    units     those that the team had when it was seen, as far as they exist; those that are named; or those that a
              rule of `khala_bridge.auto` finds
    possible  `khala_bridge.rules`; only the units that can do it get the order
    target    `khala_bridge.act.targets`

Order of the commands of one turn, unit by unit: the first one replaces what the unit did. A later one waits for it
if the action queues (the catalogue says), and replaces it if not. In LLM-PySC2's code the first queueing function of a
*team* replaces. Then an order to a second unit would wait behind that unit's old order, and an attack would cancel a
skill of the same reply, since here all commands of a turn reach the game in one loop.

An instant ability (Stimpack, Guardian Shield, a cloak) is no order: the game carries it out at once and leaves the
orders of the unit alone. So it does not count as the first one: a move after it replaces what the unit did before the
reply, and waits for nothing. After an order of the same reply it waits its turn, as it was said. A cast that is an
order, such as Blink or a storm, replaces what the unit did, and the move waits for it. A switch of an autocast is none.

A unit that a reply orders by name is left out of the orders to its whole team in that reply: "all attack, and this one
steps back" is two calls.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_bridge.act.rejected import CallRejected, reject
from khala_bridge.act.targets import Targets
from khala_bridge.auto import RULES, NotAvailable, RuleOrder, RuleRequest
from khala_bridge.auto.aims import aim_of, reaches
from khala_bridge.frames import WorldPoint
from khala_bridge.rules import (
    Cost,
    facts_for,
    is_attack,
    is_free,
    is_instant,
    nearest,
    of_team,
    price_of,
    use_of,
    why_not,
)
from khala_bridge.state.means import ledger_of, side_of
from khala_protocol.messages import Rejection

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_bridge.act.recognise import Recognised
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.observe.observation import SideObservation
    from khala_bridge.rules import Ledger

MAKERS = frozenset({"build", "warp_in", "research"})
"""Kinds of abilities for which one unit of a team is enough."""
FREE = Cost(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Command:
    """One order to some units."""

    said: Recognised | None
    """The call that it carries out; None for the host's own order."""
    function: Function
    """PySC2's function for it, which names the ability."""
    units: tuple[int, ...]
    target: int | WorldPoint | None
    """Tag of a unit, or a point of the world."""
    queued: bool = False


@dataclass(frozen=True, slots=True)
class Trial:
    """The commands of a standing order that may yet be put off, and the accounts of the turn if they are given."""

    commands: list[Command]
    ledger: Ledger
    ordered: set[int]


class Translator:
    """Translates the calls of one turn, of all agents of a side, one after the other."""

    def __init__(self, observation: SideObservation, max_actions: Mapping[str, int]) -> None:
        """Take the present observation, and by agent the number of actions that one team may have in a turn."""
        self._observation = observation
        self._snapshot = observation.snapshot
        self._max_actions = max_actions
        self.ledger = ledger_of(observation.snapshot)
        self._side = side_of(observation.snapshot)
        self.ordered: set[int] = set()
        """Tags of the units that got an order in this turn; an instant ability is none."""
        self._targets = Targets(observation)
        self._count: Counter[tuple[str, str]] = Counter()
        """By agent and team, the actions of this turn."""
        self._apart: frozenset[int] = frozenset()

    def set_apart(self, calls: Iterable[Recognised]) -> None:
        """Leave the units that these calls order by name, and can order, out of what is translated from now on."""
        named = [said for said in calls if said.action.actor_count]
        possible = [said for said in named if not isinstance(self.try_(said), Rejection)]
        self._apart = frozenset(tag for said in possible for tag in said.tags[: said.action.actor_count])

    def translate(self, said: Recognised) -> list[Command] | Rejection:
        """Return the commands of a call: none if it orders nothing, two if only some of its units have to wait."""
        try:
            return self._commands(said, self._counted_orders(said))
        except CallRejected as refused:
            return reject(said.call, refused, said.team.name)

    def try_(self, said: Recognised) -> Trial | Rejection:
        """Translate a standing order, and leave the accounts of the turn as they are until `keep`.

        It does not count as one of the actions that its team may have.
        """
        ledger = self.ledger
        ordered = self.ordered
        self.ledger = ledger.copy()
        self.ordered = ordered.copy()
        try:
            return Trial(self._commands(said, self._orders(said)), self.ledger, self.ordered)
        except CallRejected as refused:
            return reject(said.call, refused, said.team.name)
        finally:
            self.ledger = ledger
            self.ordered = ordered

    def keep(self, trial: Trial) -> None:
        """Make the accounts of the newest trial those of the turn."""
        self.ledger = trial.ledger
        self.ordered = trial.ordered

    def lacks_units(self, said: Recognised) -> bool:
        """Return True if some units that a call meant are gone since its agent saw them."""
        return not said.action.actor_count and any(tag not in self._snapshot.units for tag in said.team.tags)

    def commands(self, order: RuleOrder, said: Recognised | None = None) -> list[Command]:
        """Return the commands of an order, behind the earlier orders of its units in this turn."""
        queues = said is not None and said.action.queue
        first = tuple(tag for tag in order.units if not (queues and tag in self.ordered))
        later = tuple(tag for tag in order.units if queues and tag in self.ordered)
        self.ordered.update(tag for tag in order.units if not self._leaves_orders_alone(order.function, tag))
        found = [Command(said, order.function, first, order.target, order.queued)] if first else []
        return [*found, Command(said, order.function, later, order.target, queued=True)] if later else found

    def _leaves_orders_alone(self, function: Function, tag: int) -> bool:
        return function.kind == "autocast" or is_instant(
            self._snapshot.facts, function.ability_id, self._side.units[tag].type
        )

    def _commands(self, said: Recognised, orders: Iterable[RuleOrder]) -> list[Command]:
        return [command for order in orders for command in self.commands(order, said)]

    def _counted_orders(self, said: Recognised) -> list[RuleOrder]:
        """Return the orders of a call that is one of the actions of its team.

        Raises:
            CallRejected: it cannot be carried out.
        """
        team = (said.team.agent, said.team.name)
        allowed = self._max_actions[said.team.agent]
        if self._count[team] >= allowed:
            if said.action.rule is None:
                self._as_said(said)  # another fault is named first
            limit = f"{allowed} action{'s' if allowed > 1 else ''}"
            raise CallRejected("too_many_actions", f"Team {said.team.name} had its {limit} in this reply already.")
        found = self._orders(said)
        self._count[team] += 1
        return found

    def _orders(self, said: Recognised) -> list[RuleOrder]:
        """Return the orders of a call, entered in the accounts.

        Raises:
            CallRejected: it cannot be carried out.
        """
        if said.action.rule is not None:
            return self._by_rule(said, said.action.rule)
        found = self._as_said(said)
        self._book(found)
        return found

    def _book(self, orders: Iterable[RuleOrder]) -> None:
        """Enter the costs and the busy units of orders in the ledger; rules do so themselves.

        Energy is entered only for a single unit: in a group that casts at one target, the game chooses the caster.
        """
        for order in orders:
            self.ledger.take(*order.units)
            for tag in order.units:
                if is_free(self._snapshot.facts, order.function.ability_id, self._side.units[tag].type):
                    continue
                facts = self._facts(order.function, tag)
                assert facts is not None, "what is known to cost something is known"
                self.ledger.pay(price_of(facts))
                if facts.researches:
                    self.ledger.begun.add(facts.id)
                if facts.energy and len(order.units) == 1:
                    self.ledger.energy[tag] += int(facts.energy)

    def _facts(self, function: Function, tag: int) -> AbilityFacts | None:
        return facts_for(self._snapshot.facts, function.ability_id, self._side.units[tag].type, self._side.upgrades)

    def _by_rule(self, said: Recognised, rule: str) -> list[RuleOrder]:
        """Return the orders that a rule makes of a call; the rule takes the price from the ledger itself."""
        units = self._having(said, self._units(said)) if said.team.tags else ()
        tag = self._targets.unit(said).tag if said.action.target_kind == "tag" else None
        point = None if said.point is None else self._targets.place(said)
        try:
            return RULES[rule](RuleRequest(said.action, self._snapshot, self.ledger, units, tag, point))
        except NotAvailable as impossible:
            better = "" if impossible.place is None else self._targets.instead(impossible.place)
            raise CallRejected(impossible.reason, impossible.message.removesuffix(".") + better + ".") from None

    def _as_said(self, said: Recognised) -> list[RuleOrder]:
        """Return the order of a call that leaves nothing open."""
        function = said.action.pysc2
        if function is None and not said.team.tags:
            return []
        units = self._having(said, self._units(said))
        if function is None:
            return []
        able = self._able(said, function, units)
        match said.action.target_kind:
            case None:
                return [RuleOrder(function, able)]
            case "tag":
                return [self._at_unit(said, function, able)]
            case _:
                return [RuleOrder(function, able, self._targets.place(said))]

    # --- units ------------------------------------------------------------------------------------------------

    def _units(self, said: Recognised) -> tuple[int, ...]:
        """Return the units that a call means, as far as they exist."""
        tags = self._targets.named_units(said) if said.action.actor_count else said.team.tags
        found = tuple(tag for tag in tags if tag in self._snapshot.units)
        if not found:
            raise self._cannot(said, [self._targets.end_of_all(tags) if tags else "it has no units"])
        if said.action.actor_count:
            return found
        return tuple(tag for tag in found if tag not in self._apart) or found

    def _having(self, said: Recognised, tags: Iterable[int]) -> tuple[int, ...]:
        """Return the units that have the action by the task."""
        listed = self._observation.configs[said.team.agent].actions
        types = {tag: self._snapshot.units[tag].name for tag in tags}
        found = tuple(tag for tag, name in types.items() if said.action.name in listed.get(name, ()))
        if not found:
            raise self._cannot(said, [f"{name} has no such action" for name in dict.fromkeys(types.values())])
        return found

    def _able(self, said: Recognised, function: Function, tags: tuple[int, ...]) -> tuple[int, ...]:
        """Return the units that can do it now; only one, if one is enough."""
        use = use_of(function, at_unit=said.action.target_kind == "tag")
        found = {tag: why_not(use, self._side.units[tag], self._side, self.ledger) for tag in tags}
        able = tuple(tag for tag, why in found.items() if why is None)
        reasons = [why for why in found.values() if why is not None]
        if not able:
            raise self._cannot(said, [of_team(nearest(reasons))])
        if said.action.subject == "two_units" and reasons:
            raise self._cannot(said, list(map(of_team, reasons)))
        if all(is_free(self._snapshot.facts, function.ability_id, self._side.units[tag].type) for tag in able):
            return able
        facts = [self._facts(function, tag) for tag in able]
        if facts[0] is not None and facts[0].does in MAKERS:
            return able[:1]
        if self._snapshot.abilities is None:
            return able
        return able[: self.ledger.payable(FREE if fact is None else price_of(fact) for fact in facts)]

    @staticmethod
    def _cannot(said: Recognised, reasons: list[str]) -> CallRejected:
        why = "; ".join(dict.fromkeys(reasons))
        return CallRejected("not_available", f"Team {said.team.name} cannot do {said.action.name} now: {why}.")

    # --- targets ----------------------------------------------------------------------------------------------

    def _at_unit(self, said: Recognised, function: Function, able: tuple[int, ...]) -> RuleOrder:
        """Return the order at the named unit, for the able units that can aim at it."""
        unit = self._targets.unit(said)
        if said.action.aim == "place":
            return RuleOrder(function, able, WorldPoint(unit.pos.x, unit.pos.y))
        aiming = tuple(tag for tag in able if tag != unit.tag)
        if is_attack(function):
            aim = aim_of(unit)
            aiming = tuple(tag for tag in aiming if reaches(self._snapshot.facts, self._snapshot.units[tag].name, aim))
            where = "on the ground" if "ground" in aim.planes else "in the air"
            what = f"{hex(unit.tag)} is a {unit.name} {where}"
            if not aiming:
                raise CallRejected("invalid_target", f"{what}, and no weapon of team {said.team.name} reaches that.")
        if not aiming:
            raise CallRejected(
                "invalid_target", f"{hex(unit.tag)} is the unit itself; {said.action.name} needs another one."
            )
        return RuleOrder(function, aiming, unit.tag)
