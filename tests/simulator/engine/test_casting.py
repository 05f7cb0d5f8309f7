"""What is the same for every ability: who may use it, the way there, cost, cooldown, preparation and channels."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.abilities.registry import SKILLS
from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import buffs, lifecycle, traits
from khala_simulator.tables.abilities import AbilityAim, Filter, Need
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.world import World

SIEGE_MODE, UNSIEGE = 388, 390


class Trick:
    """A skill that only records its calls."""

    def __init__(self, *, lasts: int = 0) -> None:
        self.effects: list[int] = []
        self.held = 0
        self.ended: list[int] = []
        self.lasts = lasts
        self.refusal = ActionResult.SUCCESS

    def skill(self) -> Skill:
        hold = self.hold if self.lasts else None
        return Skill(self.effect, refuse=lambda *_: self.refusal, hold=hold, end=self.end)

    def effect(self, world: World, cast: Cast) -> None:
        self.effects.append(world.loop)

    def hold(self, world: World, cast: Cast) -> bool:
        self.held += 1
        return self.held < self.lasts

    def end(self, world: World, cast: Cast) -> None:
        self.ended.append(world.loop)


@pytest.fixture
def trick(monkeypatch: pytest.MonkeyPatch) -> Trick:
    trick = Trick()
    monkeypatch.setitem(SKILLS, "trick", trick.skill())
    return trick


def ability(field: Any, **changes: Any) -> Ability:
    """Return an ability like no other, known to the field's own catalog."""
    made: Ability = dataclasses.replace(field.world.catalog.abilities[0], id=1, effect="trick", link="Trick", **changes)
    field.world.catalog = dataclasses.replace(
        field.world.catalog, ability_of_id={**field.world.catalog.ability_of_id, 1: made}
    )
    return made


def caster(field: Any, x: float = 10.0, y: float = 16.0) -> int:
    slot: int = field.put("HighTemplar", 1, x, y)
    field.world.energy[slot] = 100.0
    return slot


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"energy": 101.0}, ActionResult.NOT_ENOUGH_ENERGY),
        ({"energy": 100.0}, ActionResult.SUCCESS),
        ({"life": 40.0}, ActionResult.NOT_ENOUGH_LIFE),
        ({"minerals": 1}, ActionResult.NOT_ENOUGH_MINERALS),
        ({"vespene": 1}, ActionResult.NOT_ENOUGH_VESPENE),
        ({"requires": Need("unit", "Nexus", "done")}, ActionResult.TECH_REQUIREMENTS_NOT_MET),
        ({"requires": Need("upgrade", "PsiStormTech", "done")}, ActionResult.TECH_REQUIREMENTS_NOT_MET),
        ({"shown_if": Need("behavior", "PsiStorm", "done")}, ActionResult.TECH_REQUIREMENTS_NOT_MET),
        ({"requires": Need("not", parts=(Need("unit", "Nexus", "done"),))}, ActionResult.SUCCESS),
    ],
)
@pytest.mark.usefixtures("trick")
def test_what_an_ability_needs(field: Any, changes: dict[str, Any], why: ActionResult) -> None:
    slot = caster(field)
    assert casting.refusal(field.world, slot, ability(field, **changes)) is why


@pytest.mark.parametrize("cheat", ["free", "tech_tree"])
@pytest.mark.usefixtures("trick")
def test_a_debug_state_takes_a_need_away(field: Any, cheat: str) -> None:
    lacking: dict[str, dict[str, Any]] = {
        "free": {"energy": 999.0},
        "tech_tree": {"requires": Need("unit", "Nexus", "done")},
    }
    slot, made = caster(field), ability(field, **lacking[cheat])
    assert casting.refusal(field.world, slot, made) is not ActionResult.SUCCESS
    field.world.players[1].cheats.append(cheat)
    assert casting.refusal(field.world, slot, made) is ActionResult.SUCCESS


@pytest.mark.parametrize(
    ("victim", "owner", "words", "why"),
    [
        ("Marine", 2, Filter(("Biological",)), ActionResult.SUCCESS),
        ("Stalker", 2, Filter(("Biological",)), ActionResult.MUST_TARGET_BIOLOGICAL_UNITS),
        ("Marine", 1, Filter((), ("Player",)), ActionResult.CANT_TARGET_YOUR_OWN_UNITS),
        ("Marine", 2, Filter((), ("Enemy",)), ActionResult.CANT_TARGET_ENEMY_UNITS),
        ("Colossus", 2, Filter((), ("Massive",)), ActionResult.CANT_TARGET_MASSIVE_UNITS),
        ("Mutalisk", 2, Filter(("Ground",)), ActionResult.MUST_TARGET_GROUND_UNITS),
        ("Marine", 2, Filter(("Air",)), ActionResult.MUST_TARGET_AIR_UNITS),
        ("Nexus", 2, Filter((), ("Structure",)), ActionResult.CANT_TARGET_STRUCTURES),
        ("MineralField", 0, Filter((), ("Neutral",)), ActionResult.CANT_TARGET_NEUTRAL_UNITS),
        ("Zealot", 2, Filter(("CanHaveEnergy",)), ActionResult.MUST_TARGET_ENERGY_CAPABLE_UNITS),
    ],
)
@pytest.mark.usefixtures("trick")
def test_whom_an_ability_may_be_aimed_at(field: Any, victim: str, owner: int, words: Filter, why: ActionResult) -> None:
    slot, target = caster(field), field.put(victim, owner, 12, 16)
    made = ability(field, filters=words, aim=AbilityAim.UNIT, range=9.0)
    assert casting.aim_refusal(field.world, Cast(slot, made, target)) is why


@pytest.mark.parametrize(
    ("aim", "why"),
    [
        (AbilityAim.UNIT, ActionResult.MUST_TARGET_UNIT),
        (AbilityAim.POINT | AbilityAim.UNIT, ActionResult.MUST_TARGET_VISIBLE_LOCATION),
        (AbilityAim.POINT | AbilityAim.NONE, ActionResult.SUCCESS),
    ],
)
def test_an_ability_that_must_be_aimed_is_not_used_on_nothing(
    field: Any, trick: Trick, aim: AbilityAim, why: ActionResult
) -> None:
    slot = caster(field)
    made = ability(field, aim=aim, range=9.0)
    assert casting.aim_refusal(field.world, Cast(slot, made)) is why
    used = casting.use(field.world, [slot], made)
    field.play(5)
    assert bool(used) is bool(trick.effects) is (why is ActionResult.SUCCESS)


@pytest.mark.parametrize("slot", [NOBODY, 10_000])
def test_traits_of_no_unit_are_an_error(field: Any, slot: int) -> None:
    with pytest.raises(IndexError, match=str(slot)):
        traits.refresh(field.world, slot)


def test_a_caster_walks_into_range_and_pays_when_it_takes_effect(field: Any, trick: Trick) -> None:
    slot, made = caster(field), ability(field, aim=AbilityAim.POINT, range=4.0, energy=60.0, cooldown_loops=32.0)
    assert casting.use(field.world, [slot], made, point=(20.0, 16.0)) == [slot]
    world = field.world
    before = 0.0
    while not trick.effects:
        before = float(world.energy[slot])
        field.play(1)
    assert before >= 100.0
    assert world.energy[slot] == pytest.approx(before - 60.0, abs=0.1)
    assert abs(20.0 - float(world.pos[slot, 0])) <= 4.0 + float(world.radius[slot]) + 1e-6
    assert casting.cooldown_left(world, slot, made) == 32.0
    assert not world.casts[slot]


def test_preparation_delays_the_effect_and_a_new_order_drops_it(field: Any, trick: Trick) -> None:
    slot, made = caster(field), ability(field, aim=AbilityAim.POINT, range=9.0, prep_loops=20.0)
    casting.use(field.world, [slot], made, point=(14.0, 16.0))
    field.play(20)
    assert not trick.effects
    field.play(2)
    assert len(trick.effects) == 1
    casting.use(field.world, [slot], made, point=(14.0, 16.0))
    field.play(5)
    commands.stop(field.world, [slot])
    field.play(40)
    assert len(trick.effects) == 1


@pytest.mark.parametrize("dropped", [False, True])
def test_a_channel_ends_once_in_time_or_by_another_order(
    field: Any, monkeypatch: pytest.MonkeyPatch, *, dropped: bool
) -> None:
    trick = Trick(lasts=10)
    monkeypatch.setitem(SKILLS, "trick", trick.skill())
    slot, made = caster(field), ability(field, aim=AbilityAim.POINT, range=9.0)
    casting.use(field.world, [slot], made, point=(14.0, 16.0))
    field.play(5)
    assert field.world.channels[slot]
    if dropped:
        commands.move(field.world, [slot], (5.0, 5.0))
    field.play(20)
    assert len(trick.ended) == 1
    assert trick.held == (10 if not dropped else 4)
    assert not field.world.channelling


def test_a_transient_ability_leaves_the_orders_alone(field: Any, trick: Trick) -> None:
    slot, made = caster(field), ability(field, aim=AbilityAim.NONE, transient=True)
    commands.move(field.world, [slot], (20.0, 16.0))
    casting.use(field.world, [slot], made)
    assert trick.effects == [0]
    assert field.world.walks[slot]


def test_only_the_nearest_of_several_uses_a_solo_ability(field: Any, trick: Trick) -> None:
    near, far = caster(field, 10.0), caster(field, 8.0)
    made = ability(field, aim=AbilityAim.POINT, range=20.0, solo=True)
    assert casting.use(field.world, [far, near], made, point=(16.0, 16.0)) == [near]
    assert casting.use(field.world, [far, near], made, point=(16.0, 16.0)) == [far], "the other one is busy"
    field.play(2)
    assert len(trick.effects) == 2


def test_an_ability_that_fails_on_the_way_is_told_to_the_player(field: Any, trick: Trick) -> None:
    slot, made = caster(field), ability(field, aim=AbilityAim.POINT, range=2.0, energy=60.0)
    casting.use(field.world, [slot], made, point=(16.0, 16.0))
    field.play(5)
    field.world.energy[slot] = 0.0
    field.play(60)
    assert not trick.effects
    assert [(m.player, m.ability, m.refusal) for m in field.world.mishaps] == [(1, 1, ActionResult.NOT_ENOUGH_ENERGY)]


def test_a_cast_waits_in_the_queue(field: Any, trick: Trick) -> None:
    slot, made = caster(field), ability(field, aim=AbilityAim.POINT, range=2.0)
    commands.move(field.world, [slot], (12.0, 16.0))
    casting.use(field.world, [slot], made, point=(13.0, 16.0), queue=True)
    commands.move(field.world, [slot], (12.0, 18.0), queue=True)
    field.play(60)
    assert len(trick.effects) == 1
    assert field.world.pos[slot].tolist() == pytest.approx([12.0, 18.0], abs=0.1)


def test_a_morph_takes_its_time_and_makes_the_unit_another_type(field: Any) -> None:
    world = field.world
    slot = field.put("SiegeTank", 1, 10, 16)
    world.life[slot] = world.life_max[slot] / 2
    tag, morph = world.tag_of(slot), world.catalog.ability(SIEGE_MODE)
    casting.use(world, [slot], morph)
    loops = next(loop for loop in field.loops(200) if world.unit_type(slot).name == "SiegeTankSieged")
    assert morph.loops <= loops <= morph.loops + morph.random_loops + 2
    assert world.tag_of(slot) == tag
    assert world.life[slot] == pytest.approx(world.life_max[slot] / 2)
    assert [a.id for a in world.catalog.abilities_of(int(world.type[slot]))].count(UNSIEGE) == 1


# buffs ----------------------------------------------------------------------------------------------------------------


def test_a_buff_changes_numbers_for_its_time_and_no_longer(field: Any) -> None:
    world, slot = field.world, field.put("Marine", 1, 10, 16)
    speed, stim = float(world.step_max[slot]), field.world.catalog.buff("Stimpack")
    buffs.apply(world, slot, "Stimpack")
    assert world.step_max[slot] == pytest.approx(speed * stim.speed)
    assert world.attack_rate[slot] == stim.attack_rate
    field.play(int(stim.loops) - 1)
    assert buffs.has(world, slot, "Stimpack")
    field.play(1)
    assert not buffs.has(world, slot, "Stimpack")
    assert world.step_max[slot] == pytest.approx(speed)


def test_a_buff_laid_on_again_begins_its_time_anew_and_counts_once(field: Any) -> None:
    world, slot = field.world, field.put("Marine", 1, 10, 16)
    buffs.apply(world, slot, "Stimpack")
    field.play(100)
    buffs.apply(world, slot, "Stimpack")
    assert len(world.buffs) == 1
    assert world.buffs.rows[0]["end"] == world.loop + world.catalog.buff("Stimpack").loops


@pytest.mark.parametrize("gone", ["bearer", "caster"])
def test_a_buff_goes_with_its_bearer_and_outlives_its_caster(field: Any, gone: str) -> None:
    world, bearer, source = field.world, field.put("Marine", 1, 10, 16), field.put("Ghost", 2, 12, 16)
    buffs.apply(world, bearer, "Stimpack", source=source)
    world.life[bearer if gone == "bearer" else source] = 0.0
    field.play(1)
    assert len(world.buffs) == (0 if gone == "bearer" else 1)
    assert all(row["source"] == NOBODY for row in world.buffs.rows)


def test_a_unit_inside_another_is_out_of_the_world_and_comes_back(field: Any) -> None:
    world, marine, medivac = field.world, field.put("Marine", 1, 10, 16), field.put("Medivac", 1, 10, 18)
    lifecycle.stow(world, marine, medivac)
    field.play(5)
    assert marine not in world.live
    assert world.passengers(medivac) == [marine]
    assert not world.visible[2, marine]
    lifecycle.unstow(world, marine, (12.0, 16.0))
    field.play(5)
    assert marine in world.live
    assert world.visible[2, marine]


def test_what_a_carrier_holds_dies_with_it(field: Any) -> None:
    world, marine, medivac = field.world, field.put("Marine", 1, 10, 16), field.put("Medivac", 1, 10, 18)
    tag = world.tag_of(marine)
    lifecycle.stow(world, marine, medivac)
    world.life[medivac] = 0.0
    field.play(1)
    assert world.slot_of(tag) == NOBODY
    assert world.players[1].score.lost_units == 2


def test_timed_life_ends(field: Any) -> None:
    slot = field.put("Marine", 1, 10, 16)
    field.world.expires[slot] = 50
    lifecycle.note_population(field.world)
    field.play(49)
    assert field.world.alive[slot]
    field.play(1)
    assert not field.world.alive[slot]


@pytest.mark.parametrize(("distance", "seen"), [(5.0, True), (14.0, False)])
def test_a_detector_shows_what_is_cloaked_within_its_radius(field: Any, distance: float, *, seen: bool) -> None:
    templar = field.put("DarkTemplar", 1, 4, 16)
    field.put("Observer", 2, 4 + distance, 16)
    field.play(16)
    assert field.world.visible[2, templar] == seen
    assert field.world.visible[1, templar]
