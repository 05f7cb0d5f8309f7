"""How long things take to be made: units, structures, research, warping in; and how fast life comes back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_bridge.calibrate.cast import fact, known, melee_types
from khala_bridge.calibrate.lab import Put
from khala_bridge.calibrate.probe import Samples, probe
from khala_bridge.knowledge.facts import VERSION, upgrade_facts

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.calibrate.ground import Point
    from khala_bridge.calibrate.lab import Lab

_PLACE: Final = (14, 12)
_LONGEST_LOOPS: Final = 4200
"""Of anything that is made: level 3 of an upgrade takes 3040."""
_ATTEMPTS: Final = 4
_WARP_ZEALOT: Final = 1413
_LARVA: Final = "Larva"
_WORKER: Final = {"terran": "SCV", "protoss": "Probe", "zerg": "Drone"}


@probe(
    "build.unit",
    measures="Loops from the order to the finished unit, of each that a structure or a larva makes.",
    settles="Times of production, and of which loop the first and the last one are.",
    unit="loops",
    resolution=1.0,
)
def unit(lab: Lab) -> Samples:
    """Give each product a producer of its own."""
    products = [name for name in known(lab, melee_types()) if not fact(name).structure and _maker(lab, name)]
    _produce(lab)
    for kinds, places in _batches(lab, products):
        begun: dict[str, tuple[int, int]] = {}
        for _ in range(_ATTEMPTS):
            left = [(kind, at) for kind, at in zip(kinds, places, strict=False) if kind not in begun]
            makers = lab.make(*(put for kind, at in left for put in _workshop(lab, kind, at)))[::3]
            for (kind, _), maker in zip(left, makers, strict=True):
                if lab.order(lab.types[kind].ability_id, maker):
                    begun[kind] = (maker, lab.loop)
                else:
                    lab.kill(maker)  # a Gateway that has begun to become a Warp Gate; the next one may be in time
        counts = {kind: len(lab.of(kind)) for kind in begun}
        yield from _loops_until_done(lab, begun, _is_there(lab, counts))
        lab.clear()
        _produce(lab)


def _is_there(lab: Lab, before: dict[str, int]) -> Callable[[str, int], bool]:
    return lambda kind, _: len(lab.of(kind)) > before[kind]


def _produce(lab: Lab) -> None:
    lab.cheat("tech_tree", "food")
    for _ in range(4):
        lab.earn()


def _maker(lab: Lab, kind: str) -> str:
    """Return the type that trains another one, "" if none does."""
    makers = [maker for maker in fact(kind).producers if maker == _LARVA or fact(maker).structure]
    return next((maker for maker in makers if lab.has(maker)), "")


def _workshop(lab: Lab, kind: str, at: Point) -> list[Put]:
    """Return a producer with all it may need: power, an add-on."""
    maker = _maker(lab, kind)
    x, y = at
    addon = f"{maker}TechLab"
    beside = Put(addon, (x + 2.5, y - 0.5)) if lab.has(addon) else Put("Pylon", (x + 4, y + 3.5))
    return [Put(maker, (x, y)), Put("Pylon", (x - 4, y)), beside]


def _batches(lab: Lab, kinds: Sequence[str]) -> list[tuple[Sequence[str], list[Point]]]:
    places = [(int(x) + 0.5, int(y) + 0.5) for x, y in lab.ground.places(*_PLACE)]
    return [(kinds[i : i + len(places)], places) for i in range(0, len(kinds), len(places))]


def _loops_until_done(lab: Lab, begun: dict[str, tuple[int, int]], is_done: Callable[[str, int], bool]) -> Samples:
    """Yield the loops until each is done, from its own beginning; what is not by the longest time is left out."""
    end = lab.loop + _LONGEST_LOOPS
    while begun and lab.loop < end:
        lab.step()
        for name in [name for name, (tag, _) in begun.items() if is_done(name, tag)]:
            yield name, lab.loop - begun.pop(name)[1]


@probe(
    "build.structure",
    measures="Loops from the first sight of a structure in the making to its end, of each that a worker builds.",
    settles="Times of construction.",
    unit="loops",
    resolution=2.0,
)
def structure(lab: Lab) -> Samples:
    """Give each a worker beside its place; those on creep and geysers are left out."""
    kinds = [
        name
        for name in known(lab, melee_types())
        if fact(name).structure
        and set(fact(name).producers) & set(_WORKER.values())
        and not fact(name).needs_creep
        and fact(name).footprint
        and "Rich" not in name
        and name not in {"Assimilator", "Extractor", "Refinery"}
    ]
    _produce(lab)
    for batch, places in _batches(lab, kinds):
        puts = []
        for kind, (x, y) in zip(batch, places, strict=False):
            puts += [Put(_WORKER[fact(kind).race], (x - 3.5, y)), Put("Pylon", (x + 5, y + 4))]
        tags = lab.make(*puts)
        for kind, worker, (x, y) in zip(batch, tags[::2], places, strict=False):
            odd = (fact(kind).footprint or (1, 1))[0] % 2
            lab.order(lab.types[kind].ability_id, worker, point=(x, y) if odd else (x + 0.5, y + 0.5))
        seen: dict[int, int] = {}
        old = set(lab.units)
        begun = lab.loop
        for _ in range(2400):
            lab.step()
            for tag, unit in lab.units.items():
                if (
                    tag not in old
                    and tag not in seen
                    and unit.build_progress < 1
                    and lab.name_of.get(unit.unit_type) in batch
                ):
                    seen[tag] = lab.loop
            for tag in [tag for tag in seen if tag in lab.units and lab.units[tag].build_progress >= 1]:
                old.add(tag)
                yield lab.name_of[lab.units[tag].unit_type], lab.loop - seen.pop(tag)
            if lab.loop > begun + 100 and not seen:
                break
        lab.clear()
        _produce(lab)


@probe(
    "build.research",
    measures="Loops from the order to the end of each research.",
    settles="Times of research.",
    unit="loops",
    resolution=1.0,
)
def research(lab: Lab) -> Samples:
    """Give each a laboratory of its own; levels above the first are left out, for they must follow it."""
    wanted = {
        name: facts
        for name, facts in upgrade_facts(VERSION).items()
        if facts.melee and facts.at and facts.ability and not name.endswith(("Level2", "Level3"))
    }
    names = [name for name, facts in wanted.items() if lab.has(facts.at[0])]
    _produce(lab)
    for batch, places in _batches(lab, names):
        puts = []
        for name, (x, y) in zip(batch, places, strict=False):
            puts += [Put(wanted[name].at[0], (x, y)), Put("Pylon", (x - 4, y))]
        makers = lab.make(*puts)
        begun = {
            name: (maker, lab.loop)
            for name, maker in zip(batch, makers[::2], strict=False)
            if lab.order(wanted[name].ability, maker)
        }
        yield from _loops_until_done(lab, begun, lambda _, maker: not lab.units[maker].orders)
        lab.clear()
        _produce(lab)


@probe(
    "build.warp",
    measures="Loops from the order to the end of a warp-in, near a Nexus and far from one, and to the next one.",
    settles="Times of warping in.",
    unit="loops",
    resolution=1.0,
)
def warp(lab: Lab) -> Samples:
    """Warp a Zealot to a Pylon."""
    places = lab.ground.places(30, 14)
    for name, place in zip(("slow", "fast"), places, strict=False):
        _produce(lab)
        x, y = map(float, map(int, place))
        gate, *_ = lab.make(
            Put("WarpGate", (x - 10.5, y + 0.5)), Put("Pylon", (x - 13, y)), Put("Pylon", (x + 8, y)),
            *([Put("Nexus", (x + 12.5, y + 0.5))] if name == "fast" else []),
        )  # fmt: skip
        lab.step(8)
        if lab.order(_WARP_ZEALOT, gate, point=(x + 7, y - 2)):
            begun = lab.loop
            seen = False
            for _ in range(600):
                lab.step()
                zealots = lab.of("Zealot")
                if zealots and lab.units[zealots[0]].build_progress >= 1 and not seen:
                    seen = True
                    yield name, lab.loop - begun
                if seen and _WARP_ZEALOT in lab.abilities(gate):
                    yield f"{name}, next", lab.loop - begun
                    break
        lab.clear()


@probe(
    "life.regeneration",
    measures="Points of shields, life and energy that come back in 224 loops.",
    settles="Rates of regeneration.",
    unit="points",
    resolution=0.1,
)
def regeneration(lab: Lab) -> Samples:
    """Set values lower, and look."""
    kinds = known(lab, ("Zealot", "Immortal", "Archon", "Roach", "Mutalisk", "Ultralisk", "Hydralisk", "HighTemplar",
                        "Queen", "Medivac", "Raven", "Sentry", "Infestor", "Viper"))  # fmt: skip
    tags = lab.make(*(Put(kind, at) for kind, at in zip(kinds, lab.ground.places(8, 6), strict=False)))
    for kind, tag in zip(kinds, tags, strict=False):
        facts = fact(kind)
        if facts.shield:
            lab.set(tag, Shields=1.0)
        if facts.energy:
            lab.set(tag, Energy=20.0)
        if facts.race == "zerg":
            lab.set(tag, Life=facts.health / 2)
    lab.step(16)
    before = {tag: lab.units[tag] for tag in tags}
    lab.step(224)
    for kind, tag in zip(kinds, tags, strict=False):
        now, was = lab.units[tag], before[tag]
        for name in ("shield", "health", "energy"):
            gained = getattr(now, name) - getattr(was, name)
            if gained:
                yield f"{kind}: {name}", gained


PROBES = (unit, structure, research, warp, regeneration)
