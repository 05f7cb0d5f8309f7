"""The possible actions with their prices, and why the others are not possible: by the game and by its facts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.functions import functions, general
from khala_bridge.knowledge import abilities, upgrades
from khala_bridge.observe import Observer
from khala_bridge.task.config import TaskConfig

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.messages import TeamView

ACTIONS = {
    "Stalker": ["Attack_Unit", "Stop", "No_Operation", "Ability_Blink_Screen"],
    "Zealot": ["Attack_Unit", "Stop"],
    "HighTemplar": ["Move_Screen", "Ability_PsiStorm_Screen"],
    "Adept": ["Move_Screen", "Ability_AdeptPhaseShift_Screen", "Ability_CancelPhaseShift"],
}


@pytest.fixture
def team(snapshot: Any) -> Callable[..., TeamView]:
    """Return the view of a team of all types, or of a side team with some actions."""

    def see(units: list[Any], *side: str, **fields: Any) -> TeamView:
        kinds = tuple(ACTIONS)
        teams = [{"name": "T", "kind": "side", "actions": side} if side else {"name": "T", "unit_types": kinds}]
        agent = {"name": "A", "role": "", "teams": teams, "actions": {} if side else ACTIONS}
        config = {"name": "t", "map": "2s3z", "task": "", "agents": [agent]}
        observation = Observer(TaskConfig.model_validate(config)).observe(snapshot(units, **fields))
        view: TeamView = observation.agents["A"].view.teams[0]
        return view

    return see


def able(*names: str) -> frozenset[int]:
    numbers = [functions()[name].ability_id for name in names]
    return frozenset((*numbers, *map(general, numbers)))


def names(view: TeamView) -> list[str]:
    return [action.name for action in view.actions]


def reasons(view: TeamView) -> dict[str, str]:
    return {barred.action: barred.reason for barred in view.barred}


RICH = {"minerals": 1000, "vespene": 1000, "food_used": 10, "food_cap": 50}


# --- units of a team ------------------------------------------------------------------------------------------


def test_an_action_is_valid_if_some_unit_of_the_team_can_do_it(unit: Any, team: Any) -> None:
    units = [unit(1, "Stalker", 16, 16), unit(2, "Stalker", 17, 16), unit(3, "Zealot", 20, 16, alliance="enemy")]
    given = {1: able("Attack_screen"), 2: able("Attack_screen", "Effect_Blink_screen")}
    view = team(units, abilities=given, upgrades=(87,))
    assert names(view) == ["Attack_Unit", "No_Operation", "Ability_Blink_Screen"]
    assert reasons(view) == {"Stop": "not in its present state"}


def test_a_general_function_is_valid_by_a_special_ability_of_the_unit(unit: Any, team: Any) -> None:
    special = next(f.id for f in abilities().values() if f.name == "Effect_Blink_Stalker")
    view = team([unit(1, "Stalker", 16, 16)], abilities={1: frozenset({special, general(special)})}, upgrades=(87,))
    assert "Ability_Blink_Screen" in names(view)


def test_what_another_type_of_the_team_can_do_counts_only_if_it_is_listed_for_it(unit: Any, team: Any) -> None:
    units = [unit(1, "Stalker", 16, 16), unit(2, "Zealot", 17, 16)]
    view = team(units, abilities={1: frozenset(), 2: able("Stop_quick", "Effect_Blink_screen")}, upgrades=(87,))
    assert names(view) == ["Stop", "No_Operation"]


def test_without_the_games_word_nothing_is_barred_that_is_not_known_to_be(unit: Any, team: Any) -> None:
    view = team([unit(1, "Stalker", 16, 16), unit(3, "Zealot", 20, 16, alliance="enemy")], abilities=None)
    assert names(view) == ["Attack_Unit", "Stop", "No_Operation"]
    assert reasons(view) == {"Ability_Blink_Screen": "Blink is not researched"}


@pytest.mark.parametrize(
    ("energy", "upgrades", "reason"),
    [
        (200, (), "PsiStorm is not researched"),
        (74.9, (52,), "needs 75 energy, there is 74"),
        (200, (52,), "cooling down"),
    ],
)
def test_a_skill_that_is_not_there_has_a_reason(
    energy: float, upgrades: tuple[int, ...], reason: str, unit: Any, team: Any
) -> None:
    templar = unit(1, "HighTemplar", 16, 16, energy=energy, energy_max=200)
    view = team([templar], abilities={1: able("Move_screen")}, upgrades=upgrades)
    assert reasons(view) == {"Ability_PsiStorm_Screen": reason}


def test_it_is_told_which_unit_has_a_skill_ready(unit: Any, team: Any) -> None:
    units = [unit(tag, "Stalker", 15 + tag, 16) for tag in (1, 2)]
    given = {1: able("Attack_screen"), 2: able("Attack_screen", "Effect_Blink_screen")}
    details = [u.details for u in team(units, abilities=given, upgrades=(87,)).units]
    assert [(d.ready, d.unready) for d in details] == [((), {"Blink": None}), (("Blink",), {})]
    given[2] = given[1]
    assert [u.details for u in team(units, abilities=given, upgrades=(87,)).units] == [None, None]


# --- the whole side -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("units", "player", "upgrades", "reason"),
    [
        ([], RICH, (), "no TwilightCouncil"),
        ([("TwilightCouncil", {"build_progress": 0.5})], RICH, (), "TwilightCouncil is not finished"),
        ([("TwilightCouncil", {})], RICH | {"minerals": 100}, (), "50 more minerals needed"),
        ([("TwilightCouncil", {})], {}, (), "150 more minerals needed, 150 more vespene needed"),
        ([("TwilightCouncil", {})], RICH, (87,), "researched already"),
        ([("TwilightCouncil", {"orders": (1593,)})], RICH, (), "being researched"),
        ([("TwilightCouncil", {"is_powered": True})], RICH, (), "the game lets no TwilightCouncil do it now"),
        ([("TwilightCouncil", {})], RICH, (), "no TwilightCouncil has power"),
    ],
)
def test_research_that_is_not_possible_has_a_reason(
    units: list[tuple[str, dict[str, Any]]], player: Any, upgrades: Any, reason: str, unit: Any, team: Any
) -> None:
    made = [unit(number, name, 16, 16, **fields) for number, (name, fields) in enumerate(units, 1)]
    view = team(made, "Research_Blink", abilities={}, player=player, upgrades=upgrades)
    assert (names(view), reasons(view)) == ([], {"Research_Blink": reason})


def test_a_structure_that_is_required_is_named(unit: Any, team: Any) -> None:
    gateway = unit(1, "Gateway", 16, 16, is_powered=True)
    view = team([gateway], "Train_HighTemplar", abilities={}, player=RICH)
    assert reasons(view) == {"Train_HighTemplar": "no TemplarArchive"}


def test_a_required_structure_that_is_being_built_is_said_to_be(unit: Any, team: Any) -> None:
    units = [unit(1, "Gateway", 16, 16, is_powered=True), unit(2, "TemplarArchive", 20, 16, build_progress=0.5)]
    view = team(units, "Train_HighTemplar", abilities={}, player=RICH)
    assert reasons(view) == {"Train_HighTemplar": "TemplarArchive is not finished"}


def test_supply_that_is_used_up_is_named(unit: Any, team: Any) -> None:
    gateway = unit(1, "Gateway", 16, 16, is_powered=True)
    view = team([gateway], "Train_Zealot", abilities={}, player=RICH | {"food_used": 49})
    assert reasons(view) == {"Train_Zealot": "1 more supply needed"}


@pytest.mark.parametrize("asked", [True, False])
def test_what_somebody_can_do_is_offered_with_its_price(asked: bool, unit: Any, team: Any) -> None:
    gateway = unit(1, "Gateway", 16, 16, is_powered=True)
    given = {1: able("Train_Zealot_quick")} if asked else None
    view = team([gateway], "Train_Zealot", abilities=given, player=RICH)
    facts = abilities()[functions()["Train_Zealot_quick"].ability_id]
    (offer,) = view.offers
    assert (offer.minerals, offer.vespene, offer.supply) == (facts.minerals, facts.vespene, facts.supply)
    affordable = min(RICH["minerals"] // facts.minerals, (RICH["food_cap"] - RICH["food_used"]) // facts.supply)
    assert offer.times == affordable
    assert not offer.first


@pytest.mark.parametrize(("standing", "first"), [((), True), (("EngineeringBay",), False)])
def test_the_first_structure_of_its_kind_is_marked(
    standing: tuple[str, ...], first: bool, unit: Any, team: Any, plain: Any
) -> None:
    others = [unit(3 + number, name, 20, 16) for number, name in enumerate(standing)]
    units = [unit(1, "SCV", 16, 16), unit(2, "CommandCenter", 10.5, 10.5), *others]
    able_to = {1: able("Build_EngineeringBay_screen")}
    view = team(units, "Build_EngineeringBay", abilities=able_to, player=RICH, change=plain)
    assert [offer.first for offer in view.offers] == [first]


@pytest.mark.parametrize("level", [1, 2, 3])
def test_of_several_levels_the_next_one_is_offered(level: int, unit: Any, team: Any) -> None:
    forge = unit(1, "Forge", 16, 16, is_powered=True)
    known = upgrades()
    done = [known[f"ProtossGroundWeaponsLevel{before}"].id for before in range(1, level)]
    price = known[f"ProtossGroundWeaponsLevel{level}"]
    given = {1: able("Research_ProtossGroundWeapons_quick")}
    view = team([forge], "Research_ProtossGroundWeapons", abilities=given, player=RICH, upgrades=done)
    assert [(offer.minerals, offer.vespene) for offer in view.offers] == [(price.minerals, price.vespene)]
    council = unit(2, "TwilightCouncil", 20, 16)
    poor = team([forge, council], "Research_ProtossGroundWeapons", abilities={}, upgrades=done)
    missing = f"{price.minerals:g} more minerals needed, {price.vespene:g} more vespene needed"
    assert reasons(poor) == {"Research_ProtossGroundWeapons": missing}


def test_research_is_done_once_however_rich_one_is(unit: Any, team: Any) -> None:
    council = unit(1, "TwilightCouncil", 16, 16, is_powered=True)
    view = team([council], "Research_Blink", abilities={1: able("Research_Blink_quick")}, player=RICH)
    assert [offer.times for offer in view.offers] == [1]


def test_what_a_worker_is_on_its_way_to_build_is_promised(unit: Any, look: Any, base_task: Any) -> None:
    probe = unit(0x100110001, "Probe", 16, 16)
    place = probe.orders.add(ability_id=functions()["Build_Gateway_screen"].ability_id).target_world_space_pos
    place.x, place.y = 40.5, 40.5
    nexus = unit(2, "Nexus", 30.5, 16.5, is_powered=True)
    given = {2: able("Train_Probe_quick")}
    observation = Observer(base_task).observe(look([probe, nexus], abilities=given))
    developer = observation.agents["Developer"]
    price = round(abilities()[functions()["Build_Gateway_screen"].ability_id].minerals)
    assert price == 150
    assert developer.view.resources.promised == (150, 0)
    line = "    Minerals: 150, vespene: 75 (150 minerals of it for what workers are on their way to build)\n"
    assert line in developer.text
    assert reasons(developer.view.teams[0])["Train_Probe"] == "50 more minerals needed"


# --- what a rule would find, and which arguments will do ------------------------------------------------------


@pytest.mark.parametrize(
    ("action", "lack"),
    [
        ("All_Units_Attack", "no army"),
        ("All_Units_Retreat", "no army"),
        ("Build_Assimilator", "no free geyser at your bases"),
        ("Build_Gateway", "no room in the field of a Pylon"),
        ("ChronoBoost_Military", "nothing to boost"),
        ("Stop_Building_Unit", "nothing to call off"),
    ],
)
def test_what_no_rule_would_find_is_not_offered(action: str, lack: str, unit: Any, team: Any, plain: Any) -> None:
    units = [unit(1, "Probe", 16, 16), unit(2, "Nexus", 10.5, 10.5, energy=100.0), unit(3, "Gateway", 20.5, 10.5)]
    could = ("Attack_screen", "Move_screen", "Build_Assimilator_screen", "Build_Gateway_screen")
    given = dict.fromkeys((1, 2, 3), able(*could, "Effect_ChronoBoostEnergyCost_screen", "Cancel_Last_quick"))
    view = team(
        [*units, unit(4, "Pylon", 28, 28, build_progress=0.5)], action, abilities=given, player=RICH, change=plain
    )
    assert reasons(view) == {action: lack}


def test_the_units_and_the_targets_that_will_do_are_named(unit: Any, team: Any) -> None:
    zealots = [unit(1, "Zealot", 16, 16), unit(2, "Zealot", 17, 16)]
    foes = [unit(3, "Roach", 19, 16, alliance="enemy"), unit(4, "Mutalisk", 20, 16, alliance="enemy", is_flying=True)]
    given = {1: able("Attack_screen"), 2: able("Attack_screen")}
    assert [(one.action, one.tags) for one in team([*zealots, *foes], abilities=given).arguments] == [
        ("Attack_Unit", ("0x3",))
    ]
    assert reasons(team([*zealots, foes[1]], abilities=given))["Attack_Unit"] == "no enemy on the screen that fits"
    assert team([*zealots, foes[0]], abilities=given).arguments == ()


def test_a_skill_has_one_name_and_calling_it_off_is_none(unit: Any, team: Any) -> None:
    """An Adept whose shade is out may call it off, and is told that the shade is not ready."""
    adept = unit(1, "Adept", 16, 16)
    with_shade = {1: able("Move_screen", "Cancel_AdeptPhaseShift_quick")}
    (seen,) = team([adept], abilities=with_shade).units
    assert seen.details is None
    ready = {1: able("Move_screen", "Effect_AdeptPhaseShift_screen")}
    (seen,) = team([adept], abilities=ready).units
    assert seen.details.ready == ("AdeptPhaseShift",)


def test_targets_are_listed_by_their_distance(unit: Any, team: Any) -> None:
    far = [unit(10 + x, "Zergling", 16 + x, 16, alliance="enemy") for x in (9, 3, 6)]
    overlord = unit(30, "Overlord", 17, 16, alliance="enemy", is_flying=True)
    view = team([unit(1, "Zealot", 16, 16), *far, overlord], abilities={1: able("Attack_screen")})
    (attack,) = (argument for argument in view.arguments if argument.action == "Attack_Unit")
    assert attack.tags == (hex(13), hex(16), hex(19))
