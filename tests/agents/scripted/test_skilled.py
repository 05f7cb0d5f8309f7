"""What the skilled player does, by texts that show one thing each."""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING

import pytest

from khala_agents.scripted.reading import points, read
from khala_agents.scripted.skilled import skilled
from khala_agents.scripted.skilled.builds import BUILDS
from khala_agents.scripted.skilled.kinds import KINDS
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Iterable

BASIC = ("Move_Screen(screen)", "Move_Minimap(minimap)", "Attack_Unit(tag)", "Select_Unit_Move_Screen(tag, screen)")


def line(
    tag: int, name: str, x: float, y: float, *fields: str, health: str = "100/100", far: float | None = None
) -> str:
    """Return a unit as an observation lists it; `far` is its distance, of enemies."""
    distance = () if far is None else (f"distance {far}",)
    return " | ".join((name, f"tag 0x{tag:x}", f"screen [{x}, {y}]", *distance, f"health {health}", *fields))


def page(
    *own: str,
    enemies: Iterable[str] = (),
    allies: Iterable[str] = (),
    actions: Iterable[str] = BASIC,
    task: str = "",
    more: str = "",
    minimap: str = "[30, 32]",
    hit: str = "",
    will: str = "",
) -> str:
    """Return an observation of one team, T."""
    lists = {"Your units": own, "Allied units": tuple(allies), "Enemy units": tuple(enemies)}
    blocks = [
        f"    {title}:\n" + "".join(f"        {unit}\n" for unit in units) for title, units in lists.items() if units
    ]
    if hit:
        blocks.append(f"    Since the last observation:\n        own Stalker was hit: {hit}\n")
    valid = ", ".join(f"<{action}>" for action in actions)
    will_do = f"    What will do for team T:\n        Attack_Unit: tag {will}\n" if will else ""
    return (
        f"Game\n    Time: 0:20\n\nTeam T\n    Minimap position: {minimap}\n{''.join(blocks)}\n"
        f"Valid actions\n    Team T: {valid}\n{will_do}\nTask\n    Win.\n    Team T: {task}\n\n{more}"
        "Answer\n    At most 3 actions per team.\n"
    )


def calls(text: str) -> list[str]:
    """Return its orders, `Attack_Unit 0x1`."""
    speech = parse(skilled(text, random.Random(1)))
    assert speech.faults == ()
    return [" ".join((call.name, *(str(arg) for arg in call.args))) for call in speech.calls]


def names(text: str) -> list[str]:
    return [call.split(" ")[0] for call in calls(text)]


STALKERS = [line(n, "Stalker", 12, 10 + n, "shield 80/80", "weapon ready", health="80/80") for n in (1, 2, 3)]
COOLING = [text.replace("weapon ready", "weapon in 0.9 s") for text in STALKERS]
ZEALOT = line(0x10, "Zealot", 14, 12, "shield 50/50", far=2.0)


def test_it_shoots_while_weapons_are_ready() -> None:
    assert calls(page(*STALKERS, enemies=[ZEALOT])) == ["Attack_Unit 0x10"]


def test_it_steps_back_from_melee_units_while_weapons_cool_down() -> None:
    (call,) = calls(page(*COOLING, enemies=[ZEALOT]))
    x = float(call.split("(")[1].split(",")[0])
    assert call.startswith("Move_Screen")
    assert x < 12


def test_it_does_not_step_back_from_who_is_faster() -> None:
    assert names(page(*COOLING, enemies=[ZEALOT.replace("Zealot", "Broodling")])) == ["Attack_Unit"]


def test_it_prefers_the_enemy_whose_loss_helps_most() -> None:
    hurt = line(0x11, "Roach", 17, 12, health="20/145", far=5.0)
    whole = line(0x12, "Roach", 16, 12, health="145/145", far=4.0)
    assert calls(page(*STALKERS, enemies=[whole, hurt])) == ["Attack_Unit 0x11"]


def test_it_shoots_at_what_its_weapons_can_hit() -> None:
    zealots = [line(1, "Zealot", 12, 12, "shield 50/50")]
    flyer, walker = line(0x11, "Mutalisk", 13, 12, far=1.0, health="1/120"), line(0x12, "Roach", 15, 12, far=3.0)
    assert calls(page(*zealots, enemies=[flyer, walker])) == ["Attack_Unit 0x12"]


@pytest.mark.parametrize(("will", "shot"), [("", "Attack_Unit 0x11"), ("0x12", "Attack_Unit 0x12")])
def test_it_shoots_at_what_the_text_says_will_do(will: str, shot: str) -> None:
    tempest = line(1, "Tempest", 12, 12, health="300/300")
    walker, flyer = line(0x11, "Hydralisk", 15, 12, far=3.0, health="1/80"), line(0x12, "Corruptor", 16, 12, far=4.0)
    assert calls(page(tempest, enemies=[walker, flyer], will=will)) == [shot]


BLINK = (*BASIC, "Select_Unit_Blink_Screen(tag, screen)")


def test_the_nearly_dead_blink_out_of_reach_and_the_others_go_on() -> None:
    hurt = line(9, "Stalker", 13, 12, "shield 0/80", "weapon ready", health="30/80")
    first, second = calls(page(*STALKERS, hurt, enemies=[ZEALOT], actions=BLINK, hit="0x9 -16, 0x1 -8"))
    assert first.startswith("Select_Unit_Blink_Screen 0x9")
    assert second == "Attack_Unit 0x10"
    roach = line(0x10, "Roach", 15, 12, far=3.0, health="145/145")
    assert calls(page(*STALKERS, hurt, enemies=[roach], actions=BLINK, hit="0x1 -8")) == ["Attack_Unit 0x10"]
    assert len(calls(page(*STALKERS, hurt, enemies=[roach], actions=BLINK, hit="0x9 -8"))) == 2


def test_a_hurt_unit_that_cannot_be_ordered_alone_does_not_take_its_team_out_of_the_fight() -> None:
    hurt = line(9, "Zealot", 13, 12, "shield 0/50", health="10/100")
    whole = line(8, "Zealot", 13, 13, "shield 50/50")
    actions = tuple(action for action in BASIC if not action.startswith("Select_"))
    for own in ([hurt, whole], [hurt]):
        assert calls(page(*own, enemies=[ZEALOT], actions=actions, hit="0x9 -16")) == ["Attack_Unit 0x10"]
    first, second = calls(page(hurt, whole, enemies=[ZEALOT], actions=BASIC, hit="0x9 -16"))
    assert first.startswith("Select_Unit_Move_Screen 0x9")
    assert second == "Attack_Unit 0x10"


def test_who_cannot_blink_again_yet_does_not_try() -> None:
    hurt = line(9, "Stalker", 13, 12, "shield 0/80", "weapon ready", "not ready Blink", health="30/80")
    said = names(page(*STALKERS, hurt, enemies=[ZEALOT], actions=BLINK, hit="0x9 -16"))
    assert "Select_Unit_Blink_Screen" not in said


ROACHES = [line(0x20 + n, "Roach", 17, 8 + n, far=5.0) for n in range(5)]
SWARM = [line(0x20 + n, "Zergling", 18 + n % 3 * 0.5, 12 + n // 3 * 0.5, far=6.0, health="35/35") for n in range(9)]
LONE = [line(0x40, "Zergling", 18, 12, far=6.0, health="35/35")]


def templar(energy: int, count: int = 1) -> list[str]:
    return [line(n, "HighTemplar", 12, 10 + n, "shield 40/40", f"energy {energy}/200") for n in range(1, count + 1)]


STORM = (*BASIC, "Select_Unit_Ability_PsiStorm_Screen(tag, screen)")


@pytest.mark.parametrize(("energy", "enemies", "storms"), [(75, SWARM, 1), (74, SWARM, 0), (200, LONE, 0)])
def test_storms_are_for_crowds(energy: int, enemies: list[str], storms: int) -> None:
    said = names(page(*templar(energy), enemies=enemies, actions=STORM))
    assert said.count("Select_Unit_Ability_PsiStorm_Screen") == storms


def test_two_templar_storm_two_places_and_not_their_friends() -> None:
    two = [*SWARM, *(line(0x60 + n, "Zergling", 18 + n % 3 * 0.5, 6 + n // 3 * 0.5, far=8.0) for n in range(9))]
    said = [call for call in calls(page(*templar(100, 2), enemies=two, actions=STORM)) if "PsiStorm" in call]
    assert len({call.split(" ", 2)[2] for call in said}) == len(said) == 2
    friends = [line(0x70 + n, "Zealot", 18 + n % 3 * 0.5, 12 + n // 3 * 0.5) for n in range(9)]
    assert not any(
        "PsiStorm" in call for call in calls(page(*templar(100), enemies=SWARM, allies=friends, actions=STORM))
    )


@pytest.mark.parametrize(
    ("unit", "fields", "action", "enemies"),
    [
        ("Sentry", ("energy 100/200",), "Ability_GuardianShield()", ROACHES),
        ("Sentry", ("energy 100/200",), "Select_Unit_Ability_ForceField_Screen(tag, screen)", SWARM),
        ("Disruptor", (), "Select_Unit_Ability_PurificationNova_Attack(tag, tag)", SWARM),
        ("VoidRay", (), "Ability_PrismaticAlignment()", SWARM),
        ("Mothership", ("energy 150/200",), "Ability_TimeWarp_Screen(screen)", SWARM),
        ("Oracle", ("energy 100/200",), "Ability_PulsarBeamOn()", [line(0x20, "Drone", 14, 12, far=3)]),
        ("Infestor", ("energy 100/200",), "Effect_FungalGrowth_Screen(screen)", SWARM),
        ("Marine", (), "Effect_Stim()", ROACHES),
        ("SiegeTank", (), "Morph_SiegeMode()", SWARM),
    ],
)  # fmt: skip
def test_a_skill_is_used_when_it_is_worth_it_and_not_without_enemies(
    unit: str, fields: tuple[str, ...], action: str, enemies: list[str]
) -> None:
    own, name = line(1, unit, 12, 12, "shield 10/10", *fields), action.partition("(")[0]
    assert name in names(page(own, enemies=enemies, actions=(*BASIC, action)))
    assert name not in names(page(own, actions=(*BASIC, action)))


def test_a_phoenix_lifts_while_others_are_there_to_shoot() -> None:
    beam = (*BASIC, "Select_Phoenix_Ability_GravitonBeam_Unit(tag, tag)")
    phoenixes = [line(n, "Phoenix", 12, 10 + n, "shield 60/60", "energy 100/200") for n in (1, 2)]
    queen = line(0x20, "Queen", 16, 12, far=4.0)
    assert "Select_Phoenix_Ability_GravitonBeam_Unit 0x1 0x20" in calls(page(*phoenixes, enemies=[queen], actions=beam))
    assert "Select_Phoenix_Ability_GravitonBeam_Unit" not in names(page(phoenixes[0], enemies=[queen], actions=beam))
    lifted = line(0x20, "Queen", 16, 12, "effects GravitonBeam", far=4.0)
    assert calls(page(*phoenixes, enemies=[lifted], actions=beam)) == ["Attack_Unit 0x20"]


ADEPTS = [line(n, "Adept", 12, 10 + n, "shield 70/70", "weapon ready", health="70/70") for n in (1, 2)]
DRONE, QUEEN = (
    line(0x20, "Drone", 16, 12, far=4.0, health="40/40"),
    line(0x21, "Queen", 15, 12, far=3.0, health="5/175"),
)


def test_a_raid_goes_for_workers_and_a_battle_for_the_army() -> None:
    assert calls(page(*ADEPTS, enemies=[DRONE, QUEEN], task="Kill as many workers as you can.")) == ["Attack_Unit 0x20"]
    assert calls(page(*ADEPTS, enemies=[DRONE, QUEEN], task="Defeat the army.")) == ["Attack_Unit 0x21"]


def test_who_shall_not_stop_on_the_way_passes_by() -> None:
    text = page(*ADEPTS, enemies=[QUEEN], task="Get to [52, 32]; do not stop to fight on the way.")
    assert calls(text) == ["Move_Minimap (52.0, 32.0)"]


def test_a_team_goes_where_its_task_or_a_message_wants_it() -> None:
    assert calls(page(*STALKERS, task="Wait at [20, 21].")) == ["Move_Minimap (20.0, 21.0)"]
    message = "Messages\n    Message from Commander: '''All groups attack at [40.0, 46.0], together.'''\n\n"
    assert calls(page(*STALKERS, task="Wait at [20, 21].", more=message)) == ["Move_Minimap (40.0, 46.0)"]
    new, old = (message.replace("Commander:", f"Commander, {age} ago:") for age in ("new, 0:02", "0:04"))
    assert calls(page(*STALKERS, task="Wait at [20, 21].", more=new)) == ["Move_Minimap (40.0, 46.0)"]
    assert calls(page(*STALKERS, task="Wait at [20, 21].", more=old)) == ["Move_Minimap (20.0, 21.0)"]
    assert calls(page(*STALKERS, task="Wait at [20, 21].", minimap="[20, 22]")) == []


def side(
    valid: str, counts: str, *, minerals: int = 400, supply: str = "20 of 31", costs: str = "", more: str = ""
) -> str:
    return (
        f"Game\n    Time: 2:00\n    Minerals: {minerals}, vespene: 100\n    Supply: {supply} used\n\n"
        f"Unit counts\n    {counts}\n\n{more}Valid actions\n    Team Base: {valid}\n    What they cost:\n{costs}\n"
        "Answer\n    At most 5 actions per team.\n"
    )


def test_supply_is_built_before_it_is_short() -> None:
    valid, counts = (
        "<Build_Pylon()>, <Train_Zealot()>",
        "Your units: 20 Probe (working)\n    Your structures: 1 Nexus, 1 Pylon",
    )
    assert names(side(valid, counts, supply="13 of 15"))[0] == "Build_Pylon"
    assert "Build_Pylon" not in names(side(valid, counts, supply="20 of 31"))
    building = f"{counts}\n    Under construction: 1 Pylon (20%)"
    assert "Build_Pylon" not in names(side(valid, building, supply="13 of 15"))


def test_no_more_is_ordered_than_can_be_paid() -> None:
    costs = "        Train_Zealot: 100 minerals, 2 supply, 27.1 s; enough for 2\n"
    counts = "Your units: 44 Probe (working)\n    Your structures: 1 Nexus, 3 Pylon, 8 Gateway, 1 CyberneticsCore"
    assert names(side("<Train_Zealot()>", counts, minerals=250, costs=costs)) == ["Train_Zealot"] * 2


@pytest.mark.parametrize(
    ("army", "more", "order"),
    [
        ("20 Stalker", "", ["All_Units_Attack"]),
        ("10 Stalker", "", ["All_Units_Defend"]),
        ("10 Stalker", "Alerts\n    Under attack at minimap [30, 47]\n\n", ["All_Units_Defend"]),
        ("10 Stalker", "Your last actions\n    accepted: Base <All_Units_Attack()>\n\n", ["All_Units_Attack"]),
        ("4 Stalker", "Your last actions\n    accepted: Base <All_Units_Attack()>\n\n", ["All_Units_Defend"]),
    ],
)
def test_the_army_sets_out_when_it_is_strong_and_comes_home_when_it_is_not(
    army: str, more: str, order: list[str]
) -> None:
    valid, counts = (
        "<All_Units_Attack()>, <All_Units_Defend()>",
        f"Your units: 20 Probe, {army}\n    Your structures: 1 Nexus",
    )
    assert names(side(valid, counts, more=more)) == order


def leader(army: str, *, at: str, seen: str = "none", more: str = "") -> str:
    """Return an observation of a commander of groups, whose Marines are at a place."""
    return (
        "Game\n    Time: 6:00\n    Minerals: 50, vespene: 0\n    Supply: 90 of 110 used\n\n"
        "Map\n    Places, numbered by the way from where you began:\n        Base 1 at [16, 18], yours, CommandCenter\n"
        "        Base 2 at [24, 24], yours, CommandCenter\n"
        "        Base 3 at [48, 46], no town hall known, the enemy may have begun here, never seen\n\n"
        f"Unit counts\n    Your units: {army}, 40 SCV\n    Enemies spotted so far: {seen}\n\n{more}"
        f"Teams of other agents\n    CombatGroup0\n        Marine-1: 30 Marine at minimap {at}, 100% of health\n"
        "    CombatGroup4\n        Overlord-1: 9 Overlord at minimap [10, 10], 100% of health\n\n"
        "Task\n    Gather the groups in front of your base until they are strong enough.\n\n"
        "Communication\n    You can write to: CombatGroup0, CombatGroup4\n\n"
        "Answer\n    You have no team to order now.\n"
    )


@pytest.mark.parametrize(
    ("army", "at", "more", "order"),
    [
        ("20 Marine", "[20, 20]", "", "Gather at [26.9, 26.7] and defend it."),
        ("20 Marine", "[20, 20]", "Alerts\n    Under attack at minimap [25, 22]: 1 SCV\n\n", "Defend [25.0, 22.0]."),
        ("45 Marine", "[20, 20]", "", "Attack [48.0, 46.0]."),
        ("20 Marine", "[44, 44]", "", "Attack [48.0, 46.0]."),
        ("10 Marine", "[44, 44]", "", "Gather at [26.9, 26.7] and defend it."),
    ],
)
def test_a_commander_orders_places_that_its_text_names_to_groups_that_fight(
    army: str, at: str, more: str, order: str
) -> None:
    said = parse(skilled(leader(army, at=at, more=more), random.Random(1))).messages
    assert [(message.recipient, message.text) for message in said] == [("CombatGroup0", order)]


ORDERED = [
    ("at Base 2, [27, 26]: 20 Marine: idle", False),
    ("at Base 1, [20, 20]: 20 Marine: Move to [27, 27]", False),
    ("at Base 1, [20, 20]: 20 Marine: Attack_Unit", False),
    ("at Base 1, [20, 20]: 20 Marine: idle", True),
    ("at Base 1, [20, 20]: 20 Marine: Attack to [48, 46]", True),
]


@pytest.mark.parametrize(("doing", "is_told"), ORDERED, ids=[doing for doing, _ in ORDERED])
def test_a_commander_writes_to_those_that_do_something_else(doing: str, is_told: bool) -> None:
    armies = f"Armies\n    Yours, worth 1000 minerals and vespene:\n        {doing}\n    The enemy's: none\n\n"
    text = leader("20 Marine", at="[20, 20]", more=armies)
    assert bool(parse(skilled(text, random.Random(1))).messages) == is_told


def test_a_leader_without_units_speaks_of_its_side() -> None:
    reply = skilled(
        leader("20 Marine", at="[20, 20]", seen="\n        3 Roach in sight at minimap [40, 40]"), random.Random(1)
    )
    assert "We have 40 workers and an army of 20 supply; of the enemy's we know 6." in reply


def test_an_army_that_knows_of_a_stronger_one_waits() -> None:
    seen = "\n        40 Roach in sight at minimap [40, 40]"
    (message,) = parse(skilled(leader("45 Marine", at="[20, 20]", seen=seen), random.Random(1))).messages
    assert message.text.startswith("Gather")


def test_the_last_structures_are_looked_for_all_over_the_map() -> None:
    seen = leader("45 Marine", at="[46, 46]").replace("the enemy may have begun here, never seen", "in sight")
    (message,) = parse(skilled(seen, random.Random(1))).messages
    later = parse(skilled(seen.replace("6:00", "7:30"), random.Random(1))).messages[0]
    assert message.text.startswith("Attack")
    assert message.text not in {"Attack [48.0, 46.0].", later.text}


MARCH = (*BASIC, "Attack_Minimap(minimap)")
MARINES = [line(n, "Marine", 12, 9 + n, health="45/45") for n in range(1, 7)]
ATTACK = "Messages\n    Message from Commander: '''Attack [48.0, 46.0].'''\n\n"
CONTACT = "Communication\n    You can write to: Commander\n\n"


def test_a_group_carries_out_what_the_message_says() -> None:
    assert calls(page(*MARINES, actions=MARCH, more=ATTACK)) == ["Attack_Minimap (48.0, 46.0)"]
    home = ATTACK.replace("Attack [48.0, 46.0].", "Gather at [20.0, 20.0] and defend it.")
    assert calls(page(*MARINES, actions=MARCH, more=home)) == ["Move_Minimap (20.0, 20.0)"]
    assert calls(page(*MARINES, actions=MARCH, more=home, enemies=[ZEALOT])) == ["Attack_Minimap (20.0, 20.0)"]


def test_a_unit_that_is_left_behind_hears_of_the_order_later() -> None:
    there = "[48.0, 46.0]"
    assert calls(page(*MARINES, actions=MARCH, more=ATTACK, minimap=there)) == []
    stray = line(9, "Marine", 60, 40, health="45/45")
    assert calls(page(*MARINES, stray, actions=MARCH, more=ATTACK, minimap=there)) == ["Attack_Minimap (48.0, 46.0)"]


def test_a_large_group_that_fights_already_is_not_disturbed() -> None:
    assert calls(page(*MARINES, actions=MARCH, enemies=[ZEALOT])) == ["Attack_Minimap (30.0, 32.0)"]
    busy = [f"{marine} | order Attack minimap [48, 46]" for marine in MARINES]
    assert calls(page(*busy, actions=MARCH, enemies=[ZEALOT])) == []


def test_who_has_a_commander_waits_for_its_order() -> None:
    assert calls(page(*MARINES, actions=MARCH, more=CONTACT)) == []


def test_a_report_says_what_the_observation_says() -> None:
    text = page(*MARINES, actions=MARCH, more=CONTACT, enemies=[ZEALOT])
    said = {m.text for seed in range(30) for m in parse(skilled(text, random.Random(seed))).messages}
    assert said == {"T is at [30.0, 32.0] of the minimap and sees 1 enemies."}


def test_unarmed_units_stay_with_their_friends() -> None:
    medivac = line(1, "Medivac", 12, 12)
    friends = [line(n, "Marine", 19, 10 + n) for n in (2, 3)]
    assert calls(page(medivac, allies=friends, actions=MARCH, more=CONTACT)) == ["Move_Screen (19.0, 12.5)"]
    beside = [line(n, "Marine", 13, 10 + n) for n in (2, 3)]
    assert calls(page(medivac, allies=beside, actions=MARCH, more=CONTACT)) == []


def test_a_queen_with_energy_injects_the_nearest_hatchery() -> None:
    halls = [line(0x30, "Hatchery", 16, 12), line(0x31, "Lair", 22, 12)]
    actions = (*MARCH, "Effect_InjectLarva_Unit(tag)")
    ready, tired = (line(1, "Queen", 12, 12, f"energy {energy}/200") for energy in (25, 24))
    assert calls(page(ready, allies=halls, actions=actions)) == ["Effect_InjectLarva_Unit 0x30"]
    assert calls(page(tired, allies=halls, actions=actions)) == []


def test_a_builder_builds_in_its_base_and_around_it_when_that_is_full() -> None:
    hall, worker, build = (
        line(0x30, "CommandCenter", 2, 2),
        line(1, "SCV", 12, 12),
        ("Build_SupplyDepot_Screen(screen)",),
    )
    (call,) = calls(page(worker, allies=[hall], actions=build))
    assert 6.0 <= math.dist((2, 2), points(call.replace("(", "[").replace(")", "]"))[0]) <= 10.0
    full = [line(0x40 + 9 * i + j, "Barracks", 4 * i, 4 * j) for i in range(4) for j in range(4)]
    (call,) = calls(page(worker, allies=[hall, *full], actions=build))
    assert math.dist((2, 2), points(call.replace("(", "[").replace(")", "]"))[0]) > 10.0


def test_a_builder_names_what_is_beside_where_the_host_finds_the_place() -> None:
    hall, worker = line(0x30, "Nexus", 2, 2), line(1, "Probe", 12, 12)
    pylons = [line(tag, "Pylon", 8, tag - 0x3C) for tag in (0x40, 0x44)]
    assert calls(page(worker, allies=[hall], actions=["Build_Pylon_Near(tag)"])) == ["Build_Pylon_Near 0x30"]
    counts = "Unit counts\n    Your units: 13 Probe\n    Your structures: 1 Nexus, 2 Pylon\n\n"
    build = ["Build_Pylon_Near(tag)", "Build_Gateway_Near(tag)"]
    seen = page(worker, allies=[hall, *pylons], actions=build, more=counts)
    (call,) = calls(seen.replace("    Time: 0:20\n", "    Time: 0:20\n    Supply: 13 of 31 used\n"))
    assert call in {"Build_Gateway_Near 0x40", "Build_Gateway_Near 0x44"}


def test_a_structure_trains_one_unit_at_a_time() -> None:
    costs = "        Train_Marine: 50 minerals, 1 supply; enough for 8\n"
    counts = "Your units: 44 SCV\n    Your structures: 1 OrbitalCommand, 2 Barracks, 1 BarracksReactor, 4 SupplyDepot\n"
    counts += "    In production: Train_Marine (1 at 40%)"
    assert names(side("<Train_Marine()>", counts, costs=costs)).count("Train_Marine") == 2


def test_units_are_warped_in_at_a_phasing_prism() -> None:
    fields = "        WarpPrismPhasing 0x3 at minimap [5, 5], radius 3.75, warps in fast, no room for a unit\n"
    fields += "        Pylon 0x1 at minimap [10, 36]\n        WarpPrismPhasing 0x2 at minimap [52, 24]\n\n"
    costs = "        Warp_Zealot_Near: 100 minerals, 2 supply; enough for 4\n"
    assert (
        calls(side("<Warp_Zealot_Near(tag)>", "Your units: 12 Probe", costs=costs, more=f"Warping in\n{fields}"))
        == ["Warp_Zealot_Near 0x2"] * 4
    )


def test_build_orders_name_types_that_the_player_knows() -> None:
    wants = [want for build in BUILDS for want in build.wants]
    named = {kind for want in wants for kinds in (want.makes, *want.after) for kind in kinds.split("|")} - {""}
    assert named | {line.producer for build in BUILDS for line in build.army} - {""} <= KINDS.keys()


def test_what_an_observation_says_of_the_side_is_read() -> None:
    counts = (
        "Your units: 2 Probe (1 working, 1 idle), 1 Sentry\n    Your structures: 2 Gateway (1 working, 1 idle)\n"
        "    Under construction: 1 Stargate (35%)\n    Going to be built by workers on their way: 2 Pylon\n"
        "    In production: Train_Probe (1 at 40%), Train_Zealot (2 at 5%, 9%; 3 more queued)\n"
        "    Enemies spotted so far:\n        1 Roach in sight at minimap [34, 47]"
    )
    seen = read(side("<Build_Pylon()>", counts))
    assert seen.counts == {"Probe": 2, "Sentry": 1, "Gateway": 2}
    assert (seen.begun, seen.producing) == ({"Stargate": 1, "Pylon": 2}, {"Train_Probe": 1, "Train_Zealot": 5})
    assert seen.known == [("Roach", (34, 47))]
    assert (seen.minerals, seen.vespene, seen.supply_used, seen.supply_cap) == (400, 100, 20, 31)


def test_what_is_promised_is_not_spent_again() -> None:
    text = side("<Build_Pylon()>", "Your units: 12 Probe")
    promise = "vespene: 100 (100 minerals and 25 vespene of it for what workers are on their way to build)"
    seen = read(text.replace("vespene: 100", promise))
    assert (seen.minerals, seen.vespene) == (300, 75)
