# Written by khala_simulator.compiled.declare from world.columns.
"""The world's columns as pointers, for compiled systems."""
cimport numpy as cnp

cnp.import_array()


cdef class Columns:
    def __deepcopy__(self, memo):
        """Return None: a copy of a world binds its own arrays."""
        return None


cdef void* start(object column) except NULL:
    """Return where an array begins; its numbers must lie one after the other."""
    cdef cnp.ndarray array = column
    if not cnp.PyArray_ISCARRAY(array):
        raise ValueError("a column must be contiguous and writable")
    return cnp.PyArray_DATA(array)


cdef Columns bound(object world):
    cdef Columns c = Columns.__new__(Columns)
    c.capacity = world.capacity
    c.visible = <boolean*>start(world.visible)
    c.alive = <boolean*>start(world.alive)
    c.tag = <int64_t*>start(world.tag)
    c.type = <int64_t*>start(world.type)
    c.owner = <int64_t*>start(world.owner)
    c.pos = <Point*>start(world.pos)
    c.heading = <Point*>start(world.heading)
    c.speed = <double*>start(world.speed)
    c.life = <double*>start(world.life)
    c.shields = <double*>start(world.shields)
    c.energy = <double*>start(world.energy)
    c.build_progress = <double*>start(world.build_progress)
    c.burrowed = <boolean*>start(world.burrowed)
    c.hallucination = <boolean*>start(world.hallucination)
    c.born_loop = <int64_t*>start(world.born_loop)
    c.expires = <int64_t*>start(world.expires)
    c.carrier = <int64_t*>start(world.carrier)
    c.addon = <int64_t*>start(world.addon)
    c.home = <int64_t*>start(world.home)
    c.barrier = <double*>start(world.barrier)
    c.damaged_loop = <int64_t*>start(world.damaged_loop)
    c.order_kind = <int64_t*>start(world.order_kind)
    c.order_ability = <int64_t*>start(world.order_ability)
    c.order_target = <int64_t*>start(world.order_target)
    c.order_point = <Point*>start(world.order_point)
    c.order_aimed = <boolean*>start(world.order_aimed)
    c.order_origin = <Point*>start(world.order_origin)
    c.cast_at = <double*>start(world.cast_at)
    c.cast_begun = <double*>start(world.cast_begun)
    c.channels = <boolean*>start(world.channels)
    c.bound = <boolean*>start(world.bound)
    c.target = <int64_t*>start(world.target)
    c.attacker = <int64_t*>start(world.attacker)
    c.scan_loop = <int64_t*>start(world.scan_loop)
    c.guard = <Point*>start(world.guard)
    c.returning = <boolean*>start(world.returning)
    c.leashed = <boolean*>start(world.leashed)
    c.rank = <double*>start(world.rank)
    c.weapon = <int64_t*>start(world.weapon)
    c.reach = <double*>start(world.reach)
    c.reach_min = <double*>start(world.reach_min)
    c.slop = <double*>start(world.slop)
    c.aim_cos = <double*>start(world.aim_cos)
    c.turreted = <boolean*>start(world.turreted)
    c.rolling = <boolean*>start(world.rolling)
    c.beaming = <boolean*>start(world.beaming)
    c.turret = <Point*>start(world.turret)
    c.weapon_toggles = <int64_t*>start(world.weapon_toggles)
    c.spent = <boolean*>start(world.spent)
    c.cooldown = <double*>start(world.cooldown)
    c.windup = <double*>start(world.windup)
    c.backswing = <double*>start(world.backswing)
    c.build_loops = <double*>start(world.build_loops)
    c.self_made = <boolean*>start(world.self_made)
    c.site = <int64_t*>start(world.site)
    c.worked = <int64_t*>start(world.worked)
    c.harvest = <int64_t*>start(world.harvest)
    c.patch = <int64_t*>start(world.patch)
    c.occupant = <int64_t*>start(world.occupant)
    c.load = <int64_t*>start(world.load)
    c.contents = <int64_t*>start(world.contents)
    c.work_until = <double*>start(world.work_until)
    c.zone = <Point*>start(world.zone)
    c.zone_radius = <double*>start(world.zone_radius)
    c.help_loop = <int64_t*>start(world.help_loop)
    c.nav_point = <Point*>start(world.nav_point)
    c.nav_loop = <int64_t*>start(world.nav_loop)
    c.nav_straight = <boolean*>start(world.nav_straight)
    c.nav_end = <boolean*>start(world.nav_end)
    c.nav_goal = <Point*>start(world.nav_goal)
    c.nav_best = <double*>start(world.nav_best)
    c.nav_best_loop = <int64_t*>start(world.nav_best_loop)
    c.blocked = <int64_t*>start(world.blocked)
    c.detour = <int64_t*>start(world.detour)
    c.detour_end = <int64_t*>start(world.detour_end)
    c.aside = <Point*>start(world.aside)
    c.gap = <double*>start(world.gap)
    c.toward = <Point*>start(world.toward)
    c.in_reach = <boolean*>start(world.in_reach)
    c.intended = <Point*>start(world.intended)
    c.radius = <double*>start(world.radius)
    c.separation = <double*>start(world.separation)
    c.clearance = <double*>start(world.clearance)
    c.lightness = <double*>start(world.lightness)
    c.layer = <int64_t*>start(world.layer)
    c.layer_bits = <int64_t*>start(world.layer_bits)
    c.plane_bits = <int64_t*>start(world.plane_bits)
    c.step_max = <double*>start(world.step_max)
    c.step_gain = <double*>start(world.step_gain)
    c.step_loss = <double*>start(world.step_loss)
    c.glides = <boolean*>start(world.glides)
    c.turn_cos = <double*>start(world.turn_cos)
    c.turn_sin = <double*>start(world.turn_sin)
    c.turn_still_cos = <double*>start(world.turn_still_cos)
    c.turn_still_sin = <double*>start(world.turn_still_sin)
    c.priority = <double*>start(world.priority)
    c.ground_weapon = <int64_t*>start(world.ground_weapon)
    c.air_weapon = <int64_t*>start(world.air_weapon)
    c.close_weapon = <int64_t*>start(world.close_weapon)
    c.close_range = <double*>start(world.close_range)
    c.least_range = <double*>start(world.least_range)
    c.guns_walking = <boolean*>start(world.guns_walking)
    c.spares_structures = <boolean*>start(world.spares_structures)
    c.turret_cos = <double*>start(world.turret_cos)
    c.turret_sin = <double*>start(world.turret_sin)
    c.ground_scan = <double*>start(world.ground_scan)
    c.air_scan = <double*>start(world.air_scan)
    c.acquires = <boolean*>start(world.acquires)
    c.threat_bits = <int64_t*>start(world.threat_bits)
    c.defensive = <boolean*>start(world.defensive)
    c.flees = <boolean*>start(world.flees)
    c.targetable = <boolean*>start(world.targetable)
    c.cloaked = <boolean*>start(world.cloaked)
    c.sight = <double*>start(world.sight)
    c.detects = <double*>start(world.detects)
    c.can_act = <boolean*>start(world.can_act)
    c.can_attack = <boolean*>start(world.can_attack)
    c.can_cast = <boolean*>start(world.can_cast)
    c.casts = <boolean*>start(world.casts)
    c.attack_rate = <double*>start(world.attack_rate)
    c.range_add = <double*>start(world.range_add)
    c.armor_add = <double*>start(world.armor_add)
    c.shield_armor_add = <double*>start(world.shield_armor_add)
    c.ranged_add = <double*>start(world.ranged_add)
    c.melee_add = <double*>start(world.melee_add)
    c.taken_factor = <double*>start(world.taken_factor)
    c.air_taken_factor = <double*>start(world.air_taken_factor)
    c.dealt_factor = <double*>start(world.dealt_factor)
    c.bonus_bits = <int64_t*>start(world.bonus_bits)
    c.bonus_add = <double*>start(world.bonus_add)
    c.walks = <boolean*>start(world.walks)
    c.looks_around = <boolean*>start(world.looks_around)
    c.holds = <boolean*>start(world.holds)
    c.needs_target = <boolean*>start(world.needs_target)
    c.wants = <boolean*>start(world.wants)
    c.goal = <Point*>start(world.goal)
    c.stop_at = <double*>start(world.stop_at)
    c.work_rate = <double*>start(world.work_rate)
    c.powered = <boolean*>start(world.powered)
    c.creep_factor = <double*>start(world.creep_factor)
    c.life_max = <double*>start(world.life_max)
    c.life_regen = <double*>start(world.life_regen)
    c.life_delay = <double*>start(world.life_delay)
    c.shields_max = <double*>start(world.shields_max)
    c.shield_regen = <double*>start(world.shield_regen)
    c.shield_delay = <double*>start(world.shield_delay)
    c.energy_max = <double*>start(world.energy_max)
    c.energy_regen = <double*>start(world.energy_regen)
    c.walled = <boolean*>start(world.walled)
    c.walls = <Point*>start(world.walls)
    c.arrays = (
        world.visible,
        world.alive,
        world.tag,
        world.type,
        world.owner,
        world.pos,
        world.heading,
        world.speed,
        world.life,
        world.shields,
        world.energy,
        world.build_progress,
        world.burrowed,
        world.hallucination,
        world.born_loop,
        world.expires,
        world.carrier,
        world.addon,
        world.home,
        world.barrier,
        world.damaged_loop,
        world.order_kind,
        world.order_ability,
        world.order_target,
        world.order_point,
        world.order_aimed,
        world.order_origin,
        world.cast_at,
        world.cast_begun,
        world.channels,
        world.bound,
        world.target,
        world.attacker,
        world.scan_loop,
        world.guard,
        world.returning,
        world.leashed,
        world.rank,
        world.weapon,
        world.reach,
        world.reach_min,
        world.slop,
        world.aim_cos,
        world.turreted,
        world.rolling,
        world.beaming,
        world.turret,
        world.weapon_toggles,
        world.spent,
        world.cooldown,
        world.windup,
        world.backswing,
        world.build_loops,
        world.self_made,
        world.site,
        world.worked,
        world.harvest,
        world.patch,
        world.occupant,
        world.load,
        world.contents,
        world.work_until,
        world.zone,
        world.zone_radius,
        world.help_loop,
        world.nav_point,
        world.nav_loop,
        world.nav_straight,
        world.nav_end,
        world.nav_goal,
        world.nav_best,
        world.nav_best_loop,
        world.blocked,
        world.detour,
        world.detour_end,
        world.aside,
        world.gap,
        world.toward,
        world.in_reach,
        world.intended,
        world.radius,
        world.separation,
        world.clearance,
        world.lightness,
        world.layer,
        world.layer_bits,
        world.plane_bits,
        world.step_max,
        world.step_gain,
        world.step_loss,
        world.glides,
        world.turn_cos,
        world.turn_sin,
        world.turn_still_cos,
        world.turn_still_sin,
        world.priority,
        world.ground_weapon,
        world.air_weapon,
        world.close_weapon,
        world.close_range,
        world.least_range,
        world.guns_walking,
        world.spares_structures,
        world.turret_cos,
        world.turret_sin,
        world.ground_scan,
        world.air_scan,
        world.acquires,
        world.threat_bits,
        world.defensive,
        world.flees,
        world.targetable,
        world.cloaked,
        world.sight,
        world.detects,
        world.can_act,
        world.can_attack,
        world.can_cast,
        world.casts,
        world.attack_rate,
        world.range_add,
        world.armor_add,
        world.shield_armor_add,
        world.ranged_add,
        world.melee_add,
        world.taken_factor,
        world.air_taken_factor,
        world.dealt_factor,
        world.bonus_bits,
        world.bonus_add,
        world.walks,
        world.looks_around,
        world.holds,
        world.needs_target,
        world.wants,
        world.goal,
        world.stop_at,
        world.work_rate,
        world.powered,
        world.creep_factor,
        world.life_max,
        world.life_regen,
        world.life_delay,
        world.shields_max,
        world.shield_regen,
        world.shield_delay,
        world.energy_max,
        world.energy_regen,
        world.walled,
        world.walls,
    )
    world.native = c
    return c
