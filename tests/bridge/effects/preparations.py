"""Preparations for the use of an ability: by the rule of the simulator that carries the ability out.

Each preparation is a function of the world and of the unit's slot, and advances the world by some loops if it must.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_simulator.abilities import casting, commands
from khala_simulator.abilities.terran import addons
from khala_simulator.combat import buffs, lifecycle, targets
from khala_simulator.combat.traits import refresh
from khala_simulator.economy import harvesting, production
from khala_simulator.tables.abilities import AbilityAim
from khala_simulator.tick import advance

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.world import World

    Point = tuple[float, float]
    Preparation = Callable[[World, int], None]

FOE = "Roach"
"""Type of the enemy for attacks and other uses against enemies."""
LONG = 1.0e6


def prepare_for(caster: str, ability: Ability) -> Preparation | None:
    """Return the preparation of a unit of this type for an ability; None if it needs none."""
    if ability.effect in {"cancel", "cancel_growth", "cancel_morph"}:
        return _begin(ability.link, ability.effect)
    if (caster, ability.effect) in OF_UNIT:
        return OF_UNIT[caster, ability.effect]
    return PREPARE.get(ability.effect)


# --- the unit's own state -----------------------------------------------------------------------------------------


def _walk(world: World, slot: int) -> None:
    """Send it on its way somewhere."""
    x, y = world.pos[slot].tolist()
    commands.move(world, [slot], (x, y + 9.0))
    advance(world, 4)


def _bear(*names: str) -> Preparation:
    """Return a preparation that applies the first of these buffs that the version has."""
    return lambda world, slot: buffs.apply(world, slot, next(n for n in names if n in world.catalog.buff_of_name))


def _use(number: int, loops: int = 2, distance: float = 4.0) -> Preparation:
    """Return a preparation that uses another ability, at an enemy or beside the unit."""

    def prepare(world: World, slot: int) -> None:
        ability = world.catalog.ability(number)
        x, y = world.pos[slot].tolist()
        tag = world.tag_of(_foe(world, (x + distance, y))) if AbilityAim.UNIT in ability.aim else 0
        point = (x + distance, y) if AbilityAim.POINT in ability.aim and not tag else None
        assert casting.use(world, [slot], ability, target=tag, point=point)
        advance(world, loops)

    return prepare


@functools.cache
def _begin(link: str, does: str) -> Preparation:
    """Return a preparation that begins the morph or add-on that an ability cancels, or else the unit's construction."""

    def prepare(world: World, slot: int) -> None:
        name = world.unit_type(slot).name
        before = next((a for a in world.catalog.abilities if a.numbers.get("cocoon") == name), None)
        if before is not None:
            lifecycle.become(world, slot, world.catalog.unit(before.users[0]))
        x, y = world.pos[slot].tolist()
        for ability in world.catalog.abilities_of(int(world.type[slot])):
            wanted = before is ability or (before is None and ability.link == link and ability.effect != does)
            if does == "cancel_morph":
                wanted = ability.effect in {"morph", "root"} and ability.loops + ability.prep_loops > 0
            if does == "cancel_growth" and before is None:
                wanted = ability.effect == "grow"
            point = (x, y) if AbilityAim.POINT in ability.aim and AbilityAim.NONE not in ability.aim else None
            if wanted and casting.use(world, [slot], ability, point=point):
                advance(world, 4 if does == "cancel" else 16)
                return
        _in_the_making(world, slot)
        advance(world, 2)

    return prepare


def _in_the_making(world: World, slot: int) -> None:
    world.build_progress[slot], world.build_loops[slot] = 0.5, 1000.0
    refresh(world, slot)


def _at_work(world: World, slot: int) -> None:
    """Make it an SCV that builds something, or a structure that an SCV builds."""
    x, y = world.pos[slot].tolist()
    site = slot
    if world.unit_type(slot).worker:
        site = lifecycle.spawn(world, world.catalog.unit("SupplyDepot"), 1, (x - 3.0, y + 3.0))
    else:
        slot = lifecycle.spawn(world, world.catalog.unit("SCV"), 1, (x, y - 3.5))
    _in_the_making(world, site)
    assert casting.smart(world, [slot], target=world.tag_of(site))
    advance(world, 40)


def _queue(world: World, slot: int) -> None:
    """Put something into its queue, twice."""
    for _ in range(2):
        production.enqueue(world, slot, world.catalog.ability(1006), makes="Probe", loops=2000.0)


def _load_up(world: World, slot: int) -> None:
    harvesting.take_up(world, slot, 5, gas=False, rich=False)


def _hungry(world: World, slot: int) -> None:
    world.energy[slot] = 10.0


# --- other units --------------------------------------------------------------------------------------------------


def _foe(world: World, point: Point) -> int:
    slot = lifecycle.spawn(world, world.catalog.unit(FOE), 2, point)
    world.looks_around[slot] = False
    return slot


def _fill(world: World, slot: int) -> None:
    """Put a passenger into the carrier."""
    passenger = lifecycle.spawn(world, world.catalog.unit("SCV"), 1, tuple(world.pos[slot].tolist()))
    lifecycle.stow(world, passenger, slot)


def _man(world: World, slot: int) -> None:
    """Put soldiers with stimpacks into a Bunker, and an enemy before it that they fight."""
    commands.grant_upgrade(world, 1, world.catalog.upgrade("Stimpack").id)
    x, y = world.pos[slot].tolist()
    for name in ("Marine", "Marauder"):
        lifecycle.stow(world, lifecycle.spawn(world, world.catalog.unit(name), 1, (x, y)), slot)
    for passenger in world.passengers(slot):
        world.pos[passenger] = x, y
        refresh(world, passenger)
    targets.engage(world, world.passengers(slot)[0], _foe(world, (x, y + 4.0)))


def _split(world: World, slot: int) -> None:
    """Start the phase shift of an Adept, or make it the shade of one."""
    x, y = world.pos[slot].tolist()
    adept = (
        slot
        if world.unit_type(slot).name == "Adept"
        else lifecycle.spawn(world, world.catalog.unit("Adept"), 1, (x, y + 1.0))
    )
    casting.use(world, [adept], world.catalog.ability(2544), point=(x + 4.0, y))
    advance(world, 4)
    if adept != slot:
        world.area_effects[-1].target = world.tag_of(slot)


def _worker(world: World, slot: int) -> None:
    """Put a worker beside a structure that takes workers in."""
    x, y = world.pos[slot].tolist()
    lifecycle.spawn(world, world.catalog.unit("SCV"), 1, (x, y - 4.0))


def _drained(world: World, slot: int) -> None:
    """Put a Stalker without shields beside a battery."""
    x, y = world.pos[slot].tolist()
    stalker = lifecycle.spawn(world, world.catalog.unit("Stalker"), 1, (x - 1.5, y + 3.0))
    world.shields[stalker] = 5.0
    world.damaged_loop[stalker] = LONG
    advance(world, 2)


def _recharge(world: World, slot: int) -> None:
    """Make a battery recharge a unit."""
    _drained(world, slot)
    advance(world, 4)


def _battery(world: World, slot: int) -> None:
    """Put a Shield Battery with power beside a Nexus."""
    x, y = world.pos[slot].tolist()
    lifecycle.spawn(world, world.catalog.unit("Pylon"), 1, (x - 4.0, y - 4.0))
    lifecycle.spawn(world, world.catalog.unit("ShieldBattery"), 1, (x - 4.0, y))
    advance(world, 2)


def _with_tech_lab(world: World, slot: int) -> None:
    """Put a TechLab at the structure's side."""
    lab = world.catalog.unit(f"{world.unit_type(slot).name}TechLab")
    world.addon[slot] = lifecycle.spawn(world, lab, 1, addons.place_of(world, slot))


def _know(upgrade: str) -> Preparation:
    """Return a preparation that grants the player an upgrade."""
    return lambda world, _: commands.grant_upgrade(world, 1, world.catalog.upgrade(upgrade).id)


def _at_it(producer: str, ability: int, makes: str) -> Preparation:
    """Return a preparation that adds a structure of another type with something in production."""

    def prepare(world: World, slot: int) -> None:
        x, y = world.pos[slot].tolist()
        other = lifecycle.spawn(world, world.catalog.unit(producer), 1, (x - 4.0, y - 6.0))
        lifecycle.spawn(world, world.catalog.unit("Pylon"), 1, (x - 1.0, y - 4.5))
        production.enqueue(world, other, world.catalog.ability(ability), makes=makes, loops=2000.0)
        advance(world, 2)

    return prepare


PREPARE: dict[str, Preparation] = {
    "stop": _walk,
    "ghost_weapons_free": _bear("GhostHoldFireB"),
    "ghost_cloak_off": _bear("GhostCloak"),
    "banshee_cloak_off": _bear("BansheeCloak"),
    "generate_creep_off": _bear("makeCreep2x2Overlord"),
    "lurker_remove_hold_fire": _bear("LurkerHoldFireB"),
    "volatile_burst_building_off": _bear("VolatileBurstBuilding"),
    "cancel_lock_on_cancel": _use(2350, 8),
    "cancel_channel_snipe": _use(2714),
    "cancel_tac_nuke_strike": _use(1622),
    "cancel_neural_parasite": _use(249),
    "cancel_graviton_beam": _use(173, distance=3.0),
    "cancel_prismatic_alignment": _use(2393),
    "pulsar_beam_off": _use(2375),
    "cancel_phase_shift": _split,
    "cancel_job": _queue,
    "cancel_slot": _queue,
    "halt": _at_work,
    "return": _load_up,
    "viper_consume_structure": _hungry,
    "recharge_shields": _drained,
    "stop_recharging": _recharge,
    "battery_overcharge": _battery,
    "load_all": _worker,
    **dict.fromkeys(("redirect_attack", "redirect_stop", "redirect_stim"), _man),
    **dict.fromkeys(("unload_all", "unload_all_at", "unload_unit"), _fill),
}
"""Preparations by the name of a skill."""
OF_UNIT: dict[tuple[str, str], Preparation] = {
    **dict.fromkeys([(name, "train") for name in ("Barracks", "Factory", "Starport")], _with_tech_lab),
    ("Gateway", "structure_morph"): _know("WarpGateResearch"),
}
"""The same for one type of unit."""
BY_RULE: dict[str, Preparation] = {
    "chrono_economy": _at_it("Nexus", 1006, "Probe"),
    "chrono_military": _at_it("Gateway", 916, "Zealot"),
    "chrono_research": _at_it("CyberneticsCore", 1568, "WarpGateResearch"),
    "morph_warpgates": _know("WarpGateResearch"),
}
"""Preparations by the rule of a text action, without which it finds nothing."""
