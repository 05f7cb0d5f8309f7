"""The agent and the team of each unit."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import raw_pb2

from khala_bridge.compat import units as pysc2_units
from khala_bridge.knowledge import facts_of
from khala_bridge.knowledge.forms import FORMS, form_of, forms_of
from khala_bridge.state import PlayerState, Unit, read_unit
from khala_bridge.state.teams import TeamRoster
from khala_bridge.task.config import AgentConfig, TaskConfig

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

TYPES = (
    "Zealot Stalker Probe Observer WarpPrism Gateway WarpGate HighTemplar Archon "
    "Roach Zergling Baneling SiegeTank PhotonCannon"
)
ORDERS = dict.fromkeys(TYPES.split(), ("Stop",))


def agent(name: str, *teams: dict[str, Any], admits: str = "combat") -> AgentConfig:
    return AgentConfig.model_validate({"name": name, "role": "", "admits": admits, "teams": teams, "actions": ORDERS})


def team(name: str, *types: str, kind: str = "group") -> dict[str, Any]:
    return {"name": name, "unit_types": types, "kind": kind}


def _read(units: Iterable[raw_pb2.Unit]) -> list[Unit]:
    return [read for unit in units if (read := read_unit(unit, facts_of("multi"))) is not None]


def grouped(agents: Iterable[AgentConfig], units: Iterable[raw_pb2.Unit], **player: int) -> dict[str, list[int]]:
    roster = TeamRoster(agents)
    roster.update(_read(sorted(units, key=lambda unit: unit.tag)), PlayerState(**player))
    return {t.name: list(t.tags) for a in agents for t in roster.teams(a.name)}


def test_a_group_fills_the_smallest_team_first_up_to_four_units_each(unit: Callable[..., raw_pb2.Unit]) -> None:
    agents = [agent("A", team("Z-1", "Zealot"), team("Z-2", "Zealot"))]
    zealots = [unit(tag, "Zealot", 10, 10) for tag in range(1, 8)]
    assert grouped(agents, zealots) == {"Z-1": [1, 3, 5, 7], "Z-2": [2, 4, 6]}


def test_a_full_group_takes_a_unit_to_the_team_whose_head_is_nearest(unit: Callable[..., raw_pb2.Unit]) -> None:
    agents = [agent("A", team("Z-1", "Zealot"), team("Z-2", "Zealot"))]
    zealots = [unit(tag, "Zealot", 10 if tag % 2 else 30, 10) for tag in range(1, 9)]
    late = [unit(9, "Zealot", 28, 10), unit(10, "Zealot", 27, 10)]
    assert grouped(agents, [*zealots, *late]) == {"Z-1": [1, 3, 5, 7], "Z-2": [2, 4, 6, 8, 9, 10]}


def test_other_kinds_take_the_head_within_15_then_an_empty_team_then_the_nearest_head(
    unit: Callable[..., raw_pb2.Unit],
) -> None:
    teams = [team(name, "Zealot", kind="select_all_type") for name in ("Z-1", "Z-2")]
    places = {1: 10, 2: 24.9, 3: 60, 4: 76, 5: 27}
    zealots = [unit(tag, "Zealot", x, 10) for tag, x in places.items()]
    assert grouped([agent("A", *teams)], zealots) == {"Z-1": [1, 2, 5], "Z-2": [3, 4]}


def test_of_a_select_team_every_unit_is_a_team_with_a_number_of_its_own(unit: Callable[..., raw_pb2.Unit]) -> None:
    agents = [agent("A", team("Obs", "Observer", kind="select"))]
    roster = TeamRoster(agents)
    for tags in ([1, 2], [2], [2, 3]):
        roster.update(_read([unit(tag, "Observer", 9, 9) for tag in tags]), PlayerState())
    assert [(t.name, t.tags) for t in roster.teams("A")] == [("Obs-2", (2,)), ("Obs-3", (3,))]


@pytest.mark.parametrize(
    ("admits", "types", "player", "taken"),
    [
        ("combat", "Probe Probe Zealot", {}, [1, 3]),  # one scout, while there is nothing else
        ("combat", "Zealot Probe", {}, [1]),
        ("builder", "Probe Probe Probe", {"food_workers": 31}, [1, 2]),
        ("builder", "Probe", {}, []),
        ("defender", "Zealot Zealot Zealot", {"food_army": 15}, [1]),
        ("defender", "Zealot Zealot Zealot", {"food_army": 16}, [1, 2]),
        ("any", "Probe Probe Zealot", {}, [1, 2, 3]),
    ],
)
def test_an_agent_takes_what_it_admits(
    admits: str, types: str, player: dict[str, int], taken: list[int], unit: Callable[..., raw_pb2.Unit]
) -> None:
    agents = [agent("A", team("T", "Zealot", "Probe"), admits=admits)]
    units = [unit(tag, name, 5, 5) for tag, name in enumerate(types.split(), 1)]
    assert grouped(agents, units, **player) == ({"T": taken} if taken else {})


def test_what_one_agent_does_not_admit_goes_to_the_next(unit: Callable[..., raw_pb2.Unit]) -> None:
    agents = [agent("D", team("T-1", "Zealot"), admits="defender"), agent("C", team("T-2", "Zealot"))]
    zealots = [unit(tag, "Zealot", 5, 5) for tag in (1, 2, 3)]
    assert grouped(agents, zealots, food_army=6) == {"T-1": [1], "T-2": [2, 3]}


def test_a_unit_beside_a_transport_goes_to_the_airborne_agent(unit: Callable[..., raw_pb2.Unit]) -> None:
    agents = [
        agent("C", team("Z", "Zealot")),
        agent("Air", team("Drop", "Zealot"), team("Prism", "WarpPrism"), admits="airborne"),
    ]
    units = [unit(1, "WarpPrism", 50, 50), unit(2, "Zealot", 53.9, 50), unit(3, "Zealot", 54, 50)]
    assert grouped(agents, units) == {"Prism": [1], "Drop": [2], "Z": [3]}


def test_a_unit_that_is_not_finished_or_not_listed_is_nobodys(unit: Callable[..., raw_pb2.Unit]) -> None:
    agents = [agent("A", team("Z", "Zealot"))]
    assert grouped(agents, [unit(1, "Zealot", 5, 5, build_progress=0.9), unit(2, "Observer", 5, 5)]) == {}


def test_the_head_is_the_oldest_unit_and_stays_it(unit: Callable[..., raw_pb2.Unit]) -> None:
    roster = TeamRoster([agent("A", team("Z", "Zealot"))])
    heads = []
    for tags in ([5, 7], [3, 5, 7], [3, 7], [3, 5, 7]):
        roster.update(_read([unit(tag, "Zealot", 5, 5) for tag in tags]), PlayerState())
        (z,) = roster.teams("A")
        heads.append((z.head, z.tags))
    assert heads == [(5, (5, 7)), (5, (5, 7, 3)), (7, (7, 3)), (7, (7, 3, 5))]


def test_a_unit_that_comes_back_returns_to_its_team(unit: Callable[..., raw_pb2.Unit]) -> None:
    roster = TeamRoster([agent("A", team("Z-1", "Zealot"), team("Z-2", "Zealot"))])
    for tags in ([1, 2], [1], [1, 2]):
        roster.update(_read([unit(tag, "Zealot", 5, 5) for tag in tags]), PlayerState())
    assert [t.tags for t in roster.teams("A")] == [(1,), (2,)]


def test_a_team_without_units_is_named_as_idle(unit: Callable[..., raw_pb2.Unit]) -> None:
    roster = TeamRoster([agent("A", team("Z-1", "Zealot"), team("Z-2", "Zealot"))])
    roster.update(_read([unit(1, "Zealot", 5, 5)]), PlayerState())
    assert roster.idle_teams("A") == ("Z-2",)


def test_the_army_of_2s3z_is_grouped_as_in_the_paper(
    task: Callable[..., TaskConfig], unit: Callable[..., raw_pb2.Unit]
) -> None:
    army = [unit(tag, "Stalker" if tag < 3 else "Zealot", 9, 16) for tag in range(1, 6)]
    assert {n: len(t) for n, t in grouped(task("2s3z").agents, army).items()} == {
        "Zealot-1": 2,
        "Zealot-2": 1,
        "Stalker-1": 2,
    }


def test_a_side_team_has_no_units_and_is_always_there() -> None:
    side = {"name": "Base", "kind": "side", "actions": ["All_Units_Attack"]}
    roster = TeamRoster([agent("D", side, team("Z", "Zealot"))])
    roster.update([], PlayerState())
    assert [(t.name, t.kind, t.tags) for t in roster.teams("D")] == [("Base", "side", ())]
    assert roster.idle_teams("D") == ("Z",)


# --- units that change their type -----------------------------------------------------------------------------

NUMBERS = {
    member.name: int(member) for race in (pysc2_units.Protoss, pysc2_units.Terran, pysc2_units.Zerg) for member in race
}
"""Unit types as the game counts them, with forms that `knowledge` need not have."""


def followed(
    agents: list[AgentConfig], *moments: dict[int, str], at: dict[int, float] | None = None
) -> list[dict[int, str]]:
    """Return the agent and team of every unit at each moment; a moment holds the present types of the units."""
    roster = TeamRoster(agents)
    found: list[dict[int, str]] = []
    for moment in moments:
        own = [raw_pb2.Unit(tag=tag, unit_type=NUMBERS[name], build_progress=1) for tag, name in sorted(moment.items())]
        for unit in own:
            unit.pos.x = (at or {}).get(unit.tag, 10.0)
        roster.update(_read(own), PlayerState(food_workers=12))
        found.append({tag: f"{t.agent} {t.name}" for a in agents for t in roster.teams(a.name) for tag in t.tags})
    return found


def test_a_gateway_that_becomes_a_warp_gate_goes_to_the_team_that_lists_it() -> None:
    agents = [agent("A", team("Gates", "Gateway")), agent("D", team("Warp", "WarpGate", kind="select_all_type"))]
    assert followed(
        agents, {1: "Gateway", 2: "Gateway"}, {1: "WarpGate", 2: "Gateway"}, {1: "Gateway", 2: "Gateway"}
    ) == [
        {1: "A Gates", 2: "A Gates"},
        {1: "D Warp", 2: "A Gates"},
        {1: "A Gates", 2: "A Gates"},
    ]


@pytest.mark.parametrize(
    ("listed", "form"),
    [
        ("Observer", "ObserverSurveillanceMode"),
        ("WarpPrism", "WarpPrismPhasing"),
        ("Gateway", "WarpGate"),
        ("SiegeTank", "SiegeTankSieged"),
        ("Roach", "RoachBurrowed"),
        ("Roach", "RavagerCocoon"),
        ("Zergling", "BanelingCocoon"),
    ],
)
def test_a_unit_in_another_form_stays_if_no_team_lists_the_form(listed: str, form: str) -> None:
    agents = [agent("A", team("First", listed), team("Second", listed))]
    moments = ({1: listed, 2: listed}, {1: form, 2: listed}, {1: listed, 2: form})
    assert followed(agents, *moments) == [{1: "A First", 2: "A Second"}] * 3


def test_a_unit_first_seen_in_another_form_is_grouped_as_what_it_is_a_form_of() -> None:
    assert followed([agent("A", team("Tanks", "SiegeTank"))], {1: "SiegeTankSieged"}) == [{1: "A Tanks"}]


def test_a_unit_that_becomes_something_no_team_lists_is_nobodys_from_then_on() -> None:
    agents = [agent("A", team("Lings", "Zergling"))]
    moments = ({1: "Zergling", 2: "Zergling"}, {1: "BanelingCocoon", 2: "Zergling"}, {1: "Baneling", 2: "Zergling"})
    assert followed(agents, *moments) == [{1: "A Lings", 2: "A Lings"}, {1: "A Lings", 2: "A Lings"}, {2: "A Lings"}]


def test_the_archon_of_two_templar_is_grouped_as_a_new_unit() -> None:
    agents = [agent("Main", team("Archons", "Archon")), agent("Casters", team("Templar", "HighTemplar"))]
    moments = ({1: "HighTemplar", 2: "HighTemplar"}, {3: "Archon"})
    assert followed(agents, *moments) == [{1: "Casters Templar", 2: "Casters Templar"}, {3: "Main Archons"}]


def test_a_unit_that_was_carried_away_returns_to_its_team_where_it_is_set_down() -> None:
    agents = [
        agent("Air", team("Drop", "Zealot"), team("Prism", "WarpPrism"), admits="airborne"),
        agent("C", team("Z", "Zealot")),
    ]
    everybody = {1: "WarpPrism", 2: "Zealot", 3: "Zealot"}
    moments = ({2: "Zealot", 3: "Zealot"}, everybody, {1: "WarpPrism", 3: "Zealot"}, everybody)
    (*_, last) = followed(agents, *moments)
    assert last == {1: "Air Prism", 2: "C Z", 3: "C Z"}


def test_a_dead_builder_is_replaced_by_the_next_worker() -> None:
    agents = [agent("B", team("Builder", "Probe"), admits="builder")]
    moments = ({1: "Probe", 2: "Probe", 3: "Probe"}, {2: "Probe", 3: "Probe"}, {3: "Probe"})
    assert followed(agents, *moments) == [{1: "B Builder"}, {2: "B Builder"}, {3: "B Builder"}]


def test_structures_answer_to_whoever_lists_their_type() -> None:
    agents = [agent("C", team("Z", "Zealot")), agent("D", team("Guns", "PhotonCannon"))]
    assert followed(agents, {1: "PhotonCannon", 2: "Nexus", 3: "Zealot"}) == [{1: "D Guns", 3: "C Z"}]


def test_every_form_and_what_it_is_a_form_of_is_a_unit_of_pysc2() -> None:
    assert {name for pair in FORMS.items() for name in pair} <= NUMBERS.keys()
    by_suffix = {name: base for name in NUMBERS if name not in FORMS and (base := form_of(name))}
    assert set(by_suffix.values()) <= NUMBERS.keys()
    assert not {"Locust", "Burrowed"} & by_suffix.keys()


def test_forms_of_forms_are_forms() -> None:
    assert forms_of("CommandCenter") == (
        "CommandCenterFlying", "OrbitalCommand", "OrbitalCommandFlying", "PlanetaryFortress",
    )  # fmt: skip
    assert "Hive" in forms_of("Hatchery")
    assert forms_of("Stalker") == ()


def test_two_hundred_units_are_kept_in_order_in_a_few_milliseconds() -> None:
    agents = [agent("B", team("Builder", "Probe"), admits="builder"), agent("C", team("Z", "Zealot", "Stalker"))]
    names = ["Probe"] * 70 + ["Zealot"] * 60 + ["Stalker"] * 50 + ["Nexus"] * 20
    own = _read(raw_pb2.Unit(tag=n, unit_type=NUMBERS[name], build_progress=1) for n, name in enumerate(names, 1))
    roster, player, took_s = TeamRoster(agents), PlayerState(food_workers=70), []
    for _ in range(20):
        began = time.perf_counter()
        roster.update(own, player)
        took_s.append(time.perf_counter() - began)
    assert len(roster.teams("C")[0].tags) == 110
    assert min(took_s) < 0.005  # 0.5 ms on an idle machine
