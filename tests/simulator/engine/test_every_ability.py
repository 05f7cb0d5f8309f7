"""Every ability that has a rule is used once, and its rule changes the world.

A world is set up in which as much as possible is allowed, and twice the same order is given in it: once with the
skill's effect, once with an effect that does nothing. Whatever differs then is what the ability does. The tests of
skills check how much it does.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.abilities.registry import SKILLS
from khala_simulator.combat import buffs, lifecycle, targets
from khala_simulator.combat.traits import refresh
from khala_simulator.economy import harvesting, production
from khala_simulator.maps.game_map import load_map
from khala_simulator.systems import creep
from khala_simulator.tables.abilities import AbilityAim
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import DEFAULT_VERSION, VERSION_OF_BUILD
from khala_simulator.tick import advance
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.players import PlayerSetup
from khala_simulator.world.world import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Point

LONGEST = 2500  # loops, for what takes its time before it begins
CENTRE = (32.0, 32.0)
OWN = (
    ("Nexus", 14.5, 32.5), ("Pylon", 22, 36), ("CommandCenter", 14.5, 46.5), ("Hatchery", 14.5, 18.5),
    ("SupplyDepot", 22, 46), ("Barracks", 24.5, 52.5), ("CyberneticsCore", 21.5, 28.5),
    ("Marine", 34, 32), ("Stalker", 34, 34), ("SiegeTank", 36, 30), ("VikingFighter", 30, 36), ("Zergling", 30, 30),
    ("HighTemplar", 36, 35), ("Roach", 28, 34), ("Medivac", 28, 30),
)  # fmt: skip
FOES = (
    ("Marine", 36, 32), ("Roach", 37, 33), ("SiegeTank", 38, 30), ("VikingFighter", 35, 37), ("HighTemplar", 38, 35),
    ("SupplyDepot", 40, 34), ("Hatchery", 46.5, 32.5), ("Stalker", 37, 28),
)  # fmt: skip
NEUTRAL = (("MineralField", 8, 32.5), ("VespeneGeyser", 8.5, 40.5), ("VespeneGeyser", 8.5, 24.5))


def modelled(version: str) -> list[Ability]:
    catalog = load_catalog(version)
    found = {a.id: a for unit in catalog.units if not unit.not_in_melee for a in catalog.abilities_of(unit.row)}
    return [a for _, a in sorted(found.items()) if a.effect in SKILLS]


def stage(version: str) -> World:
    """Return a flat map with something of everything on it; the first player may do anything, and no unit fights."""
    players = (PlayerSetup(1, "protoss", "agent"), PlayerSetup(2, "zerg", "agent"))
    world = World(load_map("Melee/Flat64"), players, seed=3, catalog=load_catalog(version))
    world.fog = False
    world.visibility[:] = 2
    world.players[1].cheats += ["free", "tech_tree", "cooldown", "food"]
    for owner, group in ((1, OWN), (2, FOES), (0, NEUTRAL)):
        for name, x, y in group:
            slot = lifecycle.spawn(world, world.catalog.unit(name), owner, (x, y))
            world.energy[slot] = world.energy_max[slot]
            if owner and not world.unit_type(slot).structure:
                world.life[slot] *= 0.6
                world.shields[slot] *= 0.5
    creep.spread(world)
    return world


def casters(world: World, ability: Ability) -> Iterator[int]:
    """Yield one unit of each type that has the ability, put in the middle one after the other."""
    for name in ability.users:
        unit = world.catalog.unit(name) if name in world.catalog.row_of_name else None
        if unit is not None and ability in world.catalog.abilities_of(unit.row):
            slot = lifecycle.spawn(world, unit, 1, CENTRE if not unit.structure else (30.5, 42.5))
            world.energy[slot] = world.energy_max[slot]
            yield slot
            lifecycle.remove(world, slot)


def aims(world: World, slot: int, ability: Ability) -> Iterator[tuple[int, Point | None]]:
    """Yield everything that the ability could be aimed at here, the nearest first."""
    if AbilityAim.NONE in ability.aim:
        yield NOBODY, None
    if AbilityAim.UNIT in ability.aim:
        for other in world.live.tolist():
            if other != slot:
                yield other, None
    if AbilityAim.POINT in ability.aim:
        x, y = world.pos[slot].tolist()
        for far in (3.0, 5.0, 7.0, 9.0):
            for dx, dy in ((far, 0.0), (0.0, far), (-far, 0.0), (0.0, -far), (far, far), (-far, far)):
                yield NOBODY, (x + dx, y + dy)
        for field in ("VespeneGeyser",):
            for other in world.live[world.type[world.live] == world.catalog.unit(field).row].tolist():
                px, py = world.pos[other].tolist()
                yield NOBODY, (px, py)


def _bear(*names: str) -> Callable[[World, int], None]:
    """Apply the first of the buffs that the version has."""
    return lambda world, slot: buffs.apply(world, slot, next(n for n in names if n in world.catalog.buff_of_name))


def _use(number: int, point: Point = (36.0, 32.0)) -> Callable[[World, int], None]:
    """Make the unit use another ability first, at the enemy's Marine or beside it."""

    def prepare(world: World, slot: int) -> None:
        ability = world.catalog.ability(number)
        foe = next(s for s in world.units_of(2).tolist() if world.unit_type(s).name == "Roach")
        tag = world.tag_of(foe) if AbilityAim.UNIT in ability.aim else 0
        casting.use(world, [slot], ability, target=tag, point=point if AbilityAim.POINT in ability.aim else None)
        advance(world, 2)

    return prepare


def _fill(world: World, slot: int) -> None:
    """Put a passenger into a carrier."""
    passenger = lifecycle.spawn(world, world.catalog.unit("SCV"), 1, CENTRE)
    lifecycle.stow(world, passenger, slot)


def _man(world: World, slot: int) -> None:
    """Put soldiers with stimpacks into a Bunker, and an enemy before it."""
    commands.grant_upgrade(world, 1, world.catalog.upgrade("Stimpack").id)
    for name in ("Marine", "Marauder"):
        lifecycle.stow(world, lifecycle.spawn(world, world.catalog.unit(name), 1, CENTRE), slot)
    x, y = world.pos[slot].tolist()
    for passenger in world.passengers(slot):
        world.pos[passenger] = x, y
        refresh(world, passenger)
    targets.engage(
        world, world.passengers(slot)[0], lifecycle.spawn(world, world.catalog.unit("Roach"), 2, (x, y + 4.0))
    )


def _worker(world: World, slot: int) -> None:
    """Put a worker beside a structure that calls workers in."""
    x, y = world.pos[slot].tolist()
    lifecycle.spawn(world, world.catalog.unit("SCV"), 1, (x, y - 5.0))


def _pair(world: World, slot: int) -> None:
    """Order a second Templar to merge, too."""
    partner = lifecycle.spawn(world, world.unit_type(slot), 1, (31.0, 33.0))
    casting.use(world, [partner], world.catalog.ability(1766))


def _split(world: World, slot: int) -> None:
    """Make an Adept shift its phase; a shade becomes that of another Adept."""
    adept = (
        slot
        if world.unit_type(slot).name == "Adept"
        else lifecycle.spawn(world, world.catalog.unit("Adept"), 1, CENTRE)
    )
    casting.use(world, [adept], world.catalog.ability(2544), point=(36.0, 32.0))
    if adept != slot:
        world.area_effects[-1].target = world.tag_of(slot)


def _power(world: World, slot: int) -> None:
    """Put a Pylon and a Stalker that lacks shields beside a battery."""
    x, y = world.pos[slot].tolist()
    lifecycle.spawn(world, world.catalog.unit("Pylon"), 1, (x - 3.0, y))
    stalker = lifecycle.spawn(world, world.catalog.unit("Stalker"), 1, (x, y + 4.0))
    world.shields[stalker] = 10.0
    world.damaged_loop[stalker] = LONGEST
    advance(world, 2)


def _recharge(world: World, slot: int) -> None:
    """Make a battery recharge a unit."""
    _power(world, slot)
    advance(world, 6)


def _battery(world: World, slot: int) -> None:
    """Put a Shield Battery with power beside a Nexus."""
    x, y = world.pos[slot].tolist()
    _power(world, lifecycle.spawn(world, world.catalog.unit("ShieldBattery"), 1, (x - 4.5, y - 5.5)))


def _queue(world: World, slot: int) -> None:
    """Make a structure or an egg produce something."""
    production.enqueue(world, slot, world.catalog.ability(1006), makes="Probe", loops=100.0)


def _in_the_making(world: World, slot: int) -> None:
    world.build_progress[slot], world.build_loops[slot] = 0.5, 100.0
    refresh(world, slot)


def _at_work(world: World, slot: int) -> None:
    """Make an SCV build the structure, or the SCV build another one."""
    worker = world.unit_type(slot).worker
    site = lifecycle.spawn(world, world.catalog.unit("SupplyDepot"), 1, (40.0, 42.0)) if worker else slot
    _in_the_making(world, site)
    world.site[slot if worker else lifecycle.spawn(world, world.catalog.unit("SCV"), 1, (34.0, 42.0))] = site


def _load_up(world: World, slot: int) -> None:
    harvesting.take_up(world, slot, 5, gas=False, rich=False)


def _to_creep(world: World, slot: int) -> None:
    """Take a Drone to where its structures can stand."""
    if world.unit_type(slot).race == "zerg":
        world.pos[slot] = (20.0, 18.0)
        advance(world, 300)


def begin_what_it_cancels(world: World, slot: int, cancel: Ability) -> None:
    """Make the unit begin the morph or add-on that an ability calls off, or else be unfinished itself."""
    x, y = world.pos[slot].tolist()
    if world.unit_type(slot).structure:
        lifecycle.spawn(world, world.catalog.unit("Pylon"), 1, (x - 4.0, y))
        advance(world, 1)
    card = world.catalog.abilities_of(int(world.type[slot]))
    if not any(a.link == cancel.link and a.effect != "cancel" and casting.use(world, [slot], a) for a in card):
        _in_the_making(world, slot)
    advance(world, 2)


def _near_power(world: World, slot: int) -> None:
    x, y = world.pos[slot].tolist()
    lifecycle.spawn(world, world.catalog.unit("Pylon"), 1, (x - 3.0, y))
    advance(world, 1)


def _on_creep(world: World, slot: int) -> None:
    """Put creep around the caster."""
    x, y = world.pos[slot].tolist()
    world.growth.add(world.tag_of(slot), "Hatchery", (int(x), int(y)), world.loop, grown=True)
    world.growth.settle()


def _hungry(world: World, slot: int) -> None:
    world.energy[slot] = 10.0


def _morphing(*kinds: str) -> Callable[[World, int], None]:
    """Put the unit in the middle of a morph of its own; a cocoon has just begun to be one."""

    def prepare(world: World, slot: int) -> None:
        _on_creep(world, slot)
        name = world.unit_type(slot).name
        before = next((a for a in world.catalog.abilities if a.numbers.get("cocoon") == name), None)
        if before is not None:
            lifecycle.become(world, slot, world.catalog.unit(before.users[0]))
        x, y = world.pos[slot].tolist()
        found = next(a for a in world.catalog.abilities_of(int(world.type[slot])) if a.effect in kinds)
        found = before or found
        casting.use(world, [slot], found, point=(x, y) if found.requires_point else None)
        advance(world, 12 if before is not None else 3)

    return prepare


PREPARE: dict[str, Callable[[World, int], None]] = {
    "ghost_weapons_free": _bear("GhostHoldFireB"),
    "ghost_cloak_off": _bear("GhostCloak"),
    "banshee_cloak_off": _bear("BansheeCloak"),
    "cancel_lock_on_cancel": _use(2350),
    "cancel_channel_snipe": _use(2714),
    "cancel_tac_nuke_strike": _use(1622),
    "cancel_neural_parasite": _use(249),
    "cancel_growth": _morphing("grow"),
    "cancel_morph": _morphing("morph", "root"),
    "creep_tumor": _on_creep,
    "root": _on_creep,
    "transfusion": _on_creep,
    "viper_consume_structure": _hungry,
    "generate_creep_off": _bear("makeCreep2x2Overlord"),
    "lurker_remove_hold_fire": _bear("LurkerHoldFireB"),
    "volatile_burst_building_off": _bear("VolatileBurstBuilding"),
    "cancel_job": _queue,
    "cancel_slot": _queue,
    "halt": _at_work,
    "rally": _in_the_making,
    "return": _load_up,
    "build": _to_creep,
    "warp_in": _near_power,
    "cancel_graviton_beam": _use(173),
    "pulsar_beam_off": _use(2375),
    "cancel_prismatic_alignment": _use(2393),
    "cancel_phase_shift": _split,
    "merge": _pair,
    "recharge_shields": _power,
    "stop_recharging": _recharge,
    "battery_overcharge": _battery,
    "load_all": _worker,
    **dict.fromkeys(("redirect_attack", "redirect_stop", "redirect_stim"), _man),
    **dict.fromkeys(("unload_all", "unload_all_at", "unload_unit"), _fill),
}
"""By a skill's name: what must hold before a unit can use it."""


def attempt(world: World, ability: Ability) -> list[int]:
    """Give the order to the first caster and at the first aim that takes it; return that caster."""
    for slot in casters(world, ability):
        if ability.effect == "cancel":
            begin_what_it_cancels(world, slot, ability)
        if ability.effect in PREPARE:
            PREPARE[ability.effect](world, slot)
        if casting.refusal(world, slot, ability) is not ActionResult.SUCCESS:
            continue
        for target, point in aims(world, slot, ability):
            if casting.aim_refusal(world, Cast(slot, ability, target, point)) is ActionResult.SUCCESS:
                taken = casting.use(world, [slot], ability, target=world.tag_of(target), point=point)
                if taken:
                    return taken
    return []


def state_after(version: str, ability: Ability, monkeypatch: pytest.MonkeyPatch, *, inert: bool) -> tuple[str, int]:
    """Return the world's digest soon after the effect, and how often it took effect."""
    skill, calls = SKILLS[ability.effect], 0

    def effect(world: World, cast: Cast) -> None:
        nonlocal calls
        calls += 1
        if not inert:
            skill.effect(world, cast)

    with monkeypatch.context() as patch:
        world = stage(version)
        patch.setitem(SKILLS, ability.effect, dataclasses.replace(skill, effect=effect))
        assert attempt(world, ability), "no unit could use it"
        for _ in range(LONGEST):
            if calls:
                break
            advance(world)
    return world.digest(), calls


def cases() -> Iterator[Any]:
    """Yield every ability of every version; the first of each skill now, all others in the long tests."""
    shown: set[str] = set()
    for version in (DEFAULT_VERSION, *(other for other in VERSION_OF_BUILD.values() if other != DEFAULT_VERSION)):
        for a in modelled(version):
            marks = [pytest.mark.slow] if a.effect in shown else []
            shown.add(a.effect)
            yield pytest.param(version, a, id=f"{version}-{a.id}-{a.effect}", marks=marks)


@pytest.mark.parametrize(("version", "ability"), list(cases()))
def test_an_ability_with_a_rule_changes_the_world(
    version: str, ability: Ability, monkeypatch: pytest.MonkeyPatch
) -> None:
    if getattr(SKILLS[ability.effect], "give", None) is not None:
        world, idle = stage(version), stage(version)
        assert attempt(world, ability), "no unit could use it"
        assert world.digest() != idle.digest()
        return
    with_effect, calls = state_after(version, ability, monkeypatch, inert=False)
    without, _ = state_after(version, ability, monkeypatch, inert=True)
    assert calls
    assert with_effect != without
