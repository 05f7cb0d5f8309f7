"""Blink, Shadow Stride, Charge and Phase Shift, against the numbers of both game versions."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
BLINK, STRIDE, CHARGE, SHIFT, CANCEL_SHIFT, CANCEL_SHADE = 1442, 2700, 1819, 2544, 2594, 2596
BLINKS = {"Stalker": (BLINK, "BlinkTech", 160), "DarkTemplar": (STRIDE, "DarkTemplarBlinkUpgrade", 320)}


def place(field: Any, slot: int) -> tuple[float, float]:
    x, y = field.world.pos[slot].tolist()
    return x, y


def named(field: Any, name: str) -> list[int]:
    return [s for s in field.world.live.tolist() if field.world.unit_type(s).name == name]


# Blink and Shadow Stride ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", BLINKS)
@pytest.mark.parametrize(("aim", "landing"), [((12.0, 8.0), (12.0, 8.0)), ((30.0, 8.0), (16.0, 8.0)),
                                              ((8.0, 1.0), (8.0, 1.0))])  # fmt: skip
def test_a_blink_ends_at_its_aim_or_8_towards_it(
    make_field: Any, version: str, name: str, aim: tuple[float, float], landing: tuple[float, float]
) -> None:
    field = make_field(version=version)
    number, upgrade, _ = BLINKS[name]
    slot = field.put(name, 1, 8.0, 8.0)
    field.research(1, upgrade)
    assert field.order(slot, number, point=aim)
    field.play(1)
    assert place(field, slot) == pytest.approx(landing)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", BLINKS)
def test_a_blink_needs_its_research_and_cools_down(make_field: Any, version: str, name: str) -> None:
    field = make_field(version=version)
    number, upgrade, cooldown = BLINKS[name]
    slot = field.put(name, 1, 8.0, 8.0)
    assert field.why_not(slot, number, point=(12.0, 8.0)) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.research(1, upgrade)
    field.order(slot, number, point=(12.0, 8.0))
    field.play(1)
    field.play(cooldown - 1)
    assert field.why_not(slot, number, point=(8.0, 8.0)) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(slot, number, point=(8.0, 8.0)) is ActionResult.SUCCESS


def test_a_blink_onto_a_body_or_a_wall_ends_beside_it(field: Any) -> None:
    slot = field.put("Stalker", 1, 8.0, 8.0)
    field.research(1, "BlinkTech")
    body = field.put("Immortal", 1, 14.0, 8.0)
    field.order(slot, BLINK, point=(14.0, 8.0))
    field.play(1)
    apart = field.world.separation[slot] + field.world.separation[body]
    assert apart - 0.02 <= math.dist(place(field, slot), place(field, body)) <= apart + 0.5


def test_a_point_may_have_named_coordinates(field: Any) -> None:
    class WorldPoint(NamedTuple):
        x: float
        y: float

    slot = field.put("Stalker", 1, 8.0, 8.0)
    field.research(1, "BlinkTech")
    assert field.order(slot, BLINK, point=WorldPoint(12.0, 8.0))
    field.play(1)
    assert place(field, slot) == (12.0, 8.0)


def test_nobody_blinks_where_his_player_does_not_see(make_field: Any) -> None:
    field = make_field(fog=True)
    slot = field.put("Stalker", 1, 8.0, 8.0)
    field.research(1, "BlinkTech")
    field.play(4)
    field.world.visibility[1, :, 12:] = 1
    assert field.order(slot, BLINK, point=(15.5, 8.0))
    field.play(1)
    x, y = place(field, slot)
    assert x < 12.0
    assert x == pytest.approx(11.75, abs=0.3)
    assert y == pytest.approx(8.0, abs=0.3)


def test_nobody_blinks_out_of_a_fungal_growth(field: Any) -> None:
    slot = field.put("Stalker", 1, 8.0, 8.0)
    field.research(1, "BlinkTech")
    buffs.apply(field.world, slot, "FungalGrowth")
    assert field.why_not(slot, BLINK, point=(12.0, 8.0)) is ActionResult.YOU_CANT_ISSUE_COMMANDS_TO_THAT_UNIT


def test_what_waits_behind_a_blink_is_done_after_it(field: Any) -> None:
    slot = field.put("Stalker", 1, 8.0, 8.0)
    field.research(1, "BlinkTech")
    field.order(slot, BLINK, point=(12.0, 8.0))
    commands.move(field.world, [slot], (12.0, 12.0), queue=True)
    field.play(60)
    assert place(field, slot) == pytest.approx((12.0, 12.0))


@pytest.mark.parametrize(("version", "delay"), [("4.10", 0), ("5.0.13", 16)])
def test_after_a_shadow_stride_there_is_no_attack_for_a_second_since_5_0_13(
    make_field: Any, version: str, delay: int
) -> None:
    field = make_field(version=version)
    slot = field.put("DarkTemplar", 1, 8.0, 8.0)
    field.research(1, "DarkTemplarBlinkUpgrade")
    field.order(slot, STRIDE, point=(12.0, 8.0))
    unable = sum(not field.world.can_attack[slot] for _ in field.loops(40))
    assert unable == delay


def test_dark_templars_are_cloaked_for_good(field: Any) -> None:
    slot = field.put("DarkTemplar", 1, 8.0, 8.0)
    field.play(200)
    assert field.world.cloaked[slot]
    assert not field.world.visible[2, slot]


# Charge ---------------------------------------------------------------------------------------------------------------


def charger(field: Any, x: float) -> tuple[int, int]:
    """Return a Zealot that attacks a big enemy whose edge is ``x`` from its own."""
    zealot = field.put("Zealot", 1, 8.0, 8.0)
    enemy = field.put("Ultralisk", 2, 8.0 + 0.5 + x + 1.0, 8.0)
    field.world.looks_around[enemy] = False
    field.world.life[enemy] = 400.0
    field.world.radius[enemy] = 1.0
    commands.hold(field.world, [enemy])
    commands.attack_unit(field.world, [zealot], field.world.tag_of(enemy))
    return zealot, enemy


@pytest.mark.parametrize("version", VERSIONS)
def test_a_zealot_charges_by_itself_below_4_at_2_2_times_its_speed(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    field.research(1, "Charge")
    zealot, _ = charger(field, 8.0)
    usual = float(field.world.step_max[zealot])
    assert usual * 16 == pytest.approx(2.25 + {"4.10": 0.7031, "5.0.13": 1.125}[version])
    began = None
    steps = []
    for _ in field.loops(60):
        if buffs.has(field.world, zealot, "Charging"):
            began = began if began is not None else float(field.world.gap[zealot])
            steps.append(float(field.world.step_max[zealot]))
    assert began is not None
    assert 4.0 - 5 * usual <= began < 4.0
    assert steps[0] == pytest.approx(2.2 * usual)
    assert not buffs.has(field.world, zealot, "Charging")


@pytest.mark.parametrize(("version", "impact"), [("4.10", 8.0), ("5.0.13", 0.0)])
def test_the_first_blow_of_a_charge_deals_8_more_past_armor_in_4_10(
    make_field: Any, version: str, impact: float
) -> None:
    taken = []
    for upgrades in ((), ("Charge",)):
        field = make_field(version=version)
        field.research(1, *upgrades)
        _, enemy = charger(field, 3.0)
        for _ in field.loops(100):
            if field.world.life[enemy] < 399.0:
                break
        taken.append(400.0 - float(field.world.life[enemy]))
    assert taken[1] - taken[0] == pytest.approx(impact, abs=0.4)  # it regains life on the way


def test_a_zealot_charges_once_in_ten_seconds_and_not_without_the_research(field: Any) -> None:
    zealot, _ = charger(field, 3.0)
    field.play(4)
    assert not buffs.has(field.world, zealot, "Charging")
    field.research(1, "Charge")
    field.play(4)
    assert buffs.has(field.world, zealot, "Charging")
    assert field.world.timers[zealot]["Charge"] == pytest.approx(field.world.loop + 160, abs=4)


def test_a_charge_that_reaches_nobody_is_over_after_56_loops(field: Any) -> None:
    slot = field.put("Zealot", 1, 8.0, 8.0)
    field.world.catalog.buff("Charging")
    buffs.apply(field.world, slot, "Charging")
    counted = sum(buffs.has(field.world, slot, "Charging") for _ in field.loops(80))
    assert counted == 55


@pytest.mark.parametrize(("away", "why"), [(3.9, ActionResult.SUCCESS), (4.1, ActionResult.TARGET_IS_OUT_OF_RANGE),
                                           (0.5, ActionResult.TARGET_IS_TOO_CLOSE)])  # fmt: skip
def test_a_zealot_may_be_told_to_charge_whom_it_can_reach(field: Any, away: float, why: ActionResult) -> None:
    field.research(1, "Charge")
    zealot, enemy = charger(field, away)
    assert field.why_not(zealot, CHARGE, enemy) is why


# Phase Shift ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_an_adept_stands_after_160_loops_where_its_shade_has_gone(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    adept = field.put("Adept", 1, 8.0, 8.0)
    field.world.life[adept] = 33.0
    commands.move(field.world, [adept], (8.0, 20.0))
    assert field.order(adept, SHIFT, point=(20.0, 8.0))
    (shade,) = named(field, "AdeptPhaseShift")
    assert field.world.speed[shade] == 0.0
    before = place(field, adept)
    field.play(20)
    assert math.dist(place(field, shade), before) == pytest.approx(20 * 4 / 16, abs=0.3)
    assert field.world.pos[adept, 1] > 8.5  # it goes on walking meanwhile
    field.play(139)
    assert named(field, "AdeptPhaseShift") == [shade]
    field.play(1)
    assert not named(field, "AdeptPhaseShift")
    assert place(field, adept) == pytest.approx((20.0, 8.0), abs=0.1)
    assert field.world.life[adept] == 33.0
    assert field.world.players[1].score.lost_units == 0
    assert not field.world.area_effects


def test_a_shade_walks_where_it_is_told_and_can_neither_fight_nor_be_hurt(field: Any) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    enemy = field.put("Marine", 2, 16.0, 8.0)
    field.order(adept, SHIFT, point=(20.0, 8.0))
    (shade,) = named(field, "AdeptPhaseShift")
    field.play(8)
    assert commands.move(field.world, [shade], (8.0, 20.0)) == [shade]
    assert not commands.attack_unit(field.world, [shade], field.world.tag_of(enemy))
    assert not field.world.targetable[shade]
    field.play(152)
    assert place(field, adept) == pytest.approx((8.0, 20.0), abs=0.1)


@pytest.mark.parametrize("told", ["adept", "shade"])
def test_a_shift_can_be_given_up_by_either(field: Any, told: str) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    field.order(adept, SHIFT, point=(20.0, 8.0))
    (shade,) = named(field, "AdeptPhaseShift")
    field.play(30)
    assert field.order(*((adept, CANCEL_SHIFT) if told == "adept" else (shade, CANCEL_SHADE)))
    field.play(2)
    assert not named(field, "AdeptPhaseShift")
    field.play(160)
    assert place(field, adept) == pytest.approx((8.0, 8.0))


def test_there_is_nothing_to_give_up_without_a_shift(field: Any) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    assert field.why_not(adept, CANCEL_SHIFT) is ActionResult.TECH_REQUIREMENTS_NOT_MET


def test_a_shade_goes_with_its_adept(field: Any) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    field.order(adept, SHIFT, point=(20.0, 8.0))
    field.world.life[adept] = 0.0
    field.play(3)
    assert field.world.live.size == 0


def test_a_phase_shift_cools_down_for_16_seconds(field: Any) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    field.order(adept, SHIFT, point=(20.0, 8.0))
    field.play(255)
    assert field.why_not(adept, SHIFT, point=(8.0, 8.0)) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(adept, SHIFT, point=(8.0, 8.0)) is ActionResult.SUCCESS


def test_an_adept_escapes_from_a_stasis_and_takes_over_its_shade_s_orders(field: Any) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    field.order(adept, SHIFT, point=(20.0, 8.0))
    (shade,) = named(field, "AdeptPhaseShift")
    commands.move(field.world, [shade], (8.0, 30.0))
    commands.move(field.world, [shade], (30.0, 30.0), queue=True)
    field.play(5)
    buffs.apply(field.world, adept, "OracleStasisTrapTarget")
    field.play(155)
    assert not buffs.has(field.world, adept, "OracleStasisTrapTarget")
    assert [order.point for order in field.world.orders_of(adept)] == [(30.0, 30.0)]


def test_glaives_let_adepts_attack_faster(field: Any) -> None:
    adept = field.put("Adept", 1, 8.0, 8.0)
    row = int(field.world.ground_weapon[adept])
    before = field.world.stats.period[1, row]
    field.research(1, "AdeptPiercingAttack")
    assert field.world.stats.period[1, row] == pytest.approx(before / 1.45)
