"""Measure the numbers of the texts about units: each is read from the text and played on the engine.

    python -m bench numbers                   every unit type, without and with all upgrades
    python -m bench numbers --kinds Queen     some types

The numbers are parsed from the lines of `khala_bridge.knowledge.short` and `advice`, which observations contain. The
games are those of `khala calibrate`, on the simulator: `khala_bridge.calibrate.lab`.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from statistics import median
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from bench.command_line import make_parser
from khala_bridge.calibrate.cast import armed_types, fact, melee_types, mobile
from khala_bridge.calibrate.lab import ATTACK, ENEMY, LOOPS_PER_SECOND, MOVE, Lab, Put
from khala_bridge.calibrate.setting import Setting
from khala_bridge.knowledge import VERSION, abilities, advice, short
from khala_bridge.knowledge.facts import upgrade_facts
from khala_bridge.knowledge.load import words_of
from khala_bridge.knowledge.prompt import HITS
from khala_simulator.process.client import Client
from khala_simulator.process.session import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_bridge.calibrate.ground import Point

BUILD: Final = 75689
LEVELS: Final = 3
_VICTIMS: Final = {
    "ground": ("Thor", "Ultralisk", "Ravager", "Ghost", "Hydralisk", "Hellion"),
    "air": ("Battlecruiser", "Corruptor", "Banshee", "Mutalisk"),
}
"""Targets without shields, the sturdiest first."""
_PLANES: Final = {words: plane for plane, words in HITS.items()}
_NUMBER: Final = r"([\d.]+)"
_BODY: Final = {
    "health": rf"health {_NUMBER}", "shield": rf"shield {_NUMBER}", "energy": rf"energy up to {_NUMBER}",
    "armor": rf"armor {_NUMBER}", "speed": rf"speed {_NUMBER}", "speed on creep": rf"\({_NUMBER} on creep",
}  # fmt: skip
_UNARMED: Final = (("SwarmHost", 4, 0), ("Raven", 0, 4), ("WarpPrism", 0, -4), ("Overlord", -4, 0))
"""Enemies at which abilities are used, and their places beside the caster: biological, mechanical, psionic ones."""
_SHOTS: Final = 8
_STEP_LOOPS: Final = 2
_MOST_LOOPS: Final = 2400
_CAST_LOOPS: Final = 300
_RESEARCH_LOOPS: Final = 200
_CREEP_LOOPS: Final = 150
_BARRIER_LOOPS: Final = 130
_CHANCE_S: Final = 2 / LOOPS_PER_SECOND
"""The most that chance adds to a period."""
_BACK_S: Final = 0.3
"""Half of the most that the way back adds."""
_INSIDE: Final = 0.08
_OUTSIDE: Final = 0.35
"""World units within and beyond a range at which a unit fires, and first walks."""
_MARINE: Final = 6


class Compared(NamedTuple):
    """A number of a text beside the engine's."""

    kind: str
    what: str
    """Such as `period`."""
    said: float
    found: float
    tolerance: float

    @property
    def differs(self) -> bool:
        """Whether the text is false."""
        return not abs(self.said - self.found) <= self.tolerance


class Arm(NamedTuple):
    """A weapon as a text has it."""

    plane: str
    range: float
    nearest: float
    damage: float
    bonus: dict[str, float]
    hits: int
    period: float
    per_second: float
    returns: bool
    """Whether the next shot waits until what flew is back."""

    def against(self, victim: str) -> float:
        """Return the damage of one shot at a type, by the text and the type's armor."""
        more = sum(value for what, value in self.bonus.items() if what in fact(victim).attributes)
        return self.hits * max(0.5, self.damage + more - fact(victim).armor)


class InProcess:
    """A connection to the simulator without a process and without a socket."""

    def __init__(self, build: int = BUILD) -> None:
        self._client = Client(Session(data_dir=".", base_build=build))

    def send(self, **request: Any) -> Any:
        """See `khala_bridge.calibrate.connection.Connection`."""
        (kind,) = request
        return getattr(self._client.ask(**request), kind)


def new_lab() -> Lab:
    """Begin an empty game on level ground."""
    return Lab(InProcess(), Setting(), seed=1)


def improve(lab: Lab) -> frozenset[str]:
    """Research every upgrade of melee games for the first player; return their names as observations have them."""
    wanted = {name: upgrade for name, upgrade in upgrade_facts(VERSION).items() if upgrade.melee}
    owned: frozenset[str] = frozenset()
    for _ in range(LEVELS):
        lab.cheat("tech_tree", "food", "free", "fast_build")
        left = [upgrade for name, upgrade in wanted.items() if name not in owned]
        for upgrade, (x, y) in zip(left, lab.ground.places(8, 8), strict=False):
            lab.make(Put("Pylon", (int(x) + 3.0, int(y) + 3.0)))
            (place,) = lab.make(Put(upgrade.at[0], (int(x) + 0.5, int(y) + 0.5)))
            if place:
                lab.order(upgrade.ability, place)
        lab.step(_RESEARCH_LOOPS)
        ids = set(lab.observation.observation.raw_data.player.upgrade_ids)
        owned = frozenset(name for name, upgrade in wanted.items() if upgrade.id in ids)
        lab.clear()
    return owned


def arms_of(lines: Sequence[str]) -> Iterator[Arm]:
    """Yield the weapons that lines speak of."""
    for line in lines:
        if not (
            found := re.match(rf"hits ([a-z ]+), range {_NUMBER}(.*?), damage {_NUMBER}(.*) every {_NUMBER} s", line)
        ):
            continue
        plane, reach, rest, damage, more, period = found.groups()
        nearest = re.search(rf"nearer than {_NUMBER}", rest)
        times = re.search(r" x (\d+)", more)
        rate = re.search(rf"{_NUMBER} damage per second", line)
        yield Arm(
            _PLANES[plane],
            float(reach),
            float(nearest[1]) if nearest else 0,
            float(damage),
            {what: float(value) for value, what in re.findall(rf"\(\+{_NUMBER} against (\w+)\)", more)},
            int(times[1]) if times else 1,
            float(period),
            float(rate[1]) if rate else math.nan,
            "tentacle is back" in line,
        )


def compare(lab: Lab, kinds: Sequence[str], researched: frozenset[str] = frozenset()) -> Iterator[Compared]:
    """Yield every number about these types that the text has for a side with these upgrades."""
    for kind in (kind for kind in kinds if lab.has(kind)):
        lines = short(kind, frozenset(), researched)
        body = next(line for line in lines if "; health " in line)
        said = {what: float(found[1]) if (found := re.search(form, body)) else 0 for what, form in _BODY.items()}
        yield from _body(lab, kind, said)
        if kind in mobile():
            yield from _speeds(lab, kind, said)
        if kind in armed_types():
            for arm in arms_of(lines):
                yield from _weapon(lab, kind, arm)
        yield from _casts(lab, kind, dict(line.split(": ", 1) for line in advice(kind, researched)))


# --- body ---------------------------------------------------------------------------------------------------------


def _body(lab: Lab, kind: str, said: dict[str, float]) -> Iterator[Compared]:
    x, y = _spot(lab, kind)
    tag, marine = lab.make(Put(kind, (x, y)), Put("Marine", (x + fact(kind).radius + 2, y), ENEMY))
    if tag:
        unit = lab.units[tag]
        for what, found in (("health", unit.health_max), ("shield", unit.shield_max), ("energy", unit.energy_max)):
            yield Compared(kind, what, said[what], found, 0.5)
        if lab.order(ATTACK, marine, target=tag) and (lost := _worst_hit(lab, tag)):
            yield Compared(kind, "armor", min(said["armor"], _MARINE - 0.5), _MARINE - lost, 0.1)
    lab.clear()


def _worst_hit(lab: Lab, tag: int) -> float:
    """Return the most life that a unit without shields loses in a loop."""
    worst = 0.0
    for _ in range(_BARRIER_LOOPS):
        if tag not in lab.units:
            break
        if lab.units[tag].shield:
            lab.set(tag, Shields=0)
        before = lab.units[tag].health
        lab.step()
        if tag in lab.units and not lab.units[tag].shield:
            worst = max(worst, before - lab.units[tag].health)
            lab.set(tag, Life=lab.units[tag].health_max)
            if worst > 0.4:
                break
    return worst


def _speeds(lab: Lab, kind: str, said: dict[str, float]) -> Iterator[Compared]:
    yield Compared(kind, "speed", said["speed"], _fastest(lab, kind), 0.02)
    lab.clear()
    if not fact(kind).flying and fact(kind).race == "zerg":
        found = _fastest(lab, kind, creep=True)
        yield Compared(kind, "speed on creep", said["speed on creep"] or said["speed"], found, 0.03)
        lab.clear()


def _fastest(lab: Lab, kind: str, *, creep: bool = False) -> float:
    x, y = _spot(lab, kind, creep=creep)
    (tag,) = lab.make(Put(kind, (x - 6, y - 1)))
    lab.order(MOVE, tag, point=(x + 8, y - 1))
    best = 0.0
    for _ in range(30):
        before = lab.at(tag)
        lab.step(2)
        best = max(best, math.dist(before, lab.at(tag)) * LOOPS_PER_SECOND / 2)
    return best


def _spot(lab: Lab, kind: str, *, creep: bool = False) -> Point:
    """Return the middle of an empty place; with creep, which stays, for what needs it."""
    places = lab.ground.places(30, 20)
    if fact(kind).makes_creep:
        return places[-1]
    if not (creep or fact(kind).needs_creep):
        return places[0]
    x, y = places[-1]
    lab.make(Put("Hatchery", (int(x) - 2.5, int(y) + 5.5)))
    lab.step(_CREEP_LOOPS)
    return x, y


# --- weapons ------------------------------------------------------------------------------------------------------


def _weapon(lab: Lab, kind: str, arm: Arm) -> Iterator[Compared]:
    plane = "ground" if arm.plane == "any" else arm.plane
    fitting = _VICTIMS[plane]
    plain = next((v for v in fitting if not arm.bonus.keys() & set(fact(v).attributes)), fitting[0])
    special = [v for what in arm.bonus if (v := next((v for v in fitting if what in fact(v).attributes), None))]
    gap = max(arm.nearest + 0.3, min(arm.range / 2, 1))
    for i, victim in enumerate(dict.fromkeys((plain, *special))):
        losses, begun = _shots(lab, kind, victim, gap, arm.period)
        yield Compared(kind, f"damage to {plane}", arm.against(victim), median(losses or [math.nan]), 0.3)
        if not i:
            period = (begun[-1] - begun[0]) / (len(begun) - 1) / LOOPS_PER_SECOND if len(begun) > 1 else math.nan
            wait = _BACK_S if arm.returns else 0.0
            yield Compared(kind, "period", arm.period + wait, period, wait + min(_CHANCE_S, 0.15 * arm.period + 0.03))
            yield Compared(
                kind, "per second", arm.per_second, arm.damage * arm.hits / arm.period, 0.02 * arm.per_second
            )
    for offset, inside in ((-_INSIDE, True), (_OUTSIDE, False)):
        yield Compared(kind, "range", inside, _fires_from(lab, kind, plain, arm.range + offset), 0)
    near = max(arm.nearest - 0.4, 0.05)
    yield Compared(kind, "least range", not arm.nearest, _fires_from(lab, kind, plain, near), 0)


def _facing(lab: Lab, kind: str, victim: str, gap: float) -> tuple[int, int]:
    """Make a unit, and a target with `gap` between their edges."""
    x, y = _spot(lab, kind)
    (attacker,) = lab.make(Put(kind, (int(x) - 7.5, int(y) + 0.5)))
    ax, ay = lab.at(attacker)
    at: Point = (ax + fact(kind).radius + fact(victim).radius + gap, ay)
    (target,) = lab.make(Put(victim, at, lab.victim))
    return attacker, target


def _shots(lab: Lab, kind: str, victim: str, gap: float, period: float) -> tuple[list[float], list[int]]:
    """Return the life that each shot takes, and the loops at which shots hit first; the first and last are left out."""
    attacker, target = _facing(lab, kind, victim, gap)
    lab.order(ATTACK, attacker, target=target)
    losses: list[float] = []
    begun: list[int] = []
    for _ in range(int((_SHOTS + 2) * period * LOOPS_PER_SECOND) + 40):
        before = lab.units[target].health_max
        lab.step()
        lost = before - lab.life(target)
        if lost > 0.4:
            if not begun or lab.loop - begun[-1] > period * LOOPS_PER_SECOND * 0.6:
                begun.append(lab.loop)
                losses.append(0)
            losses[-1] += lost
        if target in lab.units:
            lab.set(target, Life=lab.units[target].health_max)
    lab.clear()
    return losses[1:-1], begun[1:-1]


def _fires_from(lab: Lab, kind: str, victim: str, gap: float) -> bool:
    """Return whether a unit hits a target at this distance without a step."""
    attacker, target = _facing(lab, kind, victim, gap)
    start = lab.at(attacker)
    life = lab.life(target)
    lab.order(ATTACK, attacker, target=target)
    hit = False
    for _ in range(90):
        lab.step()
        if attacker not in lab.units or math.dist(start, lab.at(attacker)) > 0.05:
            break
        if lab.life(target) < life - 0.4:
            hit = True
            break
    lab.clear()
    return hit


# --- abilities ----------------------------------------------------------------------------------------------------


def _casts(lab: Lab, kind: str, told: dict[str, str]) -> Iterator[Compared]:
    """Use each ability whose sentence has an energy, a cooldown or a price."""
    for number in fact(kind).ability_ids:
        ability = abilities().get(number)
        words = words_of(ability) if ability else None
        sentence = told.get(words.title, "") if words else ""
        energy = re.search(rf"[Ff]or {_NUMBER} energy", sentence)
        ready = re.search(rf"[Rr]eady again after {_NUMBER} s", sentence)
        cost = re.search(rf"for {_NUMBER} minerals", sentence)
        if not (energy or ready or cost):
            continue
        tag = _caster(lab, kind)
        bank = _bank(lab)
        if _use(lab, number, tag):
            yield from _cast(lab, kind, tag, number, bank=bank, energy=energy, ready=ready, cost=cost)
        lab.clear()


def _cast(
    lab: Lab,
    kind: str,
    tag: int,
    number: int,
    *,
    bank: int,
    energy: re.Match[str] | None,
    ready: re.Match[str] | None,
    cost: re.Match[str] | None,
) -> Iterator[Compared]:
    """Wait until a unit has used what it was ordered to use, and until it can be ordered again."""
    had = lab.units[tag].energy
    lab.step(_STEP_LOOPS)
    if cost:
        _until(lab, lambda: _bank(lab) < bank, _CAST_LOOPS)
        yield Compared(kind, "minerals", float(cost[1]), bank - _bank(lab), 0)
    elif _until(lab, lambda: _spent(lab, tag, number if ready else 0, had), _CAST_LOOPS) is None:
        yield Compared(kind, f"use of {number}", 1, math.nan, 0)
    elif energy and tag in lab.units:
        yield Compared(kind, "energy", float(energy[1]), had - lab.units[tag].energy, 3)
    begun = lab.loop
    if enemies := [other for other, unit in lab.units.items() if unit.owner == ENEMY and other not in lab.first]:
        lab.kill(*enemies)
    if ready:
        again = _until(lab, lambda: number in lab.abilities(tag), _MOST_LOOPS)
        waited = math.nan if again is None else (lab.loop - begun) / LOOPS_PER_SECOND
        yield Compared(kind, f"cooldown of {number}", float(ready[1]), waited, 0.5)


def _bank(lab: Lab) -> int:
    return int(lab.observation.observation.player_common.minerals)


def _spent(lab: Lab, tag: int, number: int, energy: float) -> bool:
    """Return whether a unit has used what it was ordered to; `number` is that of an ability with a cooldown, or 0."""
    if tag in lab.units and number:
        return number not in lab.abilities(tag)
    unit = lab.units.get(tag)
    return unit is None or unit.energy < energy - 5 or not unit.orders


def _caster(lab: Lab, kind: str) -> int:
    x, y = lab.ground.places(30, 20)[0]
    lab.cheat("tech_tree", "food")
    lab.earn()
    (tag,) = lab.make(Put(kind, (x, y)))
    if tag and lab.units[tag].energy_max:
        lab.set(tag, Energy=lab.units[tag].energy_max)
    lab.step()
    return tag


def _use(lab: Lab, number: int, tag: int) -> bool:
    x, y = lab.at(tag)
    if not tag or number not in lab.abilities(tag):
        return False
    if lab.order(number, tag):
        return True
    victims = lab.make(*(Put(victim, (x + dx, y + dy), ENEMY) for victim, dx, dy in _UNARMED))
    return lab.order(number, tag, point=(x + 2, y + 2)) or any(lab.order(number, tag, target=v) for v in victims)


def _until(lab: Lab, done: Callable[[], bool], most: int) -> int | None:
    for loops in range(0, most, _STEP_LOOPS):
        if done():
            return loops
        lab.step(_STEP_LOOPS)
    return None


# --- the table ----------------------------------------------------------------------------------------------------


def measure(kinds: Sequence[str], *, better: bool) -> list[Compared]:
    """Compare every number of these types in a game of their own, with all upgrades or with none."""
    lab = new_lab()
    return list(compare(lab, kinds, improve(lab) if better else frozenset()))


def main(argv: Sequence[str] | None = None) -> int:
    """Print the numbers compared by kind, and each difference; return 1 if there is any."""
    parser = make_parser(__doc__, json=False)
    parser.add_argument("--kinds", nargs="+", default=list(melee_types()), help="unit types")
    args = parser.parse_args(argv)
    wrong = 0
    for better in (False, True):
        found = measure(args.kinds, better=better)
        counts = Counter(number.what.partition(" of ")[0] for number in found)
        differ = [number for number in found if number.differs]
        wrong += len(differ)
        state = "all upgrades" if better else "no upgrade"
        print(f"{state}: {len({n.kind for n in found})} types, {len(found)} numbers, {len(differ)} differences")
        print("    " + ", ".join(f"{what} {count}" for what, count in sorted(counts.items())))
        for number in differ:
            print(f"    {number.kind}, {number.what}: said {number.said:g}, found {number.found:g}")
    return 1 if wrong else 0
