"""Hits: the hits of a fired weapon happen when they are due, at once, as a missile or as a sweep.

Between ``weapons``, which puts hits into ``pending`` at the damage point, and the rules that carry them out:
``damage``, ``missiles``, ``sweeps``. Hits happen in the order in which they are due and were fired; those of a dead
attacker are lost. A burst is a channel: its later hits are lost when the attacker drops the attack.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.combat import damage
from khala_simulator.native import columns, memory
from khala_simulator.systems import missiles, sweeps
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.world.shots import PendingHit
    from khala_simulator.world.world import World


def fall_due(world: World) -> None:
    """Carry out every hit that is due."""
    if not world.pending:
        return
    loop = world.loop
    if not _any_due(world.pending, loop):
        return
    due = [pending for pending in world.pending if _is_due(pending, loop)]
    c = columns.columns_of(world)
    kamikaze = memory.bools(world.stats.kamikaze)
    bursts = memory.bools(world.stats.bursts)
    for pending in world.pending:
        _follow(c, kamikaze, pending)
    world.pending = [pending for pending in world.pending if not _is_due(pending, loop)]
    for pending in due:
        source = pending.shot.source
        if source != NOBODY and not (bursts[pending.shot.weapon] and not c.bursting[source]):
            _carry_out(world, pending)
            c = columns.columns_of(world)


def _any_due(hits: list[PendingHit], loop: int) -> bool:
    for pending in hits:  # noqa: SIM110  # a loop that is compiled
        if _is_due(pending, loop):
            return True
    return False


def _is_due(pending: PendingHit, loop: int) -> bool:
    return pending.due <= loop


def _follow(c: Columns, kamikaze: Cells, pending: PendingHit) -> None:
    """Aim a hit at where its target is now; a suicide attacker is the middle of its own."""
    shot = pending.shot
    if shot.target != NOBODY and not kamikaze[shot.weapon]:
        shot.goal_x = c.pos[shot.target].x
        shot.goal_y = c.pos[shot.target].y


def _carry_out(world: World, pending: PendingHit) -> None:
    """Carry out one hit: at once, as a missile or as a sweep."""
    shot = pending.shot
    hit = world.catalog.weapons[shot.weapon].hits[shot.hit]
    if pending.single:
        damage.hit_target(world, shot)
    elif hit.missile_speed_n is not None:
        missiles.launch(world, shot, hit)
    elif hit.sweep is not None:
        sweeps.begin(world, shot, pending.due)
    else:
        damage.hit_with(world, shot)
