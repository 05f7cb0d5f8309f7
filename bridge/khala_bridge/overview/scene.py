"""The units of all sides at one moment, put together from what each of them sees and from the whole map.

Each unit is told by whoever knows it best: its own side, which alone knows its order and its cooldown; then a side that
sees it; then the whole map, on which the game gives no health of what is in the fog; then a memory.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.names import effect_name
from khala_bridge.overview.grids import join, pack, value_at
from khala_bridge.overview.marks import ARMY, WORKER, Pen
from khala_bridge.overview.terrain import is_ground
from khala_bridge.state import Alliance, Display
from khala_protocol.messages import EffectMark, PlayerMark, PowerMark, Scene

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from khala_bridge.state import Effect, Snapshot, Unit
    from khala_protocol.messages import Frames, Terrain, UnitMark

_NOBODY = 16
_VISIBLE, _OWN = Display.VISIBLE, Alliance.OWN
_SLACK_LOOPS = 0.5
"""A weapon has fired if its cooldown is so much longer than what was left of the one before."""


class Watched(NamedTuple):
    """What one side sees at one moment."""

    side: str
    now: Snapshot
    before: Snapshot | None = None
    """At the scene before; None at the first one."""


def scene_of(
    sides: Sequence[Watched],
    whole: Snapshot | None,
    terrain: Terrain,
    frames: Frames,
    *,
    step: int,
) -> Scene:
    """Return the map at one step.

    Args:
        sides: that Khala plays, all at the same moment.
        whole: of the whole map at this moment; None if the game does not show it.
        terrain: of the episode.
        frames: of the task.
        step: number of the step.
    """
    first = sides[0].now
    pen = Pen.of(first.info.frame(frames))
    known = _together(sides, whole)
    units = tuple(_marks(known, sides, terrain, pen))
    creep = whole.creep if whole else join(side.now.creep for side in sides)
    return Scene.model_construct(  # it is made here, and checked where it is read: 0.4 ms for 100 units
        run=terrain.run,
        episode=terrain.episode,
        step=step,
        game_loop=first.game_loop,
        sides=tuple(side.side for side in sides),
        whole=whole is not None or len(sides) > 1,
        players=tuple(_players(sides, known, units)),
        units=units,
        effects=tuple(dict.fromkeys(_effects(sides, whole, pen))),
        power=tuple(_power(sides, pen)),
        gone=tuple(sorted(_gone(sides, whole, terrain, pen))),
        creep=pack(creep) if any(creep.data) else None,
        fog={side.side: pack(side.now.visibility) for side in sides if side.now.visibility.data},
    )


# --- units ------------------------------------------------------------------------------------------


def _together(sides: Sequence[Watched], whole: Snapshot | None) -> dict[int, Unit]:
    """Return every unit that is known of, by its tag, as whoever knows it best tells it."""
    found: dict[int, Unit] = {}
    for side in sides:
        if whole is None:
            found |= side.now.known
        else:
            found |= side.now.units
    found |= whole.known if whole else {}
    for side in sides:
        found |= {tag: unit for tag, unit in side.now.units.items() if unit.display_type is _VISIBLE}
    for side in sides:
        found |= {unit.tag: unit for unit in side.now.own}
    players = {side.now.player.player_id for side in sides}  # they know themselves what they have lost
    return {tag: unit for tag, unit in found.items() if not (unit.is_remembered and unit.owner in players)}


def _marks(known: Mapping[int, Unit], sides: Sequence[Watched], terrain: Terrain, pen: Pen) -> Iterator[UnitMark]:
    """Yield the marks of all units but those of the terrain, in the order of tags."""
    ground = {(mark.x, mark.y) for mark in terrain.resources}
    fire = {tag for side in sides for tag in _shooters(side)}
    looks = [(1 << index, side.now.units) for index, side in enumerate(sides)]
    for tag in sorted(known):
        unit = known[tag]
        if is_ground(unit) and pen.place(unit.pos) in ground:
            continue
        seen_by = sum(bit for bit, seen in looks if tag in seen)
        yield pen.mark(unit, known, seen_by=seen_by, fires=tag in fire)


def _shooters(side: Watched) -> Iterator[int]:
    """Yield the side's units that have fired since the scene before."""
    if side.before is None:
        return
    was = side.before.known
    passed = side.now.game_loop - side.before.game_loop
    for unit in side.now.own:
        if unit.weapon_cooldown and unit.tag in was:
            left = max(was[unit.tag].weapon_cooldown - passed, 0.0)
            if unit.weapon_cooldown > left + _SLACK_LOOPS:
                yield unit.tag


# --- players ----------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Count:
    """What a player has on the map."""

    units: int = 0
    workers: int = 0
    army_value: float = 0.0
    race: str = ""


def _players(sides: Sequence[Watched], known: Mapping[int, Unit], units: Iterable[UnitMark]) -> Iterator[PlayerMark]:
    """Yield the players by their numbers; of those that Khala plays, also what only they know."""
    counts: defaultdict[int, _Count] = defaultdict(_Count)
    for mark in units:
        if mark.player != _NOBODY:
            _add(counts[mark.player], mark, known[mark.tag])
    own = {side.now.player.player_id: side for side in sides}
    for number in sorted({*counts, *own}):
        count = counts[number]
        side = own.get(number)
        yield PlayerMark(
            player=number,
            race=count.race or ("" if side else sides[0].now.info.enemy_race),
            units=count.units,
            workers=count.workers,
            army_value=round(count.army_value),
            **(_means(side) if side else {}),
        )


def _add(count: _Count, mark: UnitMark, unit: Unit) -> None:
    count.units += 1
    count.workers += bool(mark.flags & WORKER)
    facts = unit.facts
    if facts is None:
        return
    if mark.flags & ARMY:
        count.army_value += facts.value
    if not count.race and facts.race != "neutral":
        count.race = facts.race


def _means(side: Watched) -> dict[str, object]:
    player, income = side.now.player, side.now.score.income
    return {
        "side": side.side,
        "minerals": player.minerals,
        "vespene": player.vespene,
        "supply_used": player.food_used,
        "supply_cap": player.food_cap,
        "income": (round(income[0], 1), round(income[1], 1)),
        "upgrades": side.now.upgrades,
    }


# --- the ground -------------------------------------------------------------------------------------


def _effects(sides: Sequence[Watched], whole: Snapshot | None, pen: Pen) -> Iterator[EffectMark]:
    for snapshot in (*(side.now for side in sides), *((whole,) if whole else ())):
        for effect in snapshot.effects:
            name = effect_name(effect.effect_id)
            radius = pen.length(effect.radius)
            player = _owner(effect, snapshot)
            yield from (EffectMark(name, player, *pen.place(place), radius) for place in effect.places)


def _owner(effect: Effect, snapshot: Snapshot) -> int:
    """Return whose effect it is; older versions of the game say only whether it is the player's own."""
    return effect.owner or (snapshot.player.player_id if effect.alliance is _OWN else 0)


def _power(sides: Sequence[Watched], pen: Pen) -> Iterator[PowerMark]:
    for side in sides:
        for source in side.now.power_sources:
            yield PowerMark(side.now.player.player_id, *pen.place(source.pos), pen.length(source.radius))


def _gone(sides: Sequence[Watched], whole: Snapshot | None, terrain: Terrain, pen: Pen) -> set[int]:
    """Return the tags of what stood on the map and is gone.

    By places, since the game gives another tag to what a player remembers. A side that has never been there, and does
    not know that anything stands there, knows of no loss either.
    """
    stood = {(mark.x, mark.y): mark.tag for mark in terrain.resources}
    if whole is not None:
        return {stood[place] for place in stood.keys() - _standing(whole, pen)}
    found = set()
    for side in sides:
        for place in stood.keys() - _standing(side.now, pen):
            x, y = place[0] / pen.scale, pen.north - place[1] / pen.scale
            if value_at(side.now.visibility, x, y) != 0:
                found.add(stood[place])
    return found


def _standing(snapshot: Snapshot, pen: Pen) -> set[tuple[float, float]]:
    return {pen.place(unit.pos) for unit in snapshot.known.values() if is_ground(unit)}
