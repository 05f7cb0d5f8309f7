"""The actions that a team can use now, their costs, and why the others are not possible.

`khala_bridge.rules` judges each action for the units of a team, or, for a team without units, for those of the whole
side that would carry it out. The rules of `khala_bridge.auto`, which later choose the unit and the place, say whether
there is any to choose. Here the answers become a part of the team's view. `khala_bridge.act` decides whether to carry
out a call, by the state at that time.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.auto import lack
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.observe.arguments import Around, Asker, Lack
from khala_bridge.rules import asked_by, brief, cases, distinct, facts_for, nearest, nobody, price_of, why_no_one
from khala_bridge.state.means import ledger_of, side_of
from khala_protocol.messages import ActionCost, UnavailableAction

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_bridge.catalogue.action import Action
    from khala_bridge.frames import MapFrame
    from khala_bridge.knowledge import MapFacts
    from khala_bridge.observe.body import Body
    from khala_bridge.rules import Unavailable, UnitState, Use
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import ActionSpec, ValidArguments


class Choice(NamedTuple):
    """The possible and impossible actions of a team: a part of its view."""

    actions: tuple[ActionSpec, ...]
    offers: tuple[ActionCost, ...]
    arguments: tuple[ValidArguments, ...]
    barred: tuple[UnavailableAction, ...]


class SkillState(NamedTuple):
    """A skill of a unit."""

    ability: int
    ready: bool
    """Whether the unit could use it now."""


class Possible:
    """The means of a side at one moment, and the actions that they allow."""

    def __init__(self, snapshot: Snapshot, world: MapFrame) -> None:
        """Take the side, its accounts, and the frame of its map."""
        self._snapshot = snapshot
        self._abilities = snapshot.abilities
        self._side = side_of(snapshot)
        self._ledger = ledger_of(snapshot)
        self._distinct: dict[tuple[str, ...], list[UnitState]] = {}
        self._of_side = Asker(snapshot, self._side, self._ledger, Around(world))
        self.promised = round(self._ledger.aside[0]), round(self._ledger.aside[1])
        """Minerals and vespene that are set aside for what workers are on their way to build."""

    def for_team(self, agent: AgentConfig, members: Sequence[Body], around: Around) -> Choice:
        """Return the choice of the actions of a team's types of units, in the order of the task's lists."""
        by_type: dict[str, list[UnitState]] = {}
        for body in members:
            by_type.setdefault(body.name, []).append(self._side.units[body.tag])
        found: dict[str, list[Unavailable]] = {}  # by action, why each type cannot
        doers: dict[str, str] = {}  # a type that can
        for unit_type, alike in by_type.items():
            units = distinct(alike)
            for name, use in _uses(agent.actions.get(unit_type, ())):
                if name in doers:
                    continue
                reasons = found.setdefault(name, [])
                why = None if use is None else why_no_one(use, units, self._side, self._ledger)
                if why is None:
                    doers[name] = unit_type
                else:
                    reasons.append(why)
        judged = {name: None if name in doers else brief(_of_team(whys)) for name, whys in found.items()}
        states = [self._side.units[body.tag] for body in members]
        return self._choice(judged, doers, self._of_side._replace(agent=agent, members=states, around=around))

    def skills(self, agent: AgentConfig, body: Body) -> Mapping[str, SkillState]:
        """Return the skills that the agent has for this very unit, by name; none if the game was not asked."""
        skills = _skills(agent.actions.get(body.name, ()))
        if self._abilities is None or not skills:
            return {}
        able = self._abilities.get(body.tag, frozenset())
        return {name: SkillState(ability, ability in able) for name, ability in skills.items()}

    def for_side(self, names: Iterable[str]) -> Choice:
        """Return the choice of a side team's actions; possible are those that some unit of the side can carry out."""
        judged: dict[str, str | None] = {}
        doers: dict[str, str] = {}
        for name in names:
            judged[name] = self._why_nobody(catalogue()[name])
            doers[name] = next((kind for kind in catalogue()[name].units if kind in self._side.standing), "")
        return self._choice(judged, doers, self._of_side)

    def _choice(self, judged: Mapping[str, str | None], doers: Mapping[str, str], asker: Asker) -> Choice:
        judged, arguments = _with_arguments(judged, asker)
        valid = [catalogue()[name] for name, why in judged.items() if why is None]
        offers = [self._offer(action, doers[action.name]) for action in valid]
        barred = tuple([_unavailable(name, why) for name, why in judged.items() if why is not None])
        paid = tuple([offer for offer in offers if offer is not None])
        return Choice(tuple([a.spec for a in valid]), paid, tuple(arguments), barred)

    def _offer(self, action: Action, unit_type: str) -> ActionCost | None:
        """Return the cost of an action for a type of unit that can do it; None if it is free."""
        of_map = self._side.facts
        if not _is_paid(of_map, action.name, unit_type) or action.pysc2 is None:
            return None
        facts = facts_for(of_map, action.pysc2.ability_id, unit_type, self._side.upgrades)
        assert facts is not None, f"{action.name} is paid"
        cost = price_of(facts)
        made = facts.produces
        times = self._ledger.times(cost)
        known = of_map.units.get(made) if made else None
        return ActionCost(
            action=action.name,
            minerals=round(cost.minerals),
            vespene=round(cost.vespene),
            supply=cost.supply,
            time_s=round(facts.time_s, 1),
            times=min(times, 1) if facts.researches else times,
            first=known is not None and known.structure and not self._side.builds(known.name),
            footprint=known.footprint if known is not None and "screen" in action.args else None,
        )

    # --- why not ----------------------------------------------------------------------------------------------

    def _why_nobody(self, action: Action) -> str | None:
        """Return why no unit of the side can do an action now, or what its rule would not find; None if one can."""
        use = asked_by(action, of_side=True)
        if use is None:
            return None
        if why := self._why_no_one(use, action.units):
            return brief(why)
        return lack(action, self._snapshot, self._ledger)

    def _why_no_one(self, use: Use, types: tuple[str, ...]) -> Unavailable | None:
        if types:
            units = self._of_types(types)
            return why_no_one(use, units, self._side, self._ledger) if units else nobody(types)
        able = self._side.able
        return None if able is None or use.ability in able else nobody(())

    def _of_types(self, types: tuple[str, ...]) -> list[UnitState]:
        """Return the units of some types, without duplicates; cached, since many actions ask for them."""
        if types not in self._distinct:
            self._distinct[types] = distinct(self._side.of_types(types))
        return self._distinct[types]


def _with_arguments(
    judged: Mapping[str, str | None], asker: Asker
) -> tuple[Mapping[str, str | None], list[ValidArguments]]:
    """Return the judgement after a look at the arguments, and the arguments where only some will do."""
    result = dict(judged)
    arguments = []
    for name, why in judged.items():
        found = None if why is not None else asker.arguments(catalogue()[name])
        if isinstance(found, Lack):
            result[name] = found.why
        elif found is not None:
            arguments.append(found)
    return result, arguments


def _of_team(reasons: Sequence[Unavailable]) -> Unavailable:
    """Return the nearest of the reasons of a team's types, as if of one unit."""
    return nearest(reasons)._replace(among=())


@functools.lru_cache(1024)
def _uses(names: tuple[str, ...]) -> tuple[tuple[str, Use | None], ...]:
    """Return the uses that a team's actions ask about, by the actions' names."""
    return tuple((name, asked_by(catalogue()[name], of_side=False)) for name in names)


@functools.cache
def _is_paid(of_map: MapFacts, action: str, unit_type: str) -> bool:
    """Return True if an action costs anything."""
    function = catalogue()[action].pysc2
    return function is not None and any(any(price_of(case)) for case in cases(of_map, function.ability_id, unit_type))


@functools.lru_cache(1024)
def _skills(names: tuple[str, ...]) -> dict[str, int]:
    """Return the abilities of the actions that are skills, by the names of their functions without the prefix.

    To call a skill off is no skill: it would be ready while the skill itself cools down.
    """
    actions = (catalogue()[name] for name in names)
    functions = (action.pysc2 for action in actions if action.group == "skill")
    skills = [f for f in functions if f is not None and not f.stem.startswith("Cancel_")]
    return {f.stem.partition("_")[2] or f.stem: f.ability_id for f in skills}


@functools.lru_cache(4096)
def _unavailable(action: str, reason: str) -> UnavailableAction:
    return UnavailableAction(action=action, reason=reason)
