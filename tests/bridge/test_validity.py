"""Which units the game allows an action, and the words for its reasons against it: one row for each reason."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.act import Actor, JointAction
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import functions, general
from khala_bridge.knowledge import facts_of
from khala_bridge.observe import Observer
from khala_bridge.rules import of_team, use_of, why_not
from khala_bridge.state.means import ledger_of, side_of
from khala_bridge.task.config import AgentConfig
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig

    Make = Callable[..., raw_pb2.Unit]

A, B, C = 0x100040001, 0x100080001, 0x1000C0001
FOE, FLYER, HALL = 0x100180001, 0x1001C0001, 0x100200001
ADDON = 0x100300001
RICH = {"minerals": 1000, "vespene": 1000, "food_cap": 100, "food_used": 50}
BLINK, STORM = 87, 52


@dataclass
class Scene:
    """Three units of one type with every action that fits it, enemies, and the game's answers about the units."""

    unit_type: str
    able: tuple[str, ...] = ()
    """Functions that the game would take from the first of them."""
    player: dict[str, int] = field(default_factory=lambda: dict(RICH))
    upgrades: tuple[int, ...] = ()
    standing: tuple[str, ...] = ()
    count: int = 3
    asked: bool = True
    fields: dict[str, Any] = field(default_factory=dict)


@pytest.fixture
def play(task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]) -> Callable[..., JointAction]:
    """Return the joint action of a reply in a scene."""

    def act(scene: Scene, *calls: str) -> JointAction:
        own = [unit(tag, scene.unit_type, 10 + i, 10, **scene.fields) for i, tag in enumerate((A, B, C)[: scene.count])]
        others = [
            unit(FOE, "Zealot", 15, 10, alliance="enemy"),
            unit(FLYER, "Phoenix", 15, 11, alliance="enemy", is_flying=True),
            unit(HALL, "Hatchery", 18, 12, alliance="enemy"),
            *(unit(ADDON + (i << 18), name, 20, 20) for i, name in enumerate(scene.standing)),
        ]
        names = [a.name for a in catalogue().values() if a.subject != "side" and a.fits(scene.unit_type)]
        agent = AgentConfig.model_validate(
            {
                "name": "A",
                "role": "",
                "admits": "any",
                "teams": [{"name": "Team-1", "unit_types": [scene.unit_type]}],
                "actions": {scene.unit_type: tuple(names)},
            }
        )
        ids = frozenset(functions()[name].ability_id for name in scene.able)
        abilities = {one.tag: ids | frozenset(map(general, ids)) for one in own} if scene.asked else None
        seen = snapshot([*own, *others], upgrades=scene.upgrades, player=scene.player, abilities=abilities)
        config = task("2s3z", agents=(agent,), max_actions=9)
        return Actor(config).joint(Observer(config).observe(seen), {"A": parse("Actions:\n" + "\n".join(calls))})

    return act


def told(joint: JointAction) -> list[tuple[str, str]]:
    return [(rejection.reason, rejection.message) for rejection in joint.rejections["A"]]


CANNOT = "Team Team-1 cannot do"
STORM_AT = "<Select_Unit_Ability_PsiStorm_Screen(0x100040001, [12, 12])>"
STORMING = "<Ability_PsiStorm_Screen([12, 12])>"
TRAIN = "<Select_Unit_Train_Zealot(0x100040001)>"
MARAUDER = "<Select_Unit_Train_Marauder(0x100040001)>"
ROACH = "<Select_Unit_Train_Roach(0x100040001)>"
RESEARCH = "<Select_Unit_Research_Blink(0x100040001)>"
BLINKING = "<Ability_Blink_Screen([12, 12])>"
POOR = {"minerals": 99, "vespene": 10, "food_cap": 51, "food_used": 50}
CRAMPED = {**RICH, "food_cap": 51}
POWERED = {"is_powered": True}
NOT_NOW = [
    (Scene("Observer"), "<Attack_Unit(0x100180001)>", "Observer has no weapon"),
    (Scene("Observer", ("Scan_Move_screen",)), "<Attack_Unit(0x100180001)>", "Observer has no weapon"),
    (Scene("HighTemplar", fields={"energy": 200.0}), STORMING, "PsiStorm is not researched"),
    (Scene("Barracks"), MARAUDER, "Barracks needs a TechLab for it"),
    (Scene("Larva"), ROACH, "a finished RoachWarren is needed first"),
    (Scene("TwilightCouncil", upgrades=(BLINK,), fields=POWERED), RESEARCH, "Blink is researched already"),
    (
        Scene("HighTemplar", upgrades=(STORM,), fields={"energy": 44.9}),
        STORMING,
        "HighTemplar has 44 energy and it takes 75",
    ),
    (Scene("Gateway", player=POOR, fields=POWERED), TRAIN, "it takes 100 minerals and 99 are left"),
    (
        Scene("TwilightCouncil", player={**RICH, "vespene": 20}, fields=POWERED),
        RESEARCH,
        "it takes 150 vespene and 20 is left",
    ),
    (Scene("Gateway", player=CRAMPED, fields=POWERED), TRAIN, "it takes 2 supply and 1 is left"),
    (Scene("Gateway", fields={**POWERED, "orders": (916,) * 5}), TRAIN, "the queue of Gateway is full"),
    (Scene("Gateway"), TRAIN, "Gateway has no power"),
    (Scene("Stalker"), BLINKING, "Blink is not researched"),
    (
        Scene("Stalker", upgrades=(BLINK,)),
        BLINKING,
        "Stalker cannot again so soon, it takes 7.14 s after each use",
    ),
    (Scene("SiegeTank"), "<Morph_SiegeMode()>", "the game does not let SiegeTank do it now"),
    (
        Scene("SiegeTank", fields={"orders": (16, 16)}),
        "<Morph_SiegeMode()>",
        "the game does not let SiegeTank do it now while it has 2 orders",
    ),
]


@pytest.mark.parametrize(("scene", "call", "why"), NOT_NOW, ids=[why for *_, why in NOT_NOW])
def test_what_the_game_does_not_allow_is_refused_with_the_reason(
    scene: Scene, call: str, why: str, play: Callable[..., JointAction]
) -> None:
    joint = play(scene, call)
    assert joint.commands == ()
    assert told(joint) == [("not_available", f"{CANNOT} {parse(call).calls[0].name} now: {why}.")]


def test_what_is_not_finished_cannot_do_anything(unit: Make, snapshot: Callable[..., Snapshot]) -> None:
    gateway = unit(A, "Gateway", 10, 10, build_progress=0.43)
    seen = snapshot([gateway], player=RICH, abilities={A: frozenset()})
    action = catalogue()["Train_Zealot"]
    assert action.pysc2 is not None
    side = side_of(seen)
    why = why_not(use_of(action.pysc2), side.units[A], side, ledger_of(seen))
    assert why is not None
    assert of_team(why) == "Gateway is still under construction (43%)"


TARGETS = [
    (
        Scene("Zealot", ("Attack_screen",)),
        "<Attack_Unit(0x1001c0001)>",
        "0x1001c0001 is a Phoenix in the air, and no weapon of team Team-1 reaches that.",
    ),
    (
        Scene("VikingFighter", ("Attack_screen",)),
        "<Attack_Unit(0x100180001)>",
        "0x100180001 is a Zealot on the ground, and no weapon of team Team-1 reaches that.",
    ),
    (
        Scene("Phoenix", ("Effect_GravitonBeam_screen",), fields={"energy": 100.0}),
        "<Ability_GravitonBeam(0x100200001)>",
        "0x100200001 is an enemy Hatchery; Ability_GravitonBeam needs a unit that is no structure.",
    ),
    (
        Scene("Phoenix", ("Effect_GravitonBeam_screen",), fields={"energy": 100.0}),
        "<Ability_GravitonBeam(0x1001c0001)>",
        "0x1001c0001 is an enemy Phoenix; Ability_GravitonBeam needs a unit on the ground.",
    ),
    (
        Scene("HighTemplar", ("Effect_Feedback_screen",), fields={"energy": 100.0}),
        "<Ability_Feedback_Unit(0x100180001)>",
        "0x100180001 is an enemy Zealot; Ability_Feedback_Unit needs a unit with energy.",
    ),
    (
        Scene("SCV", ("Effect_Repair_screen",), standing=("Barracks",)),
        "<Effect_Repair_Unit(0x100300001)>",
        "0x100300001 is your own Barracks; Effect_Repair_Unit needs a unit that is hurt.",
    ),
    (
        Scene("Medivac", ("Load_screen",), standing=("Barracks",)),
        "<Load_Unit(0x100300001)>",
        "0x100300001 is your own Barracks; Load_Unit needs a unit that can be carried.",
    ),
]


@pytest.mark.parametrize(("scene", "call", "message"), TARGETS, ids=[message for *_, message in TARGETS])
def test_a_target_that_the_action_cannot_be_used_on_is_refused(
    scene: Scene, call: str, message: str, play: Callable[..., JointAction]
) -> None:
    assert told(play(scene, call)) == [("invalid_target", message)]


@pytest.mark.parametrize(("seen", "refused"), [(2, []), (1, ["invalid_target"]), (0, ["invalid_target"])])
def test_a_place_has_to_be_in_sight_where_the_game_wants_it(
    seen: int, refused: list[str], task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]
) -> None:
    call = "<Effect_KD8Charge_Screen([12, 12])>"
    agent = AgentConfig.model_validate(
        {
            "name": "A",
            "role": "",
            "teams": [{"name": "Team-1", "unit_types": ["Reaper"]}],
            "actions": {"Reaper": ("Effect_KD8Charge_Screen",)},
        }
    )
    config = task("2s3z", agents=(agent,))

    def look(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
        visibility = response.observation.raw_data.map_state.visibility
        visibility.bits_per_pixel, visibility.size.x, visibility.size.y = 8, 32, 32
        visibility.data = bytes([seen]) * (32 * 32)

    now = snapshot([unit(A, "Reaper", 10, 10)], change=look)
    joint = Actor(config).joint(Observer(config).observe(now), {"A": parse(call)})
    assert [rejection.reason for rejection in joint.rejections["A"]] == refused
    words = "[12, 12] is out of your sight; Effect_KD8Charge_Screen needs a place in sight."
    assert [message for _, message in told(joint)] == [words] * len(refused)


# --- which unit of a team does it --------------------------------------------------------------------------------


def test_only_those_that_can_do_it_now_are_told_to(
    task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]
) -> None:
    own = [unit(A, "Stalker", 10, 10), unit(B, "Stalker", 11, 10)]
    blink = functions()["Effect_Blink_screen"].ability_id
    agent = AgentConfig.model_validate(
        {
            "name": "A",
            "role": "",
            "teams": [{"name": "Team-1", "unit_types": ["Stalker"]}],
            "actions": {"Stalker": ("Ability_Blink_Screen",)},
        }
    )
    config = task("2s3z", agents=(agent,))
    seen = snapshot(own, upgrades=(BLINK,), abilities={A: frozenset(), B: frozenset({blink})})
    joint = Actor(config).joint(Observer(config).observe(seen), {"A": parse("<Ability_Blink_Screen([12, 12])>")})
    assert [command.units for command in joint.commands] == [(B,)]


def test_of_several_that_have_too_little_energy_the_best_is_spoken_of(
    task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]
) -> None:
    own = [unit(A, "HighTemplar", 10, 10, energy=10.0), unit(B, "HighTemplar", 11, 10, energy=70.0)]
    agent = AgentConfig.model_validate(
        {
            "name": "A",
            "role": "",
            "teams": [{"name": "Team-1", "unit_types": ["HighTemplar"]}],
            "actions": {"HighTemplar": ("Ability_PsiStorm_Screen",)},
        }
    )
    config = task("2s3z", agents=(agent,))
    seen = snapshot(own, upgrades=(STORM,), abilities={A: frozenset(), B: frozenset()})
    joint = Actor(config).joint(Observer(config).observe(seen), {"A": parse(STORMING)})
    assert "HighTemplar has 70 energy and it takes 75" in told(joint)[0][1]


def test_each_unit_pays_for_itself_as_long_as_the_accounts_last(play: Callable[..., JointAction]) -> None:
    facts = facts_of("multi").ability_of(functions()["Train_Baneling_quick"].ability_id, "Zergling")
    assert facts is not None
    enough_for_two = {**RICH, "minerals": int(2 * facts.minerals), "vespene": int(2 * facts.vespene)}
    scene = Scene("Zergling", ("Train_Baneling_quick",), player=enough_for_two)
    assert [command.units for command in play(scene, "<Morph_Baneling()>").commands] == [(A, B)]


def test_what_an_earlier_call_took_is_gone(play: Callable[..., JointAction]) -> None:
    scene = Scene("Gateway", ("Train_Zealot_quick",), player={**RICH, "minerals": 150}, fields=POWERED)
    joint = play(scene, TRAIN, TRAIN)
    assert len(joint.commands) == 1
    assert told(joint) == [
        ("not_available", f"{CANNOT} Select_Unit_Train_Zealot now: it takes 100 minerals and 50 are left.")
    ]


def test_a_single_caster_spends_its_energy_once(play: Callable[..., JointAction]) -> None:
    scene = Scene("HighTemplar", ("Effect_PsiStorm_screen",), upgrades=(STORM,), fields={"energy": 100.0})
    joint = play(scene, STORM_AT, STORM_AT)
    assert len(joint.commands) == 1
    assert told(joint)[0][1].endswith("now: HighTemplar has 25 energy and it takes 75.")


def test_one_of_a_team_is_enough_to_research(play: Callable[..., JointAction]) -> None:
    scene = Scene("Gateway", ("Morph_WarpGate_quick",), fields=POWERED)
    assert [command.units for command in play(scene, "<Morph_WarpGate()>").commands] == [(A, B, C)]
    scene = Scene("WarpGate", ("TrainWarp_Zealot_screen",), fields=POWERED)
    assert [command.units for command in play(scene, "<TrainWarp_Zealot_Screen([12, 12])>").commands] == [(A,)]


@pytest.mark.parametrize(
    ("unit_type", "call", "why"),
    [
        ("Gateway", TRAIN, None),
        ("Stalker", BLINKING, "Blink is not researched"),
        ("Observer", "<Attack_Unit(0x100180001)>", "Observer has no weapon"),
    ],
)
def test_where_the_game_was_not_asked_only_what_is_sure_is_refused(
    unit_type: str, call: str, why: str | None, play: Callable[..., JointAction]
) -> None:
    joint = play(Scene(unit_type, asked=False, player=POOR), call)
    assert [message for _, message in told(joint)] == (
        [] if why is None else [f"{CANNOT} {parse(call).calls[0].name} now: {why}."]
    )


@pytest.mark.parametrize(
    ("call", "reason", "message"),
    [
        (
            "<Attack_Unit(0x10018)>",
            "unknown_target",
            "No unit 0x10018 is in sight of team Team-1; did you mean 0x100180001 (Zealot)?",
        ),
        (
            "<Attack_Unit(0x1001a0001)>",
            "unknown_target",
            "No unit 0x1001a0001 is in sight of team Team-1; did you mean 0x100180001 (Zealot)?",
        ),
        (
            "<Attack_Unit(0x10018001)>",
            "unknown_target",
            "No unit 0x10018001 is in sight of team Team-1; did you mean 0x100180001 (Zealot)?",
        ),
        (
            "<Attack_Unit(0xfeedf00d)>",
            "unknown_target",
            "No unit 0xfeedf00d is in sight of team Team-1; use a tag that stands in its lists.",
        ),
        (
            "<Select_Unit_Move_Screen(0x10004, [12, 12])>",
            "unknown_target",
            "There is no unit 0x10004; did you mean 0x100040001 (Stalker)?",
        ),
        (
            "<Select_Unit_Attack_Unit(0x100180001, 0x100040001)>",
            "not_yours",
            (
                "0x100180001 is an enemy Zealot, the unit that acts comes first: did you mean "
                "<Select_Unit_Attack_Unit(0x100040001, 0x100180001)>?"
            ),
        ),
        (
            "<Select_Unit_Move_Screen(0x100180001, [12, 12])>",
            "not_yours",
            "0x100180001 is an enemy Zealot and not one of team Team-1; units of team Team-1 are 0x100040001.",
        ),
    ],
)
def test_the_tag_that_was_most_likely_meant_is_named_and_not_taken(
    call: str, reason: str, message: str, play: Callable[..., JointAction]
) -> None:
    joint = play(Scene("Stalker", count=1, asked=False), call)
    assert joint.commands == ()
    assert told(joint) == [(reason, message)]
