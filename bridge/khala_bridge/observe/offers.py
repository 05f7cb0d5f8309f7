"""What a team may be told now, what that costs, and why the rest is not possible.

Valid is what the game itself would take from some unit of the team (`Snapshot.abilities`); where the game was not
asked, what nothing known speaks against. Reasons and costs come from `khala_bridge.knowledge`. A team without units is
judged by the units of the whole side that would carry its actions out; which of them it will be, and where, is left to
the rules of `khala_bridge.auto`. Whether a call is carried out is decided by `khala_bridge.act`, by the state it meets.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.knowledge import abilities, ability_of, is_armed, knowledge, stand_ins
from khala_bridge.state.abilities import is_attack, unmet
from khala_bridge.state.ledger import Ledger
from khala_protocol.messages import Barred, Offer

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_bridge.catalogue.action import Action
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.observe.body import Body
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import ActionSpec, OrderView


class Choice(NamedTuple):
    """What a team may be told: a part of its view."""

    actions: tuple[ActionSpec, ...]
    offers: tuple[Offer, ...]
    barred: tuple[Barred, ...]


class Possible:
    """The means of a side at one moment, and what they allow."""

    def __init__(self, snapshot: Snapshot, bodies: Mapping[int, Body], upgrades: Sequence[str]) -> None:
        common = snapshot.player
        self._abilities = snapshot.abilities
        self._upgrades = frozenset(upgrades)
        self.promised = _promised(snapshot, bodies)
        """Minerals and vespene that are set aside for what workers are on their way to build."""
        self._purse = (
            max(0, common.minerals - self.promised[0]),
            max(0, common.vespene - self.promised[1]),
            float(common.food_cap) - float(common.food_used),
        )
        self._own: dict[str, list[Body]] = {}
        for body in bodies.values():
            if body.is_own:
                self._own.setdefault(body.name, []).append(body)
        self._ready = {name: [b for b in there if b.view.build_progress >= 1] for name, there in self._own.items()}
        self._standing = {name for name, there in self._ready.items() if there}
        self._able_of: dict[tuple[str, ...], frozenset[int] | None] = {}

    def for_team(self, agent: AgentConfig, members: Sequence[Body]) -> Choice:
        """The actions of a team's types of units, in the order in which they are listed for them."""
        by_type: dict[str, list[Body]] = {}
        for body in members:
            by_type.setdefault(body.name, []).append(body)
        found: dict[str, str | None] = {}  # by action, why it is not possible
        for unit_type, units in by_type.items():
            able = self._able(units)
            for name in agent.actions.get(unit_type, ()):
                if name not in found or found[name] is not None:
                    found[name] = self._why_not(catalogue()[name], units, able)
        return self._choice(found, next(iter(by_type), ""))

    def skills(self, agent: AgentConfig, body: Body) -> tuple[str, ...]:
        """Skills that the agent may use and this very unit could use now; none if the game was not asked."""
        skills = _skills(agent.actions.get(body.name, ()))
        if self._abilities is None or not skills:
            return ()
        able = self._abilities.get(body.tag, frozenset())
        return tuple([name for name, ability in skills.items() if ability in able])

    def for_side(self, names: Iterable[str]) -> Choice:
        """Those of the actions of a side team that somebody of the side can carry out."""
        return self._choice({name: self._why_nobody(catalogue()[name]) for name in names}, "")

    def _able(self, units: Iterable[Body]) -> frozenset[int] | None:
        """Abilities that any of some units could use now; None if the game was not asked."""
        if self._abilities is None:
            return None
        return frozenset().union(*(self._abilities.get(unit.tag, ()) for unit in units))

    def _able_types(self, types: tuple[str, ...]) -> frozenset[int] | None:
        """The same for all finished units of some types, () for every type; remembered, since many actions ask it."""
        if types not in self._able_of:
            self._able_of[types] = self._able(b for name in types or self._ready for b in self._ready.get(name, ()))
        return self._able_of[types]

    def _facts(self, action: Action, unit_type: str) -> AbilityFacts | None:
        """What is known of the ability in which an action ends: of several levels of research, the next one."""
        cases = _cases(action.name, unit_type)
        open_ = (facts for facts in cases if facts.researches not in self._upgrades)
        return next(open_, cases[-1] if cases else None)

    def _choice(self, judged: Mapping[str, str | None], unit_type: str) -> Choice:
        valid = [catalogue()[name] for name, reason in judged.items() if reason is None]
        offers = (self._offer(action, unit_type or _carrier(action)) for action in valid)
        barred = tuple(_barred(name, reason) for name, reason in judged.items() if reason is not None)
        return Choice(tuple(a.spec for a in valid), tuple(offer for offer in offers if offer is not None), barred)

    def _offer(self, action: Action, unit_type: str) -> Offer | None:
        facts = self._facts(action, unit_type) if _is_paid(action.name, unit_type) else None
        if facts is None:
            return None
        prices = zip(self._purse, (facts.minerals, facts.vespene, facts.supply), strict=True)
        made = facts.produces
        times = max(0, min(int(purse // price) for purse, price in prices if price > 0))
        known = knowledge().get(made) if made else None
        first = known is not None and known.structure and not stand_ins(known.name) & self._own.keys()
        return Offer(
            action=action.name,
            minerals=round(facts.minerals),
            vespene=round(facts.vespene),
            supply=facts.supply,
            times=min(times, 1) if facts.researches else times,
            first=first,
            footprint=known.footprint if known is not None and "screen" in action.args else None,
        )

    # --- why not ----------------------------------------------------------------------------------------------

    def _why_not(self, action: Action, units: Sequence[Body], able: frozenset[int] | None) -> str | None:
        """Why units of one type cannot do an action now, as the end of a sentence; None if one of them can."""
        unit_type = units[0].name
        function = action.pysc2
        if able is None or function is None or (is_attack(function) and not is_armed(unit_type)):
            return unmet(function, unit_type, self._upgrades)
        if function.ability_id in able:
            return self._promised_away(action, unit_type)
        facts = self._facts(action, unit_type)
        if facts is None:
            return f"{unit_type} cannot"
        return self._lacking(facts) or _not_ready(facts, units) or "not in its present state"

    def _why_nobody(self, action: Action) -> str | None:
        """Why nobody of the side can do an action now; None if somebody can."""
        ready = [body for name in action.units for body in self._ready.get(name, ())]
        if action.units and not ready:
            begun = next((name for name in action.units if name in self._own), None)
            return f"{begun} is not finished" if begun else f"no {' or '.join(action.units)}"
        function = action.pysc2
        if function is None:
            return None
        able = self._able_types(action.units)
        unit_type = ready[0].name if ready else ""
        if able is not None and function.ability_id in able:
            return self._promised_away(action, unit_type)
        facts = self._facts(action, unit_type)
        if facts is None:
            return None if able is None else "nobody can now"
        reason = self._lacking(facts)
        if reason is None and able is not None:
            unpowered = ready and all(_unpowered(body) for body in ready)
            busy = f"{'no' if unpowered else 'every'} {' or '.join(dict.fromkeys(b.name for b in ready))} "
            reason = busy + ("has power" if unpowered else "is busy or not ready") if ready else "nobody can now"
        return reason

    def _lacking(self, facts: AbilityFacts) -> str | None:
        """What the side lacks for a use of an ability."""
        if facts.researches in self._upgrades:
            return "researched already"
        if facts.researches and any(o.name == facts.name for there in self._own.values() for o in _orders(there)):
            return "being researched"
        for name in facts.requires:
            if name not in knowledge():
                if name not in self._upgrades:
                    return f"{name} is not researched"
            elif not stand_ins(name) & self._standing:
                return f"{name} is not finished" if stand_ins(name) & self._own.keys() else f"no {name}"
        return self._short_of(facts)

    def _promised_away(self, action: Action, unit_type: str) -> str | None:
        """What is too few for an action that the game would take, since it knows nothing of promises."""
        facts = self._facts(action, unit_type) if any(self.promised) else None
        return None if facts is None else self._short_of(facts)

    def _short_of(self, facts: AbilityFacts) -> str | None:
        prices = facts.minerals, facts.vespene, facts.supply
        missing = zip(("minerals", "vespene", "supply"), prices, self._purse, strict=True)
        return ", ".join(f"{price - purse:g} {what} too few" for what, price, purse in missing if price > purse) or None


def _promised(snapshot: Snapshot, bodies: Mapping[int, Body]) -> tuple[int, int]:
    orders = (order.name for body in bodies.values() if body.is_own for order in body.view.orders)
    if not any(name.startswith("Build_") for name in orders):
        return 0, 0
    minerals, vespene = Ledger.of(snapshot).aside
    return round(minerals), round(vespene)


@functools.cache
def _is_paid(action: str, unit_type: str) -> bool:
    """Whether an action costs anything."""
    return any(facts.minerals or facts.vespene or facts.supply for facts in _cases(action, unit_type))


@functools.lru_cache(1024)
def _skills(names: tuple[str, ...]) -> dict[str, int]:
    """Abilities of those actions that are skills, by the names of their functions without what they begin with."""
    actions = (catalogue()[name] for name in names)
    functions = (action.pysc2 for action in actions if action.group == "skill")
    return {f.stem.partition("_")[2] or f.stem: f.ability_id for f in functions if f is not None}


@functools.lru_cache(4096)
def _barred(action: str, reason: str) -> Barred:
    return Barred(action=action, reason=reason)


def _not_ready(facts: AbilityFacts, units: Sequence[Body]) -> str | None:
    """What the units themselves lack."""
    best = max(body.view.energy for body in units)
    if facts.energy > best:
        return f"needs {facts.energy:g} energy, there is {int(best)}"
    if facts.addon:
        return f"needs a {facts.addon}"
    return "cooling down" if facts.cooldown_s else None


def _unpowered(body: Body) -> bool:
    return body.view.details is not None and body.view.details.unpowered


def _orders(bodies: Iterable[Body]) -> Iterable[OrderView]:
    return (order for body in bodies for order in body.view.orders)


def _carrier(action: Action) -> str:
    """A type of unit that carries an action of the side out; empty for any."""
    return action.units[0] if action.units else ""


@functools.cache
def _cases(action: str, unit_type: str) -> tuple[AbilityFacts, ...]:
    """What is known of the ability in which an action ends, for a type of unit: one case, or levels of research."""
    function = catalogue()[action].pysc2
    facts = None if function is None else ability_of(function.ability_id, unit_type)
    if function is None or facts is None:
        return ()
    levels = [abilities()[number] for number in abilities()[function.ability_id].special]
    return tuple(level for level in levels if level.researches and unit_type in level.users) or (facts,)
