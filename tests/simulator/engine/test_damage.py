from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_simulator.abilities import commands
from khala_simulator.combat import damage
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.stats import ATTRIBUTES, Stats, bit_set

if TYPE_CHECKING:
    from collections.abc import Callable

# attacker, weapon damage, bonus, victim, and by hand: what one hit takes from shields and from life
PER_HIT = [
    # 13 against light: all from the shields, which have no armor
    ("Stalker", "Zealot", 100, 50, 13, 0),
    # no shields left: 13 - 1 armor
    ("Stalker", "Zealot", 100, 0, 0, 12),
    # 13 + 5 against armored
    ("Stalker", "Stalker", 80, 80, 18, 0),
    ("Stalker", "Stalker", 80, 0, 0, 17),
    # the last 3 shields hold 3 of 13, the other 10 meet 1 armor
    ("Stalker", "Zealot", 100, 3, 3, 9),
    # 8 - 1 and 8 - 2
    ("Zealot", "Stalker", 80, 0, 0, 7),
    ("Zealot", "SpineCrawler", 300, 0, 0, 6),
    ("Zealot", "Stalker", 80, 80, 8, 0),
    ("Zealot", "Zergling", 35, 0, 0, 8),
    # 25 + 5 against armored; shields first
    ("SpineCrawler", "Stalker", 80, 80, 30, 0),
    ("SpineCrawler", "Stalker", 80, 0, 0, 29),
    ("SpineCrawler", "Zealot", 100, 0, 0, 24),
    # 10 + 5 against light, no armor
    ("Colossus", "Zergling", 35, 0, 0, 15),
    ("Colossus", "Zealot", 100, 0, 0, 14),
    ("Colossus", "Stalker", 80, 80, 10, 0),
    ("Zergling", "Colossus", 200, 0, 0, 4),
    ("Zergling", "Colossus", 200, 150, 5, 0),
    ("Broodling", "Ultralisk", 500, 0, 0, 2),
    ("Immortal", "Stalker", 80, 80, 50, 0),
    ("Marine", "Zealot", 100, 0, 0, 5),
]


@pytest.mark.parametrize(("attacker", "victim", "life", "shields", "from_shields", "from_life"), PER_HIT)
def test_one_hit_takes_what_the_tables_say(
    field: Any, attacker: str, victim: str, life: float, shields: float, from_shields: float, from_life: float
) -> None:
    world = field.world
    a, v = field.put(attacker, 1, 10, 16), field.put(victim, 2, 11, 16)
    world.life[v], world.shields[v] = life, shields
    weapon = world.catalog.unit(attacker).weapon_against("ground")
    hit = world.stats.damage[1][weapon.row][0]
    damage.strike(world, a, 1, v, hit)
    assert shields - world.shields[v] == pytest.approx(from_shields)
    assert life - world.life[v] == pytest.approx(from_life)


@pytest.mark.parametrize(("level", "from_shields"), [(0, 13), (1, 12), (2, 11), (3, 10)])
def test_each_level_of_plasma_shields_takes_one_from_what_shields_lose(
    field: Any, level: int, from_shields: float
) -> None:
    world = field.world
    a, v = field.put("Stalker", 1, 10, 16), field.put("Zealot", 2, 11, 16)
    for number in range(1, level + 1):
        commands.grant_upgrade(world, 2, world.catalog.upgrade(f"ProtossShieldsLevel{number}").id)
    weapon = world.catalog.unit("Stalker").weapon_against("ground")
    damage.strike(world, a, 1, v, world.stats.damage[1][weapon.row][0])
    assert world.shields[v] == 50 - from_shields
    assert world.life[v] == 100


def test_a_hit_takes_at_least_a_half(field: Any) -> None:
    world = field.world
    a, v = field.put("Zealot", 1, 10, 16), field.put("Ultralisk", 2, 11, 16)
    world.stats.armor[2, world.type[v]] = 50
    before = world.life[v]
    damage.strike(world, a, 1, v, world.stats.damage[1][world.catalog.unit("Zealot").weapons[0].row][0])
    assert before - world.life[v] == 0.5


@pytest.mark.parametrize(
    ("upgrade", "name", "against", "by_level"),
    [
        ("ProtossGroundWeapons", "Zealot", (), [8, 9, 10, 11]),
        ("ProtossGroundWeapons", "Stalker", (), [13, 14, 15, 16]),
        ("ProtossGroundWeapons", "Stalker", ("armored",), [18, 20, 22, 24]),
        ("ProtossGroundWeapons", "Colossus", ("light",), [15, 17, 19, 21]),
        ("ProtossGroundWeapons", "Immortal", ("armored",), [50, 55, 60, 65]),
        ("ZergMeleeWeapons", "Zergling", (), [5, 6, 7, 8]),
        ("ZergMissileWeapons", "Hydralisk", (), [12, 13, 14, 15]),
        ("TerranInfantryWeapons", "Marine", (), [6, 7, 8, 9]),
        ("TerranInfantryWeapons", "Marauder", ("armored",), [20, 22, 24, 26]),
    ],
)
def test_weapon_upgrades_add_their_step_per_level(
    upgrade: str, name: str, against: tuple[str, ...], by_level: list[float]
) -> None:
    catalog = load_catalog()
    stats = Stats(catalog, 2)
    weapon = catalog.unit(name).weapon_against("ground")
    assert weapon is not None
    names = [u.name for u in catalog.upgrades]
    for level, expected in enumerate(by_level):
        levels = [f"{upgrade}Level{i}" for i in range(1, level + 1)]
        assert all(n in names for n in levels)
        stats.apply(1, [catalog.upgrade(n).id for n in levels])
        row = next(d for d in stats.damage[1][weapon.row] if d.hit.damage == weapon.shown_damage)
        assert damage.amount_against(row, bit_set(against, ATTRIBUTES)) == expected


def test_armor_upgrades_count_for_units_that_already_stand_there(field: Any) -> None:
    world = field.world
    attacker, victim = field.put("Zealot", 1, 10, 16), field.put("Zergling", 2, 11, 16)
    commands.grant_upgrade(world, 2, world.catalog.upgrade("ZergGroundArmorsLevel1").id)
    row = world.catalog.unit("Zealot").weapons[0].row
    damage.strike(world, attacker, 1, victim, world.stats.damage[1][row][0])
    assert world.life[victim] == 35 - (8 - 1)


@given(
    life=st.floats(0.5, 500),
    shields=st.floats(0, 500),
    attacker=st.sampled_from(["Zealot", "Stalker", "Colossus", "Marine", "Zergling", "SpineCrawler"]),
    victim=st.sampled_from(["Zealot", "Stalker", "Colossus", "Zergling", "Ultralisk"]),
)
def test_damage_is_never_lost_or_made_up(
    make_field: Callable[..., Any], life: float, shields: float, attacker: str, victim: str
) -> None:
    field = make_field()
    world = field.world
    a, v = field.put(attacker, 1, 10, 16), field.put(victim, 2, 11, 16)
    world.life[v], world.shields[v] = life, shields
    hit = world.stats.damage[1][world.catalog.unit(attacker).weapon_against("ground").row][0]
    damage.strike(world, a, 1, v, hit)
    lost_life, lost_shields = life - world.life[v], shields - world.shields[v]
    assert 0 <= lost_life <= life
    assert 0 <= lost_shields <= shields
    most = damage.amount_against(hit, int(world.stats.attribute_bits[world.type[v]]))
    assert 0 < lost_life + lost_shields <= most + 0.5  # the rest that shields leave is at least a half, too
    taken, dealt = world.players[2].score.damage_taken, world.players[1].score.damage_dealt
    assert (taken.life, taken.shields) == pytest.approx((lost_life, lost_shields))
    assert (dealt.life, dealt.shields) == pytest.approx((lost_life, lost_shields))


def test_a_colossus_burns_a_line_across_its_shot(field: Any) -> None:
    """Both beams sweep 1.25 to each side of the target; units in reach burn once per beam, light units for 15."""
    world = field.world
    colossus = field.put("Colossus", 1, 10, 16)
    target = field.put("Zergling", 2, 16, 16)
    beside = [field.put("Zergling", 2, 16, 16 + dy) for dy in (1.2, -1.2)]
    outside = field.put("Zergling", 2, 16, 18.2)  # 1.25 + 0.15 + its radius of 0.375 is 1.775
    behind = field.put("Zergling", 2, 18, 16)
    for slot in (target, *beside, outside, behind):
        world.step_max[slot] = 0.0
        world.acquires[slot] = False
    commands.attack_unit(world, [colossus], world.tag_of(target))
    deaths_by_loop = {}
    for loop in field.loops(24):
        deaths_by_loop[loop] = len(world.deaths)
    # 2 x 15 is less than 35 life: no unit dies of one shot, every unit on the line burns twice
    assert [35 - world.life[s] for s in beside] == pytest.approx([30, 30], abs=0.5)
    assert 35 - world.life[target] == pytest.approx(30, abs=0.5)
    assert world.life[outside] == world.life[behind] == 35
    assert set(deaths_by_loop.values()) == {0}


def test_a_colossus_does_not_burn_its_friends(field: Any) -> None:
    world = field.world
    colossus = field.put("Colossus", 1, 10, 16)
    target, friend = field.put("SpineCrawler", 2, 16, 16), field.put("Zealot", 1, 16, 17)
    commands.hold(world, [friend])
    commands.attack_unit(world, [colossus], world.tag_of(target))
    world.acquires[friend] = world.acquires[target] = False
    field.play(40)
    assert field.vitals(friend) == 150
    assert world.life[target] < 300
