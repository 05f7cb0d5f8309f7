"""Hits, compiled; `systems.hits` has the rules."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns, columns_of
from khala_simulator.compiled.damage cimport hit_target, hit_with
from khala_simulator.compiled.missiles cimport launch
from khala_simulator.compiled.numbers cimport count
from khala_simulator.compiled.shots cimport PendingHit, Shot, emptied
from khala_simulator.compiled.sweeps cimport begin
from khala_simulator.compiled.tables cimport Hit, Tables, tables_of

cnp.import_array()

cdef int64_t NOBODY = -1


def fall_due(world):
    """Carry out every hit that is due."""
    table = world.pending
    cdef object rows = table.rows
    cdef Py_ssize_t n = count(rows), due = 0, i, k = 0
    if not n:
        return
    cdef int64_t loop = world.loop
    cdef PendingHit* hits = <PendingHit*>cnp.PyArray_DATA(<cnp.ndarray>rows)
    cdef PendingHit* later
    for i in range(n):
        due += hits[i].due <= loop
    if not due:
        return
    cdef Columns c = columns_of(world)
    cdef Tables tables = tables_of(world)
    emptied(table, n - due)
    later = <PendingHit*>cnp.PyArray_DATA(<cnp.ndarray>table.rows)
    for i in range(n):
        if hits[i].shot.target != NOBODY and not tables.weapon(hits[i].shot.weapon).kamikaze:
            hits[i].shot.goal = c.pos[hits[i].shot.target]
        if not hits[i].due <= loop:
            later[k] = hits[i]
            k += 1
    for i in range(n):
        if hits[i].due <= loop and hits[i].shot.source != NOBODY:
            carry_out(world, tables, &hits[i])


cdef carry_out(world, Tables tables, PendingHit* pending):
    """Carry out one hit: at once, as a missile or as a sweep."""
    cdef Shot* shot = &pending.shot
    cdef Hit* hit = &tables.hits[tables.weapon(shot.weapon).first_hit + shot.hit]
    if pending.single:
        hit_target(world, shot)
    elif hit.flies:
        launch(world, shot, hit)
    elif hit.sweeps:
        begin(world, shot, pending.due)
    else:
        hit_with(world, shot)
