"""Whether messages between agents arrived, and whether their readers did anything about them.

A message names tags (`0x1002c0001`), points of the minimap (`[41.4, 25]`), places (`Base 2`) and types of units
(`Photon Cannons`). An order names the tag that it takes and the type of that unit, the point of the minimap that it
takes, and the type that it makes. Points on a screen are not compared: each reader has its own.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from khala_bridge.knowledge import knowledge
from khala_protocol.messages import count_refusals
from khala_sc2.experiment.measures.evidence import tags

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from khala_protocol.messages import Observation, Point, Received, UnitView
    from khala_sc2.experiment.measures.evidence import RecordedDecision, SideStep

NEAR_MINIMAP = 4.0
"""Cells of the minimap, 1/16 of its width, within which two points are the same place."""
_POINT = re.compile(r"[\[(]\s*(\d+(?:\.\d+)?)\s*,\s*(\d+(?:\.\d+)?)\s*[\])]")
_ORDER = re.compile(r"<(?:Standing\()?(\w+)(.*)>", re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class Communication:
    """Communication between the agents of a side. Advice from outside is not among it.

    Whether a message was true is measured as far as its tags say: what else it meant, only a person could say.
    """

    messages_sent: int
    """Messages that agents wrote, undeliverable ones among them."""
    messages_undeliverable: int
    """Of these: to nobody that the sender can write to."""
    messages_unfounded: int | None
    """Of `messages_sent`: it names a tag that was not in the observation from which it was written; None if no message
    named a tag."""
    messages_read: int
    """Pairs of a message and a reader, where the message stood in an observation that the reader's policy answered.
    What an observation shows again does not count again."""
    messages_answered: int
    """Of `messages_read`: in that answer the reader wrote to the sender, or to the channel of the message."""
    messages_acted_on: int
    """Of `messages_read`: in that answer the reader gave an order that was carried out, that it had not given in its
    answer before, and that names a unit, a place within 4 cells of the minimap, or a type that the message names."""
    messages_heeded: int
    """Of `messages_read`: answered, acted on, or both."""
    heeded_share: float | None
    """`messages_heeded` / `messages_read`, 0 to 1; None if nothing was read."""


class CommunicationTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._sent = self._undeliverable = self._read = self._answered = self._acted = self._heeded = 0
        self._tagged = self._unfounded = 0
        self._orders: dict[str, frozenset[str]] = {}
        """By agent, the orders of its last answer."""

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        self._sent += len(step.messages)
        refusals = count_refusals(rejection for agent in step.report.agents for rejection in agent.rejections)
        self._undeliverable += refusals["unknown_recipient"]
        for decision in step.decisions:
            if decision.is_of_policy:
                self._check(decision, step)
                self._answer(decision, step)

    def _check(self, decision: RecordedDecision, step: SideStep) -> None:
        """Look for the tags of an agent's messages in the observation from which it wrote them."""
        for message in step.messages:
            named = tags(message.text) if message.sender == decision.report.agent else frozenset()
            if named and decision.question and decision.question.whole:
                self._tagged += 1
                self._unfounded += not named <= tags(decision.question.whole.text)

    def _answer(self, decision: RecordedDecision, step: SideStep) -> None:
        agent = decision.report.agent
        given = frozenset(decision.report.accepted)
        new = given - self._orders.get(agent, frozenset())
        self._orders[agent] = given
        wrote_to = {message.recipient.casefold() for message in step.messages if message.sender == agent}
        for message in _read(decision):
            answers = not wrote_to.isdisjoint({message.sender.casefold(), message.recipient.casefold()})
            acts = bool(new) and is_acted_on(message.text, new, decision.question.whole if decision.question else None)
            self._read += 1
            self._answered += answers
            self._acted += acts
            self._heeded += answers or acts

    def total(self) -> Communication:
        """Return the group."""
        return Communication(
            messages_sent=self._sent,
            messages_undeliverable=self._undeliverable,
            messages_unfounded=self._unfounded if self._tagged else None,
            messages_read=self._read,
            messages_answered=self._answered,
            messages_acted_on=self._acted,
            messages_heeded=self._heeded,
            heeded_share=self._heeded / self._read if self._read else None,
        )


def _read(decision: RecordedDecision) -> Iterator[Received]:
    """Yield the messages of other agents that an answer is the first to; an adviser's name has its role in brackets."""
    for message in decision.question.glance.messages if decision.question else ():
        if not message.again and not message.sender.endswith(")"):
            yield message


def is_acted_on(text: str, orders: Collection[str], seen: Observation | None) -> bool:
    """Return True if any of these orders names what a message names.

    Args:
        text: of the message.
        orders: as they were accepted, `Stalker-1 <Attack_Unit(0x1)>`.
        seen: the observation in which the reader found the message.
    """
    named = tags(text)
    points = [*_points(text), *_places(text, seen)]
    types = {unit.tag.casefold(): unit.type for unit in _units(seen)}
    for name, arguments in (found.groups() for order in orders if (found := _ORDER.search(order))):
        targets = tags(arguments)
        if not named.isdisjoint(targets):
            return True
        if any(_names_type(text, type_) for type_ in (*name.split("_"), *(types.get(tag, "") for tag in targets))):
            return True
        goals = _points(arguments) if name.endswith("_Minimap") else ()
        if any(math.dist(goal, point) <= NEAR_MINIMAP for goal in goals for point in points):
            return True
    return False


def _points(text: str) -> list[Point]:
    return [(float(x), float(y)) for x, y in _POINT.findall(text)]


def _places(text: str, seen: Observation | None) -> Iterator[Point]:
    """Yield the points of the named places in a text."""
    for place in seen.view.places if seen else ():
        if re.search(rf"\b{re.escape(place.name)}\b", text, re.IGNORECASE):
            yield place.minimap


def _units(seen: Observation | None) -> Iterator[UnitView]:
    for team in seen.view.teams if seen else ():
        yield from (*team.units, *team.allies, *team.enemies, *team.resources)


def _names_type(text: str, word: str) -> bool:
    """Return True if a word is a type of unit, and the text names it, in one word or several, one or many."""
    return word in knowledge() and _name_pattern(word).search(text) is not None


@cache
def _name_pattern(type_: str) -> re.Pattern[str]:
    return re.compile(rf"\b{re.sub(r'(?<=[a-z])(?=[A-Z])', ' ?', type_)}e?s?\b", re.IGNORECASE)
