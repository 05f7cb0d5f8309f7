# Written by khala_simulator.compiled.declare from world.columns.
"""The world's columns as pointers, for compiled systems."""
cimport numpy as cnp
from libc.string cimport memcpy

from khala_simulator.world.columns import COLUMNS

cnp.import_array()


cdef class Columns:
    def __reduce__(self):
        """Return what makes None: a copy of a world binds its own arrays."""
        return type(None), ()

    def clear(self, Py_ssize_t slot):
        """Make a slot unused."""
        cdef Py_ssize_t i, size
        cdef cnp.ndarray column, empty
        for i in range(len(NAMES)):
            column, empty = self.arrays[i + 1], EMPTY[i]
            size = cnp.PyArray_STRIDE(column, 0)
            memcpy(<char*>cnp.PyArray_DATA(column) + slot * size, cnp.PyArray_DATA(empty), size)


cdef tuple NAMES = (
    "alive",
    "tag",
    "type",
    "owner",
    "pos",
    "heading",
    "speed",
    "life",
    "shields",
    "energy",
    "build_progress",
    "burrowed",
    "hallucination",
    "born_loop",
    "expires",
    "carrier",
    "addon",
    "home",
    "barrier",
    "damaged_loop",
    "order_kind",
    "order_ability",
    "order_target",
    "order_point",
    "order_aimed",
    "order_origin",
    "cast_at",
    "cast_begun",
    "channels",
    "bound",
    "target",
    "attacker",
    "scan_loop",
    "guard",
    "returning",
    "leashed",
    "rank",
    "weapon",
    "reach",
    "reach_min",
    "slop",
    "aim_cos",
    "turreted",
    "rolling",
    "beaming",
    "turret",
    "weapon_toggles",
    "spent",
    "cooldown",
    "windup",
    "backswing",
    "build_loops",
    "self_made",
    "site",
    "worked",
    "harvest",
    "patch",
    "occupant",
    "load",
    "contents",
    "work_until",
    "zone",
    "zone_radius",
    "help_loop",
    "nav_point",
    "nav_loop",
    "nav_straight",
    "nav_end",
    "nav_goal",
    "nav_best",
    "nav_best_loop",
    "blocked",
    "detour",
    "detour_end",
    "aside",
    "gap",
    "toward",
    "in_reach",
    "intended",
    "radius",
    "separation",
    "clearance",
    "lightness",
    "layer",
    "layer_bits",
    "plane_bits",
    "step_max",
    "step_gain",
    "step_loss",
    "glides",
    "turn_cos",
    "turn_sin",
    "turn_still_cos",
    "turn_still_sin",
    "priority",
    "ground_weapon",
    "air_weapon",
    "close_weapon",
    "close_range",
    "least_range",
    "guns_walking",
    "spares_structures",
    "turret_cos",
    "turret_sin",
    "ground_scan",
    "air_scan",
    "acquires",
    "threat_bits",
    "defensive",
    "flees",
    "targetable",
    "cloaked",
    "sight",
    "detects",
    "can_act",
    "can_attack",
    "can_cast",
    "casts",
    "attack_rate",
    "range_add",
    "armor_add",
    "shield_armor_add",
    "ranged_add",
    "melee_add",
    "taken_factor",
    "air_taken_factor",
    "dealt_factor",
    "bonus_bits",
    "bonus_add",
    "walks",
    "looks_around",
    "holds",
    "needs_target",
    "wants",
    "goal",
    "stop_at",
    "work_rate",
    "powered",
    "creep_factor",
    "life_max",
    "life_regen",
    "life_delay",
    "shields_max",
    "shield_regen",
    "shield_delay",
    "energy_max",
    "energy_regen",
    "walled",
    "walls",
)
cdef tuple EMPTY = tuple(COLUMNS[name].make(1) for name in NAMES)


cdef Columns bound(object world):
    cdef Columns c = Columns.__new__(Columns)
    cdef tuple arrays = (world.visible, *[getattr(world, name) for name in NAMES])
    for array in arrays:
        if not cnp.PyArray_ISCARRAY(<cnp.ndarray>array):
            raise ValueError("a column must be contiguous and writable")
    c.capacity = world.capacity
    c.visible = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[0])
    c.alive = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[1])
    c.tag = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[2])
    c.type = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[3])
    c.owner = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[4])
    c.pos = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[5])
    c.heading = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[6])
    c.speed = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[7])
    c.life = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[8])
    c.shields = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[9])
    c.energy = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[10])
    c.build_progress = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[11])
    c.burrowed = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[12])
    c.hallucination = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[13])
    c.born_loop = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[14])
    c.expires = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[15])
    c.carrier = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[16])
    c.addon = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[17])
    c.home = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[18])
    c.barrier = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[19])
    c.damaged_loop = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[20])
    c.order_kind = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[21])
    c.order_ability = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[22])
    c.order_target = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[23])
    c.order_point = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[24])
    c.order_aimed = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[25])
    c.order_origin = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[26])
    c.cast_at = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[27])
    c.cast_begun = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[28])
    c.channels = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[29])
    c.bound = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[30])
    c.target = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[31])
    c.attacker = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[32])
    c.scan_loop = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[33])
    c.guard = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[34])
    c.returning = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[35])
    c.leashed = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[36])
    c.rank = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[37])
    c.weapon = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[38])
    c.reach = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[39])
    c.reach_min = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[40])
    c.slop = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[41])
    c.aim_cos = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[42])
    c.turreted = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[43])
    c.rolling = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[44])
    c.beaming = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[45])
    c.turret = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[46])
    c.weapon_toggles = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[47])
    c.spent = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[48])
    c.cooldown = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[49])
    c.windup = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[50])
    c.backswing = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[51])
    c.build_loops = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[52])
    c.self_made = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[53])
    c.site = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[54])
    c.worked = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[55])
    c.harvest = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[56])
    c.patch = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[57])
    c.occupant = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[58])
    c.load = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[59])
    c.contents = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[60])
    c.work_until = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[61])
    c.zone = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[62])
    c.zone_radius = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[63])
    c.help_loop = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[64])
    c.nav_point = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[65])
    c.nav_loop = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[66])
    c.nav_straight = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[67])
    c.nav_end = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[68])
    c.nav_goal = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[69])
    c.nav_best = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[70])
    c.nav_best_loop = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[71])
    c.blocked = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[72])
    c.detour = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[73])
    c.detour_end = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[74])
    c.aside = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[75])
    c.gap = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[76])
    c.toward = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[77])
    c.in_reach = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[78])
    c.intended = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[79])
    c.radius = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[80])
    c.separation = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[81])
    c.clearance = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[82])
    c.lightness = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[83])
    c.layer = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[84])
    c.layer_bits = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[85])
    c.plane_bits = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[86])
    c.step_max = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[87])
    c.step_gain = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[88])
    c.step_loss = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[89])
    c.glides = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[90])
    c.turn_cos = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[91])
    c.turn_sin = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[92])
    c.turn_still_cos = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[93])
    c.turn_still_sin = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[94])
    c.priority = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[95])
    c.ground_weapon = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[96])
    c.air_weapon = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[97])
    c.close_weapon = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[98])
    c.close_range = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[99])
    c.least_range = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[100])
    c.guns_walking = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[101])
    c.spares_structures = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[102])
    c.turret_cos = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[103])
    c.turret_sin = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[104])
    c.ground_scan = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[105])
    c.air_scan = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[106])
    c.acquires = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[107])
    c.threat_bits = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[108])
    c.defensive = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[109])
    c.flees = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[110])
    c.targetable = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[111])
    c.cloaked = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[112])
    c.sight = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[113])
    c.detects = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[114])
    c.can_act = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[115])
    c.can_attack = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[116])
    c.can_cast = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[117])
    c.casts = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[118])
    c.attack_rate = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[119])
    c.range_add = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[120])
    c.armor_add = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[121])
    c.shield_armor_add = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[122])
    c.ranged_add = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[123])
    c.melee_add = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[124])
    c.taken_factor = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[125])
    c.air_taken_factor = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[126])
    c.dealt_factor = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[127])
    c.bonus_bits = <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>arrays[128])
    c.bonus_add = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[129])
    c.walks = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[130])
    c.looks_around = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[131])
    c.holds = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[132])
    c.needs_target = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[133])
    c.wants = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[134])
    c.goal = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[135])
    c.stop_at = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[136])
    c.work_rate = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[137])
    c.powered = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[138])
    c.creep_factor = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[139])
    c.life_max = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[140])
    c.life_regen = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[141])
    c.life_delay = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[142])
    c.shields_max = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[143])
    c.shield_regen = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[144])
    c.shield_delay = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[145])
    c.energy_max = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[146])
    c.energy_regen = <double*>cnp.PyArray_DATA(<cnp.ndarray>arrays[147])
    c.walled = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[148])
    c.walls = <Point*>cnp.PyArray_DATA(<cnp.ndarray>arrays[149])
    c.arrays = arrays
    world.native = c
    return c
