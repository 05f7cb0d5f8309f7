"""What is offered is accepted, what is barred is refused for the same reason, and a price is taken once.

Observation, agents' calls and the host's rules ask one judge. These tests ask them about random states of the three
races, and compare what an agent reads: both sentences about an action must mean the same.
"""

from __future__ import annotations

import functools
import random
import re
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from khala_bridge.act.addressee import Addressees
from khala_bridge.act.recognise import recognise
from khala_bridge.act.translate import Command, Translator
from khala_bridge.act.vocabulary import Vocabulary
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import general
from khala_bridge.knowledge import knowledge, upgrades
from khala_bridge.observe import Observer
from khala_bridge.task.config import TaskConfig
from khala_protocol.messages import Rejection
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.catalogue.action import Action
    from khala_bridge.observe import SideObservation
    from khala_bridge.state import Snapshot

RACES = ("protoss", "terran", "zerg")
SIDE = 64
EXAMPLES = settings().max_examples // 3
"""Of each promise and race."""
FIRST, STEP = 0x100040001, 0x40000
FOE, FIELD, GEYSER, PYLON = 0x200040001, 0x200080001, 0x2000C0001, 0x200100001
ABOUT_THE_TARGET = frozenset(
    {"stop_building", "cancel_building", "army_attack", "army_defend", "army_retreat", "scout"}
)
"""Rules about named units or the whole army: whether there are any is not judged beforehand."""
ADDONS = ("Barracks", "Factory", "Starport")


# --- the states -------------------------------------------------------------------------------------------------------


class Own(NamedTuple):
    """One own unit."""

    name: str
    progress: float
    energy: float
    orders: int
    powered: bool
    addon: str
    able: float
    """Share of its abilities that the game would take."""


class State(NamedTuple):
    """The means of a side."""

    units: tuple[Own, ...]
    player: dict[str, int]
    upgrades: tuple[int, ...]
    asked: bool
    chance: Any


@functools.cache
def types(race: str) -> tuple[str, ...]:
    kinds = (kind for kind in knowledge().values() if kind.race == race and kind.melee and kind.ability_ids)
    return tuple(kind.name for kind in kinds)


@functools.cache
def busy(name: str) -> int:
    """Return an ability that a unit of a type works on."""
    return knowledge()[name].ability_ids[-1]


MAKERS = {
    "protoss": ("Nexus", "Gateway", "WarpGate", "Forge", "Stargate", "RoboticsFacility", "TwilightCouncil", "Probe"),
    "terran": ("CommandCenter", "Barracks", "Factory", "Starport", "EngineeringBay", "OrbitalCommand", "SCV"),
    "zerg": ("Hatchery", "Larva", "Cocoon", "Roach", "Hydralisk", "Corruptor", "Zergling", "Spire", "Queen", "Drone"),
}
NEEDED = {
    "protoss": ("CyberneticsCore", "Pylon", "FleetBeacon"),
    "terran": ("SupplyDepot", "Armory", "Factory"),
    "zerg": ("SpawningPool", "RoachWarren", "LurkerDen", "GreaterSpire", "Lair", "Hive"),
}
AMOUNTS = st.sampled_from((0, 20, 24, 25, 49, 50, 75, 99, 100, 149, 150, 175, 225, 299, 300, 450, 2000))


@st.composite
def states(draw: st.DrawFn, race: str) -> State:
    """Return random means of a side: a few units and structures, accounts, upgrades, and the game's answers."""
    pools = (MAKERS[race], NEEDED[race], types(race))
    names = draw(st.lists(st.one_of(*map(st.sampled_from, pools)), min_size=1, max_size=7))
    known = [upgrade.id for upgrade in upgrades().values() if upgrade.race == race and upgrade.melee]
    return State(
        tuple(draw(own(name)) for name in names if name in knowledge()),
        {
            "minerals": draw(AMOUNTS),
            "vespene": draw(AMOUNTS),
            "food_cap": 50,
            "food_used": draw(st.sampled_from((10, 45, 46, 47, 48, 49, 50, 54))),
        },
        tuple(draw(st.sets(st.sampled_from(known), max_size=6))),
        draw(st.integers(0, 4)) > 0,
        draw(st.randoms(use_true_random=False)),
    )


@st.composite
def own(draw: st.DrawFn, name: str) -> Own:
    """Return a random unit of a type."""
    kind = knowledge()[name]
    return Own(
        name,
        draw(st.sampled_from((1.0, 1.0, 1.0, 1.0, 0.3, 0.997))),
        min(draw(st.sampled_from((0.0, 24.9, 25.0, 49.96, 50.0, 74.96, 125.0, 200.0))), kind.energy),
        draw(st.sampled_from((0, 0, 0, 0, 1, 2, 5, 8))) if kind.structure else draw(st.sampled_from((0, 0, 1))),
        draw(st.integers(0, 3)) > 0 or not kind.needs_power,
        draw(st.sampled_from(("", "TechLab", "Reactor"))) if name in ADDONS else "",
        draw(st.sampled_from((1.0, 1.0, 0.6, 0.0))),
    )


# --- the side in such a state -----------------------------------------------------------------------------------------


@functools.cache
def config(race: str) -> TaskConfig:
    """Return a task with one agent for every unit of a race, and one for the whole side."""
    actions = {
        name: tuple(a.name for a in catalogue().values() if a.subject != "side" and a.fits(name))
        for name in types(race)
    }
    side = tuple(a.name for a in catalogue().values() if a.subject == "side" and a.race in (race, None))
    agent = {
        "name": "A",
        "role": "",
        "admits": "any",
        "teams": [{"name": "Own", "unit_types": types(race)}, {"name": "Side", "kind": "side", "actions": side}],
        "actions": actions,
    }
    return TaskConfig.model_validate({"name": "t", "map": "2s3z", "task": "", "max_actions": 9, "agents": [agent]})


@functools.cache
def vocabulary(race: str) -> Vocabulary:
    return Vocabulary(config(race).agents[0])


@pytest.fixture
def look(
    unit: Callable[..., Any], snapshot: Callable[..., Snapshot], plain: Any
) -> Callable[[str, State], SideObservation]:
    """Return the observation of the agent of a race in a state."""

    def see(race: str, state: State) -> SideObservation:
        made: list[Any] = []
        able: dict[int, frozenset[int]] = {}
        for number, one in enumerate(state.units):
            tag = FIRST + STEP * number
            body = unit(
                tag, one.name, 8 + 6 * (number % 8), 8 + 8 * (number // 8), build_progress=one.progress,
                energy=one.energy, energy_max=200.0, is_powered=one.powered, orders=(busy(one.name),) * one.orders,
            )  # fmt: skip
            if one.addon:
                body.add_on_tag = tag + 0x10000000
                made.append(unit(body.add_on_tag, f"{one.name}{one.addon}", body.pos.x + 2.5, body.pos.y - 0.5))
                able[body.add_on_tag] = frozenset()
            made.append(body)
            numbers = [n for n in knowledge()[one.name].ability_ids if state.chance.random() < one.able]
            able[tag] = frozenset((*numbers, *map(general, numbers)))
        made += [
            unit(FOE, "Zealot", 30, 30, alliance="enemy"),
            unit(FIELD, "MineralField", 40, 40, alliance="neutral", mineral_contents=1800),
            unit(GEYSER, "VespeneGeyser", 40.5, 48.5, alliance="neutral", vespene_contents=2250),
        ]
        seen = snapshot(
            made, size=(SIDE, SIDE), upgrades=state.upgrades, player=state.player,
            abilities=able if state.asked else None, change=plain,
        )  # fmt: skip
        return Observer(config(race)).observe(seen)

    return see


def judged(names: list[str], chance: Any, most: int) -> list[Action]:
    """Return some actions of a team that are judged before they are called."""
    found = [catalogue()[name] for name in names]
    found = [a for a in found if a.rule not in ABOUT_THE_TARGET and a.subject != "two_units"]
    chosen: list[Action] = chance.sample(found, min(most, len(found)))
    return chosen


def calls(observation: SideObservation, action: Action) -> list[str]:
    """Return an action as it may be written: by each unit that it may name, at each target that there is."""
    tags = observation.agents["A"].teams[0].team.tags
    listed, units = observation.agents["A"].agent.actions, observation.agents["A"].teams[0].view.units
    named = [unit.tag for unit in units if action.name in listed[unit.type]] if action.actor_count else [""]
    targets = {
        None: [""],
        "screen": ["[12, 12]"],
        "minimap": ["[32, 32]"],
        "tag": [hex(tag) for tag in (FOE, FIELD, GEYSER, *tags)],
    }[action.target_kind]
    return [f"<{action.name}({', '.join(filter(None, (who, at)))})>" for who in named for at in targets]


class Answer(NamedTuple):
    """The result of a call."""

    commands: list[Command]
    why: str | None
    """Why no unit can do it now; None if it is done, or if only its target or place is wrong."""
    spent: tuple[float, float, float]


def answer(race: str, observation: SideObservation, team: int, call: str) -> Answer:
    """Say a call in a turn of its own."""
    translator = Translator(observation, {"A": 9})
    ledger = translator.ledger
    before = ledger.minerals, ledger.vespene, ledger.supply
    seen = observation.agents["A"]
    text = f"Actions:\n    Team {seen.teams[team].view.name}:\n        {call}"
    recognised = recognise(parse(text).calls[0], vocabulary(race), Addressees(seen, vocabulary(race)))
    assert not isinstance(recognised, Rejection), recognised
    (said,) = recognised
    result = translator.translate(said)
    spent = before[0] - ledger.minerals, before[1] - ledger.vespene, before[2] - ledger.supply
    if isinstance(result, Rejection):
        why = result.message if result.reason == "not_available" and not GROUND.search(result.message) else None
        return Answer([], why, spent)
    return Answer(result, None, spent)


# --- what sentences mean ----------------------------------------------------------------------------------------------

GROUND = re.compile(
    "no room|free geyser|place for a town hall|power field|mineral field|not boosted yet|has it already|free creep|"
    "where the add-on|has an add-on already"
)
"""Words about the place or the target, which are not judged before there is one."""
NO_TARGET = re.compile(
    "^(no (room|free|enemy|unit that fits|place|power field with|mineral field|army|base)|nothing|needs two"
    "|every finished)"
)
"""Reasons about the place or the target: the screen shows none, and a call is judged by the one that it names."""
MEANINGS = (
    ("price", r"(?P<price>\d+(\.\d+)?) more (?P<what>\w+) needed"),
    (
        "price",
        r"it (takes|costs|needs) (?P<of>\d+(\.\d+)?) (?P<what>minerals|vespene|supply) and (?P<has>-?[\d.]+) (are|is)",
    ),
    ("energy", r"needs (?P<of>\d+(\.\d+)?) energy, there is (?P<has>\d+)"),
    ("energy", r"needs (?P<of>\d+(\.\d+)?) energy, and your \w+ \w+ has (?P<has>\d+)"),
    ("energy", r"has (?P<has>-?\d+) energy and it takes (?P<of>\d+(\.\d+)?)"),
    ("addon", r"(needs|has) a (?P<what>TechLab|Reactor)"),
    ("researching", r"being researched"),
    ("researched", r"researched already"),
    ("upgrade", r"^(?P<what>\w+) is not researched"),
    ("upgrade", r"now: (?P<what>\w+)( and \w+)? (is|are) not researched"),
    ("upgrade", r"it needs the upgrade (?P<what>\w+)"),
    ("unfinished", r"(?P<what>\w+) is (still under construction|not finished yet)"),
    ("occupied", r"free to build"),
    ("missing", r"^no (?P<what>\w+)( or \w+)*(,|$)"),
    ("missing", r"(?P<what>\w+) is not finished"),
    ("missing", r"you have no (finished )?(?P<what>\w+)"),
    ("missing", r"a finished (?P<what>\w+)"),
    ("weapon", r"(?P<what>\w+) has no weapon"),
    ("disarmed", r"weapon of (your )?(?P<what>\w+) is off"),
    ("power", r"has no power|has power"),
    ("queue", r"queue of .* is full"),
    ("at_work", r"is at work"),
    ("cooldown", r"cooling down|cannot again so soon|recharges"),
    ("ability", r"^\w+ cannot$|has no such ability"),
    ("game", r"not in its present state|the game lets no|the game does not"),
)


def meaning(sentence: str) -> tuple[str, ...]:
    """Return the reason in a sentence, with what is missing and how much of it."""
    for kind, pattern in MEANINGS:
        if found := re.search(pattern, sentence):
            said = found.groupdict()
            if "price" in said:
                return kind, said["what"], f"{float(said['price']):g}"
            if kind == "price":
                return kind, said["what"], f"{float(said['of']) - float(said['has']):g}"
            more = [f"{said[key]}" for key in ("what", "of", "has") if said.get(key)]
            return ("missing" if kind == "unfinished" else kind, *more)
    raise AssertionError(f"a sentence that nothing is known of: {sentence!r}")


# --- the three promises -----------------------------------------------------------------------------------------------


def over_states() -> Callable[[Any], Any]:
    relaxed = settings(
        max_examples=EXAMPLES, derandomize=True, phases=(Phase.generate, Phase.shrink),
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )  # fmt: skip

    def decorate(test: Any) -> Any:
        return pytest.mark.parametrize("race", RACES)(relaxed(given(data=st.data())(test)))

    return decorate


@over_states()
def test_what_is_offered_is_accepted(race: str, look: Any, data: st.DataObject) -> None:
    state = data.draw(states(race))
    observation = look(race, state)
    for number, team in enumerate(observation.agents["A"].teams):
        names = [spec.name for spec in team.view.actions]
        for action in judged(names, state.chance, 12):
            tried = [answer(race, observation, number, call).why for call in calls(observation, action)]
            assert None in tried, f"{action.name} is offered, and refused: {tried[0]}"


@over_states()
def test_what_is_barred_is_refused_for_the_same_reason(race: str, look: Any, data: st.DataObject) -> None:
    state = data.draw(states(race))
    observation = look(race, state)
    for number, team in enumerate(observation.agents["A"].teams):
        reasons = {barred.action: barred.reason for barred in team.view.barred}
        for action in judged(list(reasons), state.chance, 12):
            if NO_TARGET.search(reasons[action.name]):
                continue
            tried = [answer(race, observation, number, call) for call in calls(observation, action)]
            done = [one.commands for one in tried if one.commands]
            assert not done, f"{action.name} is barred ({reasons[action.name]}), and done: {done}"
            told = {meaning(one.why) for one in tried if one.why is not None}
            if action.rule is None or told:  # a rule may stumble over its place or target before
                assert meaning(reasons[action.name]) in told, (
                    f"{action.name} is barred ({reasons[action.name]}), and refused for another reason: {tried}"
                )


@over_states()
def test_a_price_is_taken_once(race: str, look: Any, data: st.DataObject) -> None:
    state = data.draw(states(race))
    observation = look(race, state)
    for number, team in enumerate(observation.agents["A"].teams):
        prices = {offer.action: (offer.minerals, offer.vespene, offer.supply) for offer in team.view.offers}
        free = [spec.name for spec in team.view.actions if spec.name not in prices]
        asked = [*judged(list(prices), state.chance, 9), *judged(free, state.chance, 3)]
        for action in asked:
            for call in calls(observation, action):
                said = answer(race, observation, number, call)
                paid = sum(len(command.units) for command in said.commands if command.function == action.pysc2)
                price = tuple(paid * one for one in prices.get(action.name, (0, 0, 0)))
                assert said.spent == price, f"{call} is offered for {price} in all and takes {said.spent}"


@pytest.mark.parametrize("left", [0, 1, 2])
@pytest.mark.parametrize(
    ("kind", "needs", "action", "supply"),
    [("Roach", "RoachWarren", "Train_Ravager", 1), ("Hydralisk", "LurkerDen", "Train_Lurker", 1),
     ("Corruptor", "GreaterSpire", "Train_BroodLord", 2)],
)  # fmt: skip
def test_a_morph_takes_the_supply_that_it_is_offered_for(
    kind: str, needs: str, action: str, supply: int, left: int, look: Any
) -> None:
    unit = Own(kind, 1.0, 0.0, 0, True, "", 1.0 if left >= supply else 0.0)
    player = {"minerals": 999, "vespene": 999, "food_cap": 50, "food_used": 50 - left}
    state = State((unit, unit, Own(needs, 1.0, 0.0, 0, True, "", 0.0)), player, (), True, random.Random(1))
    observation = look("zerg", state)
    side = observation.agents["A"].teams[1].view
    offers = {offer.action: (offer.supply, offer.times) for offer in side.offers}
    said = answer("zerg", observation, 1, f"<{action}()>")
    if left < supply:
        assert action not in offers
        assert said.why is not None
        assert f"it needs {supply} supply and {left} is free" in said.why
    else:
        assert offers[action] == (supply, left // supply)
        assert said.spent[2] == supply
