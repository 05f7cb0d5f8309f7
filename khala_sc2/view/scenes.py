"""Scenes of the map: as recorded, or made of what the agents saw.

Recorded scenes pass as the bytes that they are. A recording of an older version has none; then units are where the
agents' observations have them, and those that were not seen at a step are remembered for some seconds.
"""

from __future__ import annotations

import contextlib
from functools import cache
from typing import TYPE_CHECKING

from khala_bridge.knowledge import WORKERS, knowledge
from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic
from khala_protocol.messages import (
    LOOPS_PER_S,
    Observation,
    PlayerMark,
    Scene,
    UnitDetails,
    UnitFlag,
    UnitMark,
    UnitView,
)
from khala_sc2.view.digest import tag_number, value_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_protocol.messages import Landmark, View
    from khala_sc2.view.index import Index

REMEMBERED_S = 20.0
"""Units that move are forgotten when nobody has seen them for so long; structures never are."""
EARLIER = 8
"""Steps before the first one that is wanted, whose observations say what is remembered."""
_RADIUS = 0.375
"""Of a type that nothing is known of, in world units."""
_NOWHERE = (-1.0, -1.0)


def recorded_scenes(index: Index, episode: int, first: int, last: int) -> bytes:
    """Return the answer with the recorded scenes of these steps, as JSON."""
    scenes = {found.step: index.payload(found.spot) for found in index.at(Topic.SCENE, episode, first, last)}
    return b'{"scenes":[%s]}' % b",".join(scenes.values())


def from_views(
    index: Index, run: str, sides: Sequence[str], episode: int, first: int, last: int, scale: float
) -> Iterator[Scene]:
    """Yield scenes made of observations, from step to step; `scale` is cells of the minimap per world unit."""
    known = _Known(sides, scale)
    by_step: dict[int, list[Observation]] = {}
    for found in index.at(Topic.OBSERVATION, episode, first - EARLIER, last):
        with contextlib.suppress(PeerError):
            said = decode_as(Observation, index.payload(found.spot))
            by_step.setdefault(found.step, []).append(said)
    for step, seen in sorted(by_step.items()):
        loop = max(said.game_loop for said in seen)
        known.begin(loop)
        for said in seen:
            if said.side in sides:
                known.take(said.side, said.view)
        if step >= first:
            yield known.scene(run, episode, step)


class _Known:
    """What the agents of all sides know at a step: units by their tags, and the newest view of each side."""

    def __init__(self, sides: Sequence[str], scale: float) -> None:
        self._sides = tuple(sides)
        self._scale = scale
        self._units: dict[int, tuple[int, UnitMark]] = {}
        self._views: dict[str, View] = {}
        self._loop = 0

    def begin(self, loop: int) -> None:
        """Go on to the next step, and forget what was not seen for long."""
        self._loop = loop
        oldest = loop - REMEMBERED_S * LOOPS_PER_S
        self._units = {
            tag: (at, mark) for tag, (at, mark) in self._units.items()
            if at >= oldest or mark.flags & UnitFlag.STRUCTURE
        }  # fmt: skip

    def take(self, side: str, view: View) -> None:
        """Take in what an agent sees."""
        own = self._player(side)
        enemy = self._enemy(side)
        for team in view.teams:
            for unit in (*team.units, *team.allies):
                self._see(unit, own, side)
            for unit in team.enemies:
                self._see(unit, enemy, side)
        for event in (*view.events, *(event for team in view.teams for event in team.events)):
            if event.what == "died":
                self._units.pop(tag_number(event.tag), None)
        for landmark in view.landmarks:
            if landmark.what == "structure" and tag_number(landmark.tag) not in self._units:
                self._see(_standing(landmark), own, side)
        if view.counts is not None or side not in self._views:  # those who lead know most
            self._views[side] = view

    def scene(self, run: str, episode: int, step: int) -> Scene:
        """Return the scene of this step."""
        marks = tuple(
            mark if at == self._loop else mark._replace(flags=mark.flags | UnitFlag.REMEMBERED, seen_by=0)
            for at, mark in self._units.values()
        )
        return Scene.model_construct(  # of parts that were checked
            run=run,
            episode=episode,
            step=step,
            game_loop=self._loop,
            sides=self._sides,
            whole=False,
            players=tuple(self._players(marks)),
            units=marks,
        )

    def _player(self, side: str) -> int:
        return self._sides.index(side) + 1

    def _enemy(self, side: str) -> int:
        others = [other for other in self._sides if other != side]
        return self._player(others[0]) if others else len(self._sides) + 1

    def _see(self, unit: UnitView, player: int, side: str) -> None:
        tag = tag_number(unit.tag)
        at, known = self._units.get(tag, (-1, None))
        mark = _mark(unit, player, self._scale)
        if known is not None and at == self._loop:
            mark = mark._replace(seen_by=known.seen_by)
            if known.order and not mark.order:  # only its own side knows it
                mark = mark._replace(order=known.order, target=known.target, to_x=known.to_x, to_y=known.to_y)
        self._units[tag] = self._loop, mark._replace(seen_by=mark.seen_by | 1 << self._sides.index(side))

    def _players(self, marks: Iterable[UnitMark]) -> Iterator[PlayerMark]:
        sides = self._sides if len(self._sides) > 1 else (*self._sides, "")
        for number, side in enumerate(sides, start=1):
            mine = [mark for mark in marks if mark.player == number]
            workers = sum(bool(mark.flags & UnitFlag.WORKER) for mark in mine)
            value = sum(value_of(mark.type) for mark in mine if mark.flags & UnitFlag.ARMY)
            seen = PlayerMark(
                player=number, side=side, race=_race(mine), units=len(mine), workers=workers, army_value=int(value)
            )
            view = self._views.get(side)
            yield seen.but(**_means(view)) if view else seen


def _means(view: View) -> dict[str, object]:
    """Return what a view says of its side as a whole."""
    found: dict[str, object] = {
        "minerals": view.resources.minerals,
        "vespene": view.resources.vespene,
        "supply_used": view.resources.supply_used,
        "supply_cap": view.resources.supply_cap,
        "upgrades": view.upgrades,
    }
    if view.army is not None:
        found["army_value"] = view.army.value
    if view.economy is not None:
        found["income"] = view.economy.income
    if view.counts is not None:
        found["workers"] = sum(count.ready for count in view.counts.units if count.type in WORKERS)
    return found


def _mark(unit: UnitView, player: int, scale: float) -> UnitMark:
    order = unit.orders[0] if unit.orders else None
    to = (order.minimap if order else None) or _NOWHERE
    return UnitMark(
        tag=tag_number(unit.tag),
        type=unit.type,
        player=player,
        x=unit.minimap[0],
        y=unit.minimap[1],
        radius=_radius(unit.type, scale),
        facing=0.0,
        health=unit.health,
        health_max=unit.health_max,
        shield=unit.shield,
        shield_max=unit.shield_max,
        energy=unit.energy,
        progress=unit.build_progress,
        flags=_flags(unit),
        seen_by=0,
        order=unit.order or "",
        target=tag_number(order.target) if order and order.target else 0,
        to_x=to[0],
        to_y=to[1],
    )


def _standing(landmark: Landmark) -> UnitView:
    """Return a structure of which only the place is known: as if it were whole."""
    facts = knowledge().get(landmark.type)
    health, shield = (facts.health, facts.shield) if facts else (1.0, 0.0)
    return UnitView(
        tag=landmark.tag, type=landmark.type, alliance="own", screen=(0.0, 0.0), minimap=landmark.minimap,
        health=health, health_max=health, shield=shield, shield_max=shield,
    )  # fmt: skip


def _flags(unit: UnitView) -> int:
    details = unit.details or UnitDetails()
    return (
        _kind(unit.type)
        | UnitFlag.FLYING * unit.flying
        | UnitFlag.BURROWED * details.burrowed
        | UnitFlag.CLOAKED * unit.cloaked
        | UnitFlag.HALLUCINATION * unit.hallucination
        | UnitFlag.UNPOWERED * details.unpowered
    )


@cache
def _kind(name: str) -> int:
    """Return the flags of a type."""
    facts = knowledge().get(name)
    if facts is None:
        return 0
    if facts.structure:
        return int(UnitFlag.STRUCTURE)
    return int(UnitFlag.WORKER if facts.worker else UnitFlag.ARMY if facts.weapons else 0)


@cache
def _radius(name: str, scale: float) -> float:
    facts = knowledge().get(name)
    return round((facts.radius if facts and facts.radius else _RADIUS) * scale, 3)


def _race(marks: Sequence[UnitMark]) -> str:
    found = (knowledge().get(mark.type) for mark in marks)
    return next((facts.race for facts in found if facts is not None and facts.race != "neutral"), "")
