"""The Carrier and its Interceptors: building them, sending them out, calling them back, and losing them.

An Interceptor belongs to its Carrier (column ``home``). In the hangar it is a passenger; outside it attacks the
Carrier's target, as far as the leash allows, and otherwise flies back. When the Carrier dies, all its Interceptors die.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, gap, number
from khala_simulator.combat import lifecycle
from khala_simulator.combat.traits import refresh
from khala_simulator.economy import production
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import ATTACK, MOVE, Order, OrderKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import UnitRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

ARM = 1042
INTERCEPTOR = "Interceptor"
EQUIPPED, NEXT_LAUNCH = "hangar", "launch"
DOCKING_GAP = 1.1  # a follower stops within this distance of the unit that it follows


def crew_of(world: World, carrier: int) -> list[int]:
    """Return the Interceptors of a Carrier, in the hangar and outside, ascending."""
    crew: list[int] = which(world.home[: world.top] == carrier).tolist()
    return crew


def add_interceptor(world: World, carrier: int) -> int:
    """Put a new Interceptor into a Carrier's hangar; return its slot."""
    x, y = world.pos[carrier].tolist()
    slot = lifecycle.spawn(world, world.catalog.unit(INTERCEPTOR), int(world.owner[carrier]), (x, y))
    world.home[slot] = carrier
    lifecycle.stow(world, slot, carrier)
    return slot


# building them --------------------------------------------------------------------------------------------------------


def _arm(world: World, slots: list[int], ability: Ability, _: int, __: Point | None, ___: bool) -> list[int]:
    """Put an Interceptor into the hangar's queue."""
    for slot in slots:
        production.enqueue(world, slot, ability, makes=ability.unit, loops=ability.loops)
    return slots


def _has_place(world: World, slot: int, ability: Ability) -> ActionResult:
    """Refuse if the hangar and its queue have no room for one more."""
    queued = len(world.jobs.get(slot, ()))
    if queued >= production.QUEUE:
        return ActionResult.QUEUE_IS_FULL
    full = queued + len(crew_of(world, slot)) >= number(ability, "max")
    return ActionResult.CANT_HOLD_ANY_MORE_AMMO if full else ActionResult.SUCCESS


# sending them ---------------------------------------------------------------------------------------------------------


def _tend(world: World, slots: list[int]) -> None:
    """Equip new Carriers, launch where there is a target, and direct the Interceptors outside."""
    ability = world.catalog.ability(ARM)
    out = _outside(world)
    for carrier in slots:
        state = world.timers.setdefault(carrier, {})
        if EQUIPPED not in state:
            _equip(world, carrier, int(number(ability, "start")))
        prey = int(world.target[carrier])
        if prey != NOBODY and world.in_reach[carrier] and state.get(NEXT_LAUNCH, 0.0) <= world.loop:
            _launch(world, carrier, prey, ability)
        if out.size:
            for slot in out[world.home[out] == carrier].tolist():
                _direct(world, slot, carrier, number(ability, "leash"))


def _outside(world: World) -> Ints:
    n = world.top
    flying: Ints = which((world.home[:n] != NOBODY) & (world.carrier[:n] == NOBODY))
    return flying


def _equip(world: World, carrier: int, count: int) -> None:
    """Give a new Carrier its first Interceptors; a hallucination has none."""
    world.timers[carrier][EQUIPPED] = 0.0
    if not world.hallucination[carrier]:
        for _ in range(count):
            add_interceptor(world, carrier)


def _launch(world: World, carrier: int, prey: int, ability: Ability) -> None:
    docked = [slot for slot in world.passengers(carrier) if world.home[slot] == carrier]
    if not docked:
        return
    slot = docked[0]
    x, y = world.pos[carrier].tolist()
    lifecycle.unstow(world, slot, (x, y))
    teleport.to(world, slot, (x, y))
    world.heading[slot] = world.heading[carrier]
    refresh(world, slot)
    _attack(world, slot, prey)
    world.timers[carrier][NEXT_LAUNCH] = world.loop + number(ability, "launch_loops")


def _direct(world: World, slot: int, carrier: int, leash: float) -> None:
    """Attack the Carrier's target, go on with its own one while the leash allows, else return."""
    prey = int(world.target[carrier]) if world.in_reach[carrier] else NOBODY
    own = int(world.order_target[slot]) if int(world.order_kind[slot]) == OrderKind.ATTACK_UNIT else NOBODY
    if prey == NOBODY and own != NOBODY and gap(world, carrier, own) <= leash:
        prey = own
    if prey != NOBODY:
        if prey != own:
            _attack(world, slot, prey)
    elif gap(world, slot, carrier) <= DOCKING_GAP:
        world.queue[slot] = []
        commands.begin(world, slot, None)
        lifecycle.stow(world, slot, carrier)
        refresh(world, slot)
    elif int(world.order_kind[slot]) != OrderKind.FOLLOW:
        commands.begin(world, slot, Order(OrderKind.FOLLOW, MOVE, target=world.tag_of(carrier)))


def _attack(world: World, slot: int, prey: int) -> None:
    commands.begin(world, slot, Order(OrderKind.ATTACK_UNIT, ATTACK, target=world.tag_of(prey)))


def _take_along(world: World, carrier: int) -> None:
    """Kill the Interceptors of a Carrier that dies."""
    for slot in crew_of(world, carrier):
        if world.carrier[slot] == NOBODY:
            world.life[slot] = 0.0
            world.attacker[slot] = world.attacker[carrier]


def _build(world: World, cast: Cast) -> None:
    """Build an Interceptor in the Carrier's hangar."""


SKILLS: Final = {
    "arm": Skill(
        _build,
        give=_arm,
        ready=_has_place,
        estimates=(
            "Interceptors hover beside their target instead of passing over it again and again.",
            "An Interceptor is home within 1.1 of its Carrier; it keeps its life and regains shields there.",
            "Outside, Interceptors go on with their target while it is within 12 of the Carrier's edge.",
        ),
    ),
}
PASSIVES: Final[dict[str, UnitRule]] = {"Carrier": _tend}
DEATHS: Final[dict[str, Callable[[World, int], None]]] = {"Carrier": _take_along}
