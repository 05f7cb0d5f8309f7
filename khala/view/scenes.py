"""Scenes of the map: as recorded, or made of what the agents saw.

Recorded scenes pass as the bytes that they are. A recording of an older version has none; then units are where the
agents' observations have them, and those that were not seen at a step are remembered for some seconds.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any

from pydantic_core import from_json

from khala.view.digest import OPPONENT, is_structure, value_of
from khala.view.scan import WRONG
from khala_bridge.knowledge import is_armed, knowledge
from khala_protocol.keys import Topic
from khala_protocol.messages import LOOPS_PER_S, PlayerMark, Scene, UnitFlag, UnitMark

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala.view.index import Found, Index

NOBODY = 16
"""The player of what is neutral, as the game numbers it."""
REMEMBERED_S = 20.0
"""Units that move are forgotten when nobody has seen them for so long; structures never are."""
EARLIER = 8
"""Steps before the first one that is wanted, whose observations say what is remembered."""
_RADIUS = 0.375
"""Of a type that nothing is known of, in world units."""


def recorded(index: Index, episode: int, first: int, last: int) -> bytes:
    """Return the answer with the recorded scenes of these steps, as JSON."""
    scenes = {found.step: index.payload(found.spot) for found in index.at(Topic.SCENE, episode, first, last)}
    return b'{"scenes":[%s]}' % b",".join(scenes.values())


def from_views(
    index: Index, run: str, sides: Sequence[str], episode: int, first: int, last: int, scale: float
) -> Iterator[Scene]:
    """Yield scenes made of observations.

    Args:
        scale: cells of the minimap per world unit.
    """
    memory = _Sighted(sides, scale)
    by_step: dict[int, list[Found]] = {}
    for found in index.at(Topic.OBSERVATION, episode, first - EARLIER, last):
        by_step.setdefault(found.step, []).append(found)
    for step, those in sorted(by_step.items()):
        seen = [said for found in those if (said := _read(index, found)) is not None]
        loop = max((said["game_loop"] for said in seen), default=0)
        memory.begin(loop)
        for said in seen:
            memory.take(said)
        if step >= first:
            yield memory.scene(run, episode, step, loop)


def _read(index: Index, found: Found) -> dict[str, Any] | None:
    try:
        said: dict[str, Any] = from_json(index.payload(found.spot), allow_inf_nan=False)
        return said if said["view"] and said["game_loop"] >= 0 else None
    except WRONG:
        return None


class _Sighted:
    """What the agents of all sides saw, by tag."""

    def __init__(self, sides: Sequence[str], scale: float) -> None:
        self._sides, self._scale = tuple(sides), scale
        self._units: dict[int, tuple[int, UnitMark]] = {}
        self._resources: dict[str, dict[str, Any]] = {}
        self._views: dict[str, dict[str, Any]] = {}
        self._loop = 0

    def begin(self, loop: int) -> None:
        """Go on to the next step, and forget what was not seen for long."""
        self._loop = loop
        oldest = loop - REMEMBERED_S * LOOPS_PER_S
        self._units = {
            tag: (at, unit) for tag, (at, unit) in self._units.items()
            if at >= oldest or unit.flags & UnitFlag.STRUCTURE
        }  # fmt: skip

    def take(self, said: dict[str, Any]) -> None:
        """Take in an observation."""
        side, view = said["side"], said["view"]
        number = self._player(side)
        for team in view["teams"]:
            for group in ("units", "allies", "enemies"):
                player = self._enemy(side) if group == "enemies" else number
                for unit in team.get(group, ()):
                    self._see(unit, player, side)
            self._bury(team.get("events", ()))
        self._bury(view.get("events", ()))
        for landmark in view.get("landmarks", ()):
            if landmark["what"] == "structure" and int(landmark["tag"], 16) not in self._units:
                self._stand(landmark, number, side)
        known = self._views.get(side, {})
        self._views[side] = known | {name: value for name, value in view.items() if value is not None}

    def scene(self, run: str, episode: int, step: int, loop: int) -> Scene:
        """Return the scene of this step."""
        units = tuple(
            unit if at == loop else unit._replace(flags=unit.flags | UnitFlag.REMEMBERED, seen_by=0)
            for at, unit in self._units.values()
        )
        return Scene(
            run=run,
            episode=episode,
            step=step,
            game_loop=loop,
            sides=self._sides,
            whole=False,
            players=tuple(self._players(units)),
            units=units,
        )

    def _player(self, side: str) -> int:
        return self._sides.index(side) + 1

    def _enemy(self, side: str) -> int:
        others = [other for other in self._sides if other != side]
        return self._player(others[0]) if others else len(self._sides) + 1

    def _bury(self, events: Iterable[dict[str, Any]]) -> None:
        for event in events:
            if event["what"] == "died":
                self._units.pop(int(event["tag"], 16), None)

    def _see(self, unit: dict[str, Any], player: int, side: str) -> None:
        tag, kind = int(unit["tag"], 16), unit["type"]
        at, known = self._units.get(tag, (-1, None))
        seen_by = 1 << self._sides.index(side) | (known.seen_by if known and at == self._loop else 0)
        order = next(iter(unit.get("orders") or ()), {})
        to = order.get("minimap") or (-1.0, -1.0)
        facts = knowledge().get(kind)
        mark = UnitMark(
            tag=tag,
            type=kind,
            player=player,
            x=unit["minimap"][0],
            y=unit["minimap"][1],
            radius=round((facts.radius if facts and facts.radius else _RADIUS) * self._scale, 3),
            facing=0.0,
            health=unit["health"],
            health_max=unit["health_max"],
            shield=unit.get("shield", 0.0),
            shield_max=unit.get("shield_max", 0.0),
            energy=unit.get("energy", 0.0),
            progress=unit.get("build_progress", 1.0),
            flags=_flags(unit),
            seen_by=seen_by,
            order=unit.get("order") or order.get("name") or "",
            target=int(order["target"], 16) if order.get("target") else 0,
            to_x=to[0],
            to_y=to[1],
        )
        if known is not None and at == self._loop and not mark.order and known.order:
            mark = mark._replace(order=known.order, target=known.target, to_x=known.to_x, to_y=known.to_y)
        self._units[tag] = self._loop, mark

    def _stand(self, landmark: dict[str, Any], player: int, side: str) -> None:
        facts = knowledge().get(landmark["type"])
        health, shield = (facts.health, facts.shield) if facts else (1.0, 0.0)
        whole = {
            "tag": landmark["tag"], "type": landmark["type"], "minimap": landmark["minimap"], "health": health,
            "health_max": health, "shield": shield, "shield_max": shield,
        }  # fmt: skip
        self._see(whole, player, side)

    def _players(self, units: Iterable[UnitMark]) -> Iterator[PlayerMark]:
        mine: dict[int, list[UnitMark]] = {}
        for unit in units:
            mine.setdefault(unit.player, []).append(unit)
        for number, side in enumerate(chain(self._sides, [] if len(self._sides) > 1 else [""]), start=1):
            those = mine.get(number, [])
            view = self._views.get(side, {})
            resources = view.get("resources", {})
            economy, army = view.get("economy"), view.get("army")
            value = sum(value_of(unit.type) for unit in those if unit.flags & UnitFlag.ARMY)
            yield PlayerMark(
                player=number,
                side=side,
                race=_race(those),
                units=len(those),
                workers=sum(bool(unit.flags & UnitFlag.WORKER) for unit in those),
                army_value=int(army["value"] if army else value),
                minerals=resources.get("minerals"),
                vespene=resources.get("vespene"),
                supply_used=resources.get("supply_used"),
                supply_cap=resources.get("supply_cap"),
                income=tuple(economy["income"]) if economy else None,
                upgrades=tuple(view.get("upgrades", ())),
            )


def _flags(unit: dict[str, Any]) -> int:
    kind = unit["type"]
    facts = knowledge().get(kind)
    details = unit.get("details") or {}
    found = {
        UnitFlag.STRUCTURE: is_structure(kind),
        UnitFlag.WORKER: facts is not None and facts.worker,
        UnitFlag.ARMY: facts is not None and not facts.structure and not facts.worker and is_armed(kind),
        UnitFlag.FLYING: unit.get("flying", False),
        UnitFlag.BURROWED: details.get("burrowed", False),
        UnitFlag.CLOAKED: unit.get("cloaked", False),
        UnitFlag.HALLUCINATION: unit.get("hallucination", False),
        UnitFlag.UNPOWERED: details.get("unpowered", False),
    }
    return sum(flag for flag, is_set in found.items() if is_set)


def _race(units: Sequence[UnitMark]) -> str:
    found = (knowledge().get(unit.type) for unit in units)
    return next((facts.race for facts in found if facts is not None and facts.race), "")


__all__ = ["EARLIER", "NOBODY", "OPPONENT", "from_views", "recorded"]
