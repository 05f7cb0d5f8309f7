cimport cython

from khala_simulator.systems cimport (
    acquire,
    area_effects,
    autocast,
    avoidance,
    buffs,
    casts,
    collision,
    construction,
    creep,
    death,
    engagement,
    harvest,
    hits,
    idleness,
    lifetimes,
    missiles,
    movement,
    navigation,
    opponents,
    orders,
    passives,
    power,
    production,
    regeneration,
    sweeps,
    triggers,
    vision,
    weapons,
)
from khala_simulator.world.fields cimport WorldFields


cdef play_loop(WorldFields world, bint fights=*)
@cython.locals(done=Py_ssize_t)
cpdef Py_ssize_t advance(WorldFields world, Py_ssize_t loops=*, bint fights=*) except -1
