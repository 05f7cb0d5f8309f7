"""The catalog's weapons, hits and types as compiled systems read them."""
import functools
import math

from libc.stdint cimport int64_t
from libc.stdlib cimport calloc, free

from khala_simulator.abilities import registry as _every_impact  # noqa: F401  # the skills add to IMPACTS and LAUNCHERS
from khala_simulator.combat.damage import IMPACTS
from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.combat.targets import aim_cosine
from khala_simulator.systems.missiles import speeds
from khala_simulator.tables import stats
from khala_simulator.tables.stats import ATTRIBUTES, bit_set

cdef int64_t GROUND_PLANE = stats.GROUND_PLANE
cdef int64_t AIR_PLANE = stats.AIR_PLANE
cdef dict KINDS = {"ranged": RANGED, "melee": MELEE, "splash": SPLASH}


cdef class Tables:
    def __cinit__(self, catalog):
        cdef Py_ssize_t row
        self.weapon_count = len(catalog.weapons)
        self.weapons = <Weapon*>calloc(self.weapon_count, sizeof(Weapon))
        self.hits = <Hit*>calloc(sum(len(weapon.hits) for weapon in catalog.weapons) + 1, sizeof(Hit))
        self.unturnable = <bint*>calloc(len(catalog.units), sizeof(bint))
        if not (self.weapons and self.hits and self.unturnable):
            raise MemoryError
        for unit in catalog.units:
            row = unit.row
            self.unturnable[row] = unit.unturnable
        cdef Py_ssize_t index = 0
        for weapon in catalog.weapons:
            write_weapon(&self.weapons[<Py_ssize_t>weapon.row], weapon)
            self.weapons[<Py_ssize_t>weapon.row].first_hit = index
            for hit in weapon.hits:
                write_hit(&self.hits[index], hit)
                index += 1

    def __dealloc__(self):
        cdef Py_ssize_t row, index
        for row in range(self.weapon_count):
            for index in range(self.weapons[row].hits):
                free(self.hits[self.weapons[row].first_hit + index].line.points)
        free(self.weapons)
        free(self.hits)
        free(self.unturnable)


cdef write_weapon(Weapon* row, weapon):
    low, high = weapon.jitter_loops
    row.hits = len(weapon.hits)
    row.damage_point, row.backswing = weapon.damage_point_loops, weapon.backswing_loops
    row.delay, row.delay_more = low, high - low
    row.min_range, row.slop = weapon.min_range, weapon.slop
    row.aim_cos = aim_cosine(weapon)
    row.excluding = bit_set((weapon.excluding,), ATTRIBUTES) if weapon.excluding else 0
    row.beam, row.kamikaze, row.launches = weapon.is_beam, weapon.is_kamikaze, weapon.id in LAUNCHERS
    row.rolling, row.turreted = weapon.moves == "moving", weapon.turret_deg_n is not None


cdef write_hit(Hit* row, hit):
    row.delay = 0.0 if hit.sweep is not None else hit.delay_loops
    row.first_speed, row.speed, row.gain = speeds(hit)
    row.kind = KINDS.get(hit.kind, SPELL)
    row.flies, row.sweeps = hit.missile_speed_n is not None, hit.sweep is not None
    row.bounces, row.conditional = hit.bounce, bool(hit.when)
    row.ignores_armor = hit.ignores_armor
    row.impacts = hit.effect in IMPACTS
    cdef bint ordinary = not hit.kills_self and (hit.search is None or hit.bounce)
    row.plain, row.splashes = ordinary and not hit.area, ordinary and bool(hit.area)
    row.affects = affects_of(hit.area_affects if hit.sweep is None else hit.sweep.affects)
    if hit.sweep is not None:
        write_line(&row.line, hit.sweep)


cdef write_line(Line* line, sweep):
    cdef Py_ssize_t i
    line.points = <LinePoint*>calloc(len(sweep.points), sizeof(LinePoint))
    if line.points == NULL:
        raise MemoryError
    line.count, line.radius, line.lag = len(sweep.points), sweep.radius, sweep.lag_loops
    line.past_range, line.from_source = sweep.past_range, sweep.origin == "source"
    for i, (delay, across, along) in enumerate(sweep.points):
        line.points[i].delay = delay - sweep.lag_loops
        line.points[i].across, line.points[i].along = across, along


cdef Affects affects_of(object record):
    """Return which units a splash or a sweep may touch."""
    cdef Affects affects
    affects.allies, affects.neutral = record.allies, record.neutral
    affects.only_structures, affects.no_structures = record.only == "structure", record.excluding == "structure"
    affects.not_self, affects.not_target = record.not_self, record.not_target
    plane = record.plane
    affects.planes = ANY_PLANE if plane == "any" else GROUND_PLANE if plane == "ground" else AIR_PLANE
    return affects


@functools.lru_cache(maxsize=4)
def made(catalog):
    return Tables(catalog)


cdef object known = None
cdef Tables known_tables = None


cdef Tables tables_of(object world):
    """Return the rows of a world's catalog."""
    global known, known_tables
    catalog = world.catalog
    if catalog is not known:
        known_tables = made(catalog)
        known = catalog
    return known_tables
