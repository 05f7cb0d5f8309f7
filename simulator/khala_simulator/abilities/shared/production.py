"""Skills of structures and eggs: training, changing kind, rally points, and calling off what is in a queue.

They take effect at once and leave orders alone; the work is ``systems.production``'s. When several units get the order
to train, only one does: the one with the shortest queue (with a reactor it counts half), the nearest to idle first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import morphs
from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import lifecycle
from khala_simulator.economy import construction, production
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.world import NO_TAG, NOBODY, Rally

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

COCOONS: Final = {"Larva": "Egg"}
"""The type of a unit while it changes into another one."""
MORPHS: Final = frozenset({"structure_morph", "addon", "grow"})
WORKERS: Final = 3690  # the general ability that sets a rally point for workers


# training -------------------------------------------------------------------------------------------------------------


def _train(world: World, slots: list[int], ability: Ability, _: int, __: Point | None, ___: bool) -> list[int]:
    """Put a unit into the queue of a structure, or into an egg."""
    slot = min(slots, key=lambda s: (_length(world, s), s))
    loops = ability.loops
    if world.unit_type(slot).name in COCOONS:
        lifecycle.become(world, slot, world.catalog.unit(COCOONS[world.unit_type(slot).name]))
        world.life[slot] = world.life_max[slot]
        loops += construction.SEEN_LATER
    production.enqueue(world, slot, ability, makes=ability.unit, loops=loops)
    return [slot]


def _length(world: World, slot: int) -> float:
    return len(world.jobs.get(slot, ())) / production.parallel(world, slot)


def has_place(world: World, slot: int, ability: Ability) -> ActionResult:
    """Refuse if a queue has no room for one more job of this kind."""
    if ability.unit and ability.unit not in world.catalog.row_of_name:
        return ActionResult.NOT_SUPPORTED
    jobs = world.jobs.get(slot, [])
    if any(job.kind in MORPHS for job in jobs) or (world.casts[slot] and world.bound[slot]):
        return ActionResult.CANT_QUEUE_THAT_ORDER
    if not world.powered[slot]:
        return ActionResult.CANT_TRAIN_TOO_FAR_FROM_POWER
    return ActionResult.SUCCESS if production.room(world, slot) else ActionResult.QUEUE_IS_FULL


def _change(world: World, slots: list[int], ability: Ability, _: int, __: Point | None, ___: bool) -> list[int]:
    """Make a structure change its kind; it makes nothing else meanwhile."""
    for slot in slots:
        production.enqueue(world, slot, ability, makes=ability.unit, loops=ability.loops)
    return slots


def _can_change(world: World, slot: int, ability: Ability) -> ActionResult:
    if slot in world.jobs:
        return ActionResult.CANT_QUEUE_THAT_ORDER
    return has_place(world, slot, ability)


# calling off ----------------------------------------------------------------------------------------------------------


def cancel_last(world: World, slots: list[int], _: Ability, __: int, ___: Point | None, ____: bool) -> list[int]:
    """Call off the last job of a queue; an egg becomes a larva again, and a cocoon its former type."""
    growing = [slot for slot in slots if morphs.grows(world, slot)]
    for slot in growing:
        morphs.call_off(world, slot)
    taken = [slot for slot in slots if production.call_off(world, slot)]
    for slot in taken:
        _hatch_back(world, slot)
    return growing + taken


def cancel_at(world: World, slot: int, index: int) -> bool:
    """Call off the job at a place of a queue, as a click on the panel does."""
    if index < 0 or not production.call_off(world, slot, index):
        return False
    _hatch_back(world, slot)
    return True


def _hatch_back(world: World, slot: int) -> None:
    if world.unit_type(slot).name in COCOONS.values() and slot not in world.jobs:
        lifecycle.become(world, slot, world.catalog.unit("Larva"))
        world.life[slot] = world.life_max[slot]


def has_job(world: World, slot: int, _: Ability) -> ActionResult:
    """Refuse if there is nothing to call off."""
    found = slot in world.jobs or morphs.grows(world, slot)
    return ActionResult.SUCCESS if found else ActionResult.CANT_FIND_CANCEL_ORDER


# rally points ---------------------------------------------------------------------------------------------------------


def _rally(world: World, slots: list[int], ability: Ability, target: int, point: Point | None, _: bool) -> list[int]:
    """Set where new units are sent; aimed at the structure itself it is forgotten."""
    kind = "workers" if ability.general == WORKERS else "units"
    for slot in slots:
        set_rally(world, slot, kind, target, point)
    return slots


def set_rally(world: World, slot: int, kind: str, target: int, point: Point | None) -> None:
    """Send a structure's new ``units`` or ``workers`` to a unit (tag) or a point from now on."""
    victim = world.slot_of(target)
    if victim == slot:
        world.rallies.get(slot, {}).pop(kind, None)
        return
    if victim != NOBODY:
        x, y = world.pos[victim].tolist()
        world.rallies.setdefault(slot, {})[kind] = Rally((x, y), target)
    elif point is not None:
        world.rallies.setdefault(slot, {})[kind] = Rally(point, NO_TAG)


def rally_by_click(world: World, slots: list[int], target: int, point: Point | None, _: bool) -> list[int]:
    """Set a rally point by right click: for workers if it is on a resource, else for all units."""
    taken = []
    for slot in slots:
        card = world.catalog.abilities_of(int(world.type[slot]))
        kinds = {"workers" if a.general == WORKERS else "units" for a in card if a.effect == "rally"}
        if not world.unit_type(slot).structure or not kinds:
            continue
        resource = target != NOBODY and bool(world.unit_type(target).resource)
        for kind in sorted({"workers"} if resource and "workers" in kinds else kinds):
            set_rally(world, slot, kind, world.tag_of(target), point)
        taken.append(slot)
    return taken


def _sends_units(world: World, slot: int, ability: Ability) -> ActionResult:
    """Refuse what produces no units: all but structures, eggs, and units that are themselves unfinished."""
    finished = world.build_progress[slot] >= 1.0
    return ActionResult.ERROR if ability.link == "ProgressRally" and finished else ActionResult.SUCCESS


def _can_rally(_: World, cast: Cast) -> ActionResult:
    aimed = cast.target != NOBODY or cast.point is not None
    return ActionResult.SUCCESS if aimed else ActionResult.MUST_TARGET_VISIBLE_LOCATION


SMARTS: Final = (rally_by_click,)
SKILLS: Final = {
    "train": Skill(
        give=_train,
        ready=has_place,
        estimates=(
            "Of several structures the one with the shortest queue trains.",
            "What a structure was making and had queued is lost with it, without a refund.",
        ),
    ),
    "structure_morph": Skill(
        give=_change, ready=_can_change, estimates=("A structure changes its kind only with an empty queue.",)
    ),
    "cancel_job": Skill(give=cancel_last, ready=has_job, anytime=True),
    "cancel_slot": Skill(give=cancel_last, ready=has_job, anytime=True),
    "rally": Skill(give=_rally, refuse=_can_rally, ready=_sends_units, anytime=True),
}
