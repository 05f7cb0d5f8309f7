"""Standing orders: calls that the host gives again and again, until they are revoked or their end is reached.

A standing order goes the way of every other call, through `khala_bridge.act.translate` and its judgement. It comes
after what agents say in the same turn, and is given at most once a turn. An order to a team with units is for those
that are idle. One to the whole side that makes something waits while all that could make it are busy, so that no queue
ties up minerals; a cast needs no place in a queue, so a Nexus that trains Probes can boost itself.

State of one episode, a function of the words and the snapshots since its beginning. What an order waits for is no
state: it is judged at the moment in which an agent is shown it. `khala_bridge.act.actor` is above.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.act.rejected import CallRejected
from khala_bridge.act.translate import Trial
from khala_bridge.observe.triggers import were_attacked
from khala_bridge.rules import facts_for
from khala_protocol.messages import Rejection, StandingView

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.act.recognise import Recognised
    from khala_bridge.act.translate import Command, Translator
    from khala_bridge.act.until import Until
    from khala_bridge.observe.observation import SideObservation
    from khala_bridge.state import Snapshot

PASSING = frozenset({"not_available", "too_many_actions"})
"""Reasons of a refusal that may pass; a call that is refused for another one at first does not stand at all."""
LASTING = frozenset({"dead_target", "unknown_target"})
"""Reasons that end an order in force: its target is gone."""


@dataclass(slots=True)
class _Order:
    """One order in force, or one that has ended since its agent was asked."""

    number: int
    said: Recognised
    until: Until
    vitals: dict[int, float]
    """Health and shield by tag of the units whose fate may end it, in the step before."""
    times: int = 0
    ended: str = ""
    """Why it has ended, which its agent is yet to be told; "" if it is in force."""

    @property
    def text(self) -> str:
        """The order as its agent reads it, `Developer <Train_Probe()> until 22 Probe`."""
        return f"{self.said.text} until {self.until.text}" if self.until.text else self.said.text

    def view(self, waits_for: str = "") -> StandingView:
        """Return the order as its agent sees it."""
        return StandingView(
            number=self.number, order=self.text, times=self.times, waits_for=waits_for, ended=self.ended
        )


class _Wait(NamedTuple):
    """Why an order is not given."""

    why: str
    for_good: bool = False


@dataclass(slots=True)
class StandingOrders:
    """The standing orders of a side in one episode."""

    most: int
    """Number of orders of one team."""
    _orders: dict[str, list[_Order]] = field(default_factory=dict)
    """By agent, in the order in which they were given."""
    _given: dict[str, int] = field(default_factory=dict)
    """By agent, how many it has given in the episode."""

    def clear(self) -> None:
        """Forget the episode before."""
        self._orders.clear()
        self._given.clear()

    def copy(self) -> StandingOrders:
        """Return the same orders, to try what a reply would do to them."""
        orders = {agent: [replace(order) for order in mine] for agent, mine in self._orders.items()}
        return StandingOrders(self.most, orders, dict(self._given))

    def views(self, agent: str, observation: SideObservation, translator: Translator) -> tuple[StandingView, ...]:
        """Return an agent's orders in force, and those that have ended since it was asked.

        What they wait for is judged now, for all agents in their order, as if none of them said anything more.

        Args:
            agent: the agent.
            observation: of this moment.
            translator: of a turn in which nothing was said.
        """
        if not self._orders.get(agent):
            return ()
        waits: dict[int, str] = {}
        for name in observation.configs:
            found = {order.number: _try(order, observation, translator) for order in self._in_force(name)}
            if name == agent:
                waits = {number: tried.why for number, tried in found.items() if isinstance(tried, _Wait)}
                break
        return tuple(order.view(waits.get(order.number, "")) for order in self._orders[agent])

    def forget_ended(self, agent: str) -> None:
        """Forget the orders of an agent that have ended, once it was shown them."""
        self._orders[agent] = self._in_force(agent)

    def begin(self, said: Recognised, until: Until, translator: Translator, observation: SideObservation) -> None:
        """Take an order; the same order again only changes its end.

        Raises:
            CallRejected: it could never be carried out, is over already, or is one too many.
        """
        agent = said.team.agent
        team = said.team.name
        if said.action.actor_count:
            raise CallRejected("wrong_arguments", f"{said.action.name} names a unit: a standing order is for a team.")
        if until.is_reached(observation.snapshot, attacked=False):
            raise CallRejected("not_available", f"The end of this standing order is reached already: {until.text}.")
        mine = [order for order in self._in_force(agent) if order.said.team.name == team]
        for order in mine:
            if order.said.text == said.text:
                order.until = until
                return
        if len(mine) >= self.most:
            raise CallRejected("too_many_actions", self._too_many(team, mine))
        first = translator.try_(said)
        if isinstance(first, Rejection) and first.reason not in PASSING:
            raise CallRejected(first.reason, first.message)
        self._given[agent] = self._given.get(agent, 0) + 1
        order = _Order(self._given[agent], said, until, _vitals(said, observation))
        self._orders.setdefault(agent, []).append(order)

    def revoke(self, agent: str, number: int) -> None:
        """End an order.

        Raises:
            CallRejected: there is no such order in force.
        """
        mine = self._in_force(agent)
        found = [order for order in mine if order.number == number]
        if not found:
            yours = f"yours are {', '.join(str(order.number) for order in mine)}" if mine else "you have none"
            raise CallRejected("unknown_target", f"You have no standing order {number}; {yours}.")
        self._orders[agent].remove(found[0])

    def carry_out(self, observation: SideObservation, translator: Translator) -> Iterator[Command]:
        """Yield the commands of all orders that are possible now, and end those that are over."""
        for agent in observation.agents:
            for order in self._in_force(agent):
                vitals = _vitals(order.said, observation)
                attacked = were_attacked(order.vitals, vitals, observation.died)
                order.vitals = vitals
                if order.until.is_reached(observation.snapshot, attacked=attacked):
                    order.ended = "its end is reached"
                else:
                    yield from _give(order, observation, translator)

    def _in_force(self, agent: str) -> list[_Order]:
        return [order for order in self._orders.get(agent, ()) if not order.ended]

    def _too_many(self, team: str, mine: Sequence[_Order]) -> str:
        if not self.most:
            return "There are no standing orders in this task: give the order itself, again when it is needed."
        numbers = ", ".join(str(order.number) for order in mine)
        return (
            f"Team {team} has its {self.most} standing orders already: revoke one of {numbers} with <Revoke(number)>."
        )


def _give(order: _Order, observation: SideObservation, translator: Translator) -> Sequence[Command]:
    """Return the commands of an order, none if it has to wait."""
    tried = _try(order, observation, translator)
    if isinstance(tried, Trial):
        order.times += 1
        return [replace(command, said=None) for command in tried.commands]
    if tried.for_good:
        order.ended = tried.why
    return ()


def _try(order: _Order, observation: SideObservation, translator: Translator) -> Trial | _Wait:
    """Return the commands of an order, entered in the accounts of the turn; or why it has to wait."""
    said = _for_the_idle(order.said, observation, translator)
    if isinstance(said, str):
        return _Wait(said)
    trial = translator.try_(said)
    if isinstance(trial, Rejection):
        return _Wait(trial.message.rpartition(" now: ")[2].rstrip("."), for_good=trial.reason in LASTING)
    if any(_has_to_queue(command, tag, observation.snapshot) for command in trial.commands for tag in command.units):
        return _Wait("all that could do it are busy")
    translator.keep(trial)
    return trial


def _for_the_idle(said: Recognised, observation: SideObservation, translator: Translator) -> Recognised | str:
    """Return the call for the units of its team that have no order; a reason if there are none."""
    if said.team.kind == "side":
        return said
    units = observation.snapshot.units
    team = observation.team_now(said.team)
    if team is None:
        return "the team has no units"
    idle = tuple(tag for tag in team.tags if tag in units and not units[tag].orders and tag not in translator.ordered)
    if not idle:
        return "no unit of the team is idle"
    return replace(said, team=replace(said.team, team=replace(team, tags=idle)))


def _has_to_queue(command: Command, tag: int, snapshot: Snapshot) -> bool:
    """Return whether a structure would make something only after what it makes now."""
    unit = snapshot.units[tag]
    if not (unit.is_structure and unit.orders):
        return False
    facts = facts_for(snapshot.facts, command.function.ability_id, unit.name, snapshot.upgrades)
    return facts is None or bool(facts.produces or facts.researches)


def _vitals(said: Recognised, observation: SideObservation) -> dict[int, float]:
    """Return health and shield of the units of a call's team; of the whole side, if the team is one of it."""
    units = observation.snapshot.units
    if said.team.kind == "side":
        tags: Sequence[int] = [unit.tag for unit in observation.snapshot.own]
    else:
        team = observation.team_now(said.team)
        tags = team.tags if team else ()
    return {tag: units[tag].health + units[tag].shield for tag in tags if tag in units}
