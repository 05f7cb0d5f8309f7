"""Production: the queues of structures and eggs, and how something gets into one and out of it again.

A ``Job`` is one product in a queue; ``systems.production`` works on the first one, with a reactor on the
first two. What an ability means for a queue is in ``abilities.shared.production`` and ``research``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.economy import payments
from khala_simulator.economy.payments import ALL, CANCELLED
from khala_simulator.tables import prices
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.jobs import Job

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.world import World

QUEUE: Final = 5
REACTOR_QUEUE: Final = 8
REACTOR_PARALLEL: Final = 2


def has_reactor(world: World, slot: int) -> bool:
    """Return whether a reactor stands at a structure's side."""
    side = int(world.addon[slot])
    return side != NOBODY and world.unit_type(side).name.endswith("Reactor")


def parallel(world: World, slot: int) -> int:
    """Return how many jobs of a queue are worked on at a time."""
    return REACTOR_PARALLEL if has_reactor(world, slot) else 1


def room(world: World, slot: int) -> int:
    """Return how many more jobs a queue takes: one for an egg, five for a structure, eight with a reactor."""
    unit: UnitType = world.unit_type(slot)
    size = (REACTOR_QUEUE if has_reactor(world, slot) else QUEUE) if unit.structure else 1
    return max(0, size - len(world.jobs.get(slot, ())))


def enqueue(world: World, slot: int, ability: Ability, *, makes: str, loops: float, site: int = 0) -> Job:
    """Charge the owner and put a job at the end of a queue."""
    owner = int(world.owner[slot])
    paid = payments.charge(world, owner, prices.cost_of(ability))
    job = Job(
        ability.id, ability.effect, makes, owner, loops, paid, supply=ability.supply, count=ability.count, site=site
    )
    world.jobs.setdefault(slot, []).append(job)
    world.players[owner].underway.append(makes)
    return job


def drop(world: World, slot: int, job: Job) -> None:
    """Take a job out of its queue, finished or not."""
    queue = world.jobs.get(slot, [])
    queue.remove(job)
    if not queue:
        world.jobs.pop(slot, None)
    forget(world, job)


def forget(world: World, job: Job) -> None:
    """Stop counting a job's product as under way."""
    underway = world.players[job.owner].underway
    if job.makes in underway:
        underway.remove(job.makes)


def call_off(world: World, slot: int, index: int = -1) -> bool:
    """Cancel the job at a place of a queue, by default the last; return whether there was one.

    A queued or training job refunds all of its price, a structure that was changing its kind a part.
    """
    queue = world.jobs.get(slot, [])
    if not -len(queue) <= index < len(queue):
        return False
    job = queue[index]
    payments.refund(world, job.owner, job.paid, CANCELLED if job.kind in ("structure_morph", "addon") else ALL)
    drop(world, slot, job)
    return True
