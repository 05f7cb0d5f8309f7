"""Two things in one loop: which of them comes first, pair by pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs, healing
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import PendingHit, Shot

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.simulator.engine.conftest import Field

HEAL, REPAIR, LOAD = 386, 316, 394
TRAIN_MARINE, TRAIN_DRONE, CANCEL_LAST = 560, 1342, 306
CONSUME, RESEARCH_SPEED = 2073, 1253


def kill(field: Any, slot: int) -> None:
    commands.debug_kill(field.world, [field.world.tag_of(slot)])


def hit(field: Field, attacker: str, victim: int, *, loops: int) -> int:
    """Put a hit under way that falls due after a number of loops; return the attacker."""
    world = field.world
    source = field.still(attacker, 2, 30, 30)
    weapon = world.catalog.unit(attacker).weapons[0]
    shot = Shot(source, 2, victim, NOBODY, weapon.row, 0, world.pos[source], world.pos[victim])
    world.pending.append(PendingHit(shot, world.loop + loops, single=True))
    world.bursting[source] = True
    return source


# killed, and healed ---------------------------------------------------------------------------------------------------


def medivac(field: Any, patient: int) -> None:
    field.order(field.still("Medivac", 1, 16, 17), HEAL, patient)


def scv(field: Any, patient: int) -> None:
    field.world.players[1].minerals = 100
    field.order(field.put("SCV", 1, 16, 15), REPAIR, patient)


def transfusion(field: Any, patient: int) -> None:
    buffs.apply(field.world, patient, "Transfusion", source=field.still("Queen", 1, 14, 16))


def regeneration(field: Any, patient: int) -> None:
    field.world.life_regen[patient] = 2.0
    field.world.regenerating = (True, True, True)


@pytest.mark.parametrize(
    ("patient", "healer"),
    [("Marine", medivac), ("Hellion", scv), ("Roach", transfusion), ("Zergling", regeneration)],
)
@pytest.mark.parametrize("how", ["debug", "hit"])
def test_a_killed_unit_is_dead_whatever_heals_it_in_the_same_loop(
    field: Any, patient: str, healer: Callable[[Any, int], None], how: str
) -> None:
    world = field.world
    slot = field.still(patient, 1, 16, 16)
    tag = world.tag_of(slot)
    world.life[slot] = 5.0
    healer(field, slot)
    field.until(lambda: world.life[slot] > 5.0)
    world.life[slot] = 1.0
    if how == "debug":
        kill(field, slot)
    else:
        hit(field, "Thor", slot, loops=1)
    field.play(1)
    assert world.slot_of(tag) == NOBODY


def test_nothing_heals_the_dead_and_no_score_counts_it(field: Any) -> None:
    world = field.world
    slot = field.still("Marine", 1, 16, 16)
    kill(field, slot)
    commands.debug_set_value(world, world.tag_of(slot), life=40)
    assert healing.heal(world, slot, 10.0) == 0.0
    assert (world.life[slot], world.players[1].score.healed.life) == (0.0, 0.0)


def test_research_of_more_life_wakes_nobody(field: Any) -> None:
    world = field.world
    slot = field.still("Marine", 1, 16, 16)
    kill(field, slot)
    field.research(1, "ShieldWall")
    assert world.life[slot] == 0.0


# killed, and what it would have done ----------------------------------------------------------------------------------


def test_what_is_killed_between_two_loops_does_nothing_in_the_next(field: Any) -> None:
    world = field.world
    marine, zergling = field.put("Marine", 1, 16, 16), field.still("Zergling", 2, 18, 16)
    field.until(lambda: world.windup[marine] >= 0.0)
    kill(field, marine)
    before = world.life[zergling]
    field.play(20)
    assert world.life[zergling] >= before


def test_an_egg_that_is_killed_as_it_hatches_is_dead(field: Any) -> None:
    world = field.world
    world.players[1].minerals = 50
    larva = field.put("Larva", 1, 16, 16)
    field.put("Overlord", 1, 20, 20)
    assert field.order(larva, TRAIN_DRONE)
    (job,) = world.jobs[larva]
    field.play(int(job.loops) - 2)
    assert world.unit_type(larva).name == "Egg"
    kill(field, larva)
    field.play(2)
    assert not [slot for slot in world.units_of(1).tolist() if world.unit_type(slot).name == "Drone"]


def test_a_hit_due_in_the_loop_of_the_hatching_hits_what_hatched(field: Any) -> None:
    world = field.world
    world.players[1].minerals = 50
    larva = field.put("Larva", 1, 16, 16)
    field.put("Overlord", 1, 20, 20)
    field.order(larva, TRAIN_DRONE)
    (job,) = world.jobs[larva]
    tag = world.tag_of(larva)
    loops = field.until(lambda: job.done >= job.loops - 1.0)
    hit(field, "Roach", larva, loops=1)
    field.play(1)
    assert world.loop == loops + 1
    assert world.unit_type(world.slot_of(tag)).name == "Drone"
    assert world.life[larva] == 40 - 16


def consumed(field: Field, last: int = 0) -> tuple[Any, int]:
    """Play until a Viper has drained the rest of a structure that researches; return the world and how long that took.

    The research needs one loop more when so many loops have passed.
    """
    world = field.world
    world.players[2].minerals = world.players[2].vespene = 500
    pool, viper = field.put("SpawningPool", 2, 16.5, 16.5), field.still("Viper", 2, 16, 14)
    world.energy[viper], world.life[pool] = 0.0, 20.0
    assert field.order(pool, RESEARCH_SPEED)
    (job,) = world.jobs[pool]
    assert field.order(viper, CONSUME, pool)
    for loop in field.loops(200):
        if not world.alive[pool]:
            return world, loop
        if loop == last:
            job.done = job.loops - 1.0
    raise AssertionError("the structure lives")


def test_what_an_ability_kills_finishes_nothing_in_that_loop(make_field: Callable[[], Field]) -> None:
    _, loops = consumed(make_field())
    for last, upgrades in ((loops - 1, 0), (loops - 2, 1)):
        world, again = consumed(make_field(), last)
        assert (again, len(world.players[2].upgrades)) == (loops, upgrades)


# cancelled, and finished ----------------------------------------------------------------------------------------------


def begun(field: Field) -> int:
    """Return a production structure with one unit that needs one loop more."""
    world = field.world
    world.players[1].minerals = world.players[1].vespene = 500
    field.put("SupplyDepot", 1, 24, 24)
    barracks = field.put("Barracks", 1, 12.5, 12.5)
    assert field.order(barracks, TRAIN_MARINE)
    (job,) = world.jobs[barracks]
    field.until(lambda: job.done >= job.loops - 1.0, most=600)
    return barracks


def test_what_is_cancelled_before_its_last_loop_is_not_finished(field: Any) -> None:
    world = field.world
    barracks = begun(field)
    assert field.order(barracks, CANCEL_LAST)
    field.play(1)
    assert world.players[1].minerals == 500
    assert not [slot for slot in world.units_of(1).tolist() if world.unit_type(slot).name == "Marine"]


def test_what_is_finished_can_not_be_cancelled_any_more(field: Any) -> None:
    world = field.world
    barracks = begun(field)
    field.play(1)
    assert not field.order(barracks, CANCEL_LAST)
    assert world.players[1].minerals == 450


def test_a_structure_that_is_killed_in_its_last_loop_makes_nothing(field: Any) -> None:
    world = field.world
    kill(field, begun(field))
    field.play(1)
    assert not [slot for slot in world.units_of(1).tolist() if world.unit_type(slot).name == "Marine"]


def test_a_hit_due_in_the_last_loop_of_a_structure_comes_after_its_product(field: Any) -> None:
    world = field.world
    barracks = begun(field)
    world.life[barracks] = 1.0
    hit(field, "Thor", barracks, loops=1)
    field.play(1)
    assert [world.unit_type(slot).name for slot in world.units_of(1).tolist() if slot != barracks][-1] == "Marine"
    assert not world.alive[barracks]


# loaded, and hit ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("loaded", [True, False])
def test_who_is_loaded_in_the_loop_of_a_hit_is_not_hit(field: Any, *, loaded: bool) -> None:
    world = field.world
    marine, ship = field.still("Marine", 1, 16, 16), field.still("Medivac", 1, 16, 16)
    world.life[marine] = 1.0
    if loaded:
        assert field.order(ship, LOAD, marine)
    hit(field, "Thor", marine, loops=1)
    field.play(1)
    assert bool(world.alive[marine]) == loaded
    assert (world.carrier[marine] == ship) == loaded


def test_who_is_loaded_into_a_transport_that_dies_in_the_same_loop_dies_with_it(field: Any) -> None:
    world = field.world
    marine, ship = field.still("Marine", 1, 16, 16), field.still("Medivac", 1, 16, 16)
    world.life[ship] = 1.0
    field.order(ship, LOAD, marine)
    hit(field, "Thor", ship, loops=1)
    field.play(1)
    assert not world.alive[marine]


def test_who_is_killed_is_not_loaded(field: Any) -> None:
    world = field.world
    marine, ship = field.still("Marine", 1, 16, 16), field.still("Medivac", 1, 16, 16)
    field.order(ship, LOAD, marine)
    kill(field, marine)
    field.play(1)
    assert not world.passengers(ship)


# killed by two, and at the same time ----------------------------------------------------------------------------------


def test_two_units_that_hit_each_other_in_one_loop_both_die(field: Any) -> None:
    world = field.world
    left, right = field.still("Marine", 1, 16, 16), field.still("Marine", 2, 18, 16)
    world.life[left] = world.life[right] = 1.0
    for one, other in ((left, right), (right, left)):
        weapon = world.catalog.unit("Marine").weapons[0]
        shot = Shot(one, world.owner[one], other, NOBODY, weapon.row, 0, world.pos[one], world.pos[other])
        world.pending.append(PendingHit(shot, world.loop + 1, single=True))
    field.play(1)
    assert not world.alive[left]
    assert not world.alive[right]


def test_who_is_killed_as_its_time_runs_out_is_the_killers(field: Any) -> None:
    world = field.world
    broodling = field.still("Broodling", 1, 16, 16)
    world.life[broodling], world.expires[broodling], world.mortal = 1.0, world.loop + 1, True
    hit(field, "Thor", broodling, loops=1)
    field.play(1)
    (death,) = world.deaths
    assert death.killer == 2
