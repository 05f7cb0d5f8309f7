"""What is true of units while they are made, mended or lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_bridge.calibrate.lab import ENEMY, HOLD, Put
from khala_bridge.calibrate.probe import Samples, probe

if TYPE_CHECKING:
    from khala_bridge.calibrate.lab import Lab

_PLACE: Final = (24, 14)
_MORPH_BANELING, _MERGE_ARCHON, _WARP_ZEALOT, _MORPH_RAVAGER = 80, 1766, 1413, 2330
_CANCELS: Final = (2331, 3659, 304)
"""Of a cocoon: its own, the general one, and that of a queue of one."""
_TRAIN_MARINE, _GUARDIAN_SHIELD = 560, 76


@probe(
    "build.making",
    measures="Life and shields of what has just begun: a cocoon, an Archon, a unit that is warped in.",
    settles="With how much life things begin that are made of others.",
    unit="life",
    resolution=1.0,
)
def making(lab: Lab) -> Samples:
    """Order each and look at it four loops later."""
    lab.cheat("tech_tree", "food")
    lab.earn()
    x, y = (float(int(part)) for part in lab.ground.places(*_PLACE)[0])
    zergling, templar, other_templar, gate, _ = lab.make(
        Put("Zergling", (x - 9, y)), Put("HighTemplar", (x - 6, y)), Put("HighTemplar", (x - 5, y)),
        Put("WarpGate", (x + 0.5, y + 0.5)), Put("Pylon", (x + 5, y)),
    )  # fmt: skip
    lab.step(8)
    lab.order(_MORPH_BANELING, zergling)
    lab.order(_MERGE_ARCHON, [templar, other_templar])
    lab.order(_WARP_ZEALOT, gate, point=(x + 5, y - 3))
    found: dict[str, float] = {}
    for _ in range(60):
        lab.step()
        for kind in ("BanelingCocoon", "Archon", "Zealot"):
            for tag in lab.of(kind):
                found.setdefault(kind, lab.life(tag))
    yield from found.items()


@probe(
    "build.refund",
    measures="Share of the price that comes back for what a structure made when it died, and for a cocoon called off.",
    settles="What is lost with a producer, and what a cancel gives back.",
    unit="share",
    resolution=0.01,
)
def refund(lab: Lab) -> Samples:
    """Compare the bank before and after."""
    lab.cheat("tech_tree", "food")
    lab.earn()
    x, y = (int(part) + 0.5 for part in lab.ground.places(*_PLACE)[0])
    barracks, roach = lab.make(Put("Barracks", (x, y)), Put("Roach", (x + 8, y)))
    full = _minerals(lab)
    lab.order(_TRAIN_MARINE, barracks)
    lab.step(4)
    paid = _minerals(lab)
    lab.kill(barracks)
    lab.step(4)
    yield "lost with its producer", (_minerals(lab) - paid) / (full - paid) if full > paid else 0.0
    full = _minerals(lab)
    lab.order(_MORPH_RAVAGER, roach)
    begun = lab.loop
    while not lab.of("RavagerCocoon") and lab.loop < begun + 40:
        lab.step()
    paid = _minerals(lab)
    for cocoon in lab.of("RavagerCocoon"):
        lab.order(next((ability for ability in _CANCELS if ability in lab.abilities(cocoon)), _CANCELS[0]), cocoon)
    lab.step(8)
    yield "cocoon called off", (_minerals(lab) - paid) / (full - paid) if full > paid else 0.0


def _minerals(lab: Lab) -> float:
    return float(lab.observation.observation.player_common.minerals)


@probe(
    "life.mending",
    measures="Life that repair and healing give in 64 loops, and the most in one loop.",
    settles="Whether it comes evenly, and how fast.",
    unit="life",
    resolution=0.2,
)
def mending(lab: Lab) -> Samples:
    """Hurt a Battlecruiser and a Marauder, and mend each."""
    lab.earn()
    for name, mender, patient, ability in (
        ("SCV", "SCV", "Battlecruiser", 316),
        ("Medivac", "Medivac", "Marauder", 386),
    ):
        x, y = lab.ground.places(*_PLACE)[0]
        doctor, hurt = lab.make(Put(mender, (x, y)), Put(patient, (x + 2, y)))
        lab.set(hurt, Life=lab.units[hurt].health_max / 4)
        lab.set(doctor, Energy=200.0)
        lab.order(ability, doctor, target=hurt)
        lab.step(24)
        before = lab.life(hurt)
        most = 0.0
        for _ in range(64):
            was = lab.life(hurt)
            lab.step()
            most = max(most, lab.life(hurt) - was)
        yield name, lab.life(hurt) - before
        yield f"{name}, in a loop", most
        lab.clear()


@probe(
    "spell.shield",
    measures="1 if a Guardian Shield covers a Marine so far from its Sentry, and if it lasts when the Sentry dies.",
    settles="From where the shield's radius counts, and whether it ends with its Sentry.",
    unit="share",
)
def shield(lab: Lab) -> Samples:
    """Look for the buff."""
    lab.cheat("tech_tree")
    x, y = lab.ground.places(*_PLACE)[0]
    sentry, *marines = lab.make(
        Put("Sentry", (x - 6, y)), *(Put("Marine", (x - 6 + 4 + 0.25 * i, y)) for i in range(9))
    )
    lab.set(sentry, Energy=200.0)
    lab.order(HOLD, marines)
    lab.step()
    homes = [lab.at(tag)[0] - (x - 6) for tag in marines]
    lab.order(_GUARDIAN_SHIELD, sentry)
    lab.step(12)
    for home, tag in zip(homes, marines, strict=True):
        yield f"{home:.1f}", float(bool(lab.units[tag].buff_ids))
    lab.kill(sentry)
    lab.step(12)
    yield "without its Sentry", float(bool(lab.units[marines[0]].buff_ids))


@probe(
    "crowd.spawn",
    measures="Mean and largest distance from the point at which eight units were made, two loops later.",
    settles="The formation of units that are made at one point.",
    unit="world units",
    resolution=0.1,
)
def spawn(lab: Lab) -> Samples:
    """Make them by one request, for an enemy that holds its position."""
    for kind in ("Marine", "Zergling", "Stalker", "Ultralisk"):
        x, y = lab.ground.places(*_PLACE)[0]
        tags = [tag for tag in lab.make(*(Put(kind, (x, y), ENEMY) for _ in range(8))) if tag]
        lab.hold(tags)
        lab.step()
        apart = [((lab.at(tag)[0] - x) ** 2 + (lab.at(tag)[1] - y) ** 2) ** 0.5 for tag in tags]
        yield f"{kind}: mean", sum(apart) / len(apart)
        yield f"{kind}: largest", max(apart)
        lab.clear()


PROBES = (making, refund, mending, shield, spawn)
