"""A worked example for an agent: a made-up moment in the words of its own observations, and a reply that follows.

The moment is a view like any other, written by the same sections, so its form is always that of the real ones. The
reply uses the agent's own teams and actions, and says in its analysis why. Its tags are shorter than those of a game,
so that a copied one is noticed at once. An agent whose actions fit none of the moments has no example.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.knowledge import facts_of
from khala_bridge.observe.observation import AgentObservation
from khala_bridge.observe.text.page import Page, find_sections, render
from khala_bridge.observe.text.words import plural
from khala_protocol.messages import (
    Army,
    ArmyPart,
    Counts,
    Economy,
    Example,
    Landmark,
    Place,
    Resources,
    TeamView,
    TypeCount,
    UnitView,
    View,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.knowledge import MapFacts
    from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig

_FOES: dict[str, str] = {"protoss": "Zealot", "terran": "Marine", "zerg": "Zergling"}
_OWN_TAGS, _FOE_TAGS = ("0xe0001", "0xe0002"), ("0xe0011", "0xe0012")
_HALL_TAG = "0xe0021"


class _Builds(NamedTuple):
    """The names of a race's first steps."""

    worker: str
    hall: str
    supply: str
    """Action that adds supply."""
    production: str
    """The first structure that trains an army, or allows one."""


_RACES: dict[str, _Builds] = {
    "protoss": _Builds("Probe", "Nexus", "Build_Pylon", "Gateway"),
    "terran": _Builds("SCV", "CommandCenter", "Build_SupplyDepot", "Barracks"),
    "zerg": _Builds("Drone", "Hatchery", "Train_Overlord", "SpawningPool"),
}


class _Reply(NamedTuple):
    analysis: str
    calls: Sequence[str]
    team: str = ""
    message: tuple[str, str] | None = None
    """To whom, and what."""

    def text(self) -> str:
        lines = [f"Analysis: {self.analysis}"]
        if self.calls:
            lines += ["Actions:", f"    Team {self.team}:", *(f"        {call}" for call in self.calls)]
        if self.message:
            lines += ["Communications:", f"    <MessageTo({self.message[0]}, '''{self.message[1]}''')>"]
        return "\n".join(lines)


def example(task: TaskConfig, agent: AgentConfig) -> Example | None:
    """Return a worked example for an agent of a task; None if its actions fit none."""
    makers = {"combat_group": _fight, "developer": _economy, "builder": _site, "commander": _army}
    made = makers[agent.kind](task, agent)
    if made is None:
        return None
    view, sections, reply = made
    observation = AgentObservation(agent, game_loop=0, view=view, teams=(), idle_teams=())
    page = Page(observation, task)
    return Example(observation=render(page, find_sections(sections)), reply=reply.text())


_Made = tuple[View, tuple[str, ...], _Reply]


def _foe(task: TaskConfig) -> str:
    return _FOES.get(str(task.map_spec.opponent), "Zergling")


def _action_names(actions: Sequence[str]) -> frozenset[str]:
    return frozenset(catalogue()[name].name for name in actions)


def _first_contact(task: TaskConfig, agent: AgentConfig, text: str) -> tuple[str, str] | None:
    contacts = task.correspondents(agent)
    return (contacts[0].name, text) if contacts else None


def _unit(
    facts: MapFacts, name: str, tag: str, at: tuple[float, float], share: float = 1.0, distance: float | None = None
) -> UnitView:
    known = facts.units[name]
    return UnitView(
        tag=tag,
        type=name,
        alliance="own" if distance is None else "enemy",
        screen=at,
        minimap=(30.0, 22.0),
        health=round(share * known.health, 1),
        health_max=known.health,
        shield=round(share * known.shield, 1),
        shield_max=known.shield,
        weapon_cooldown_s=0.0 if distance is None and facts.is_armed(name) else None,
        distance=distance,
    )


# --- combat groups --------------------------------------------------------------------------------------------


def _fight(task: TaskConfig, agent: AgentConfig) -> _Made | None:
    """Two units, one of them hurt, meet two enemies, one of which is hurt."""
    team = next((team for team in agent.teams if team.unit_types), None)
    if team is None:
        return None
    kind = team.unit_types[0]
    can = _action_names(agent.actions[kind])
    foe = _foe(task)
    facts = facts_of(task.map_data)
    own = [_unit(facts, kind, _OWN_TAGS[0], (12, 12))]
    if team.kind != "select":
        own.append(_unit(facts, kind, _OWN_TAGS[1], (13, 12.5), share=0.25))
    foes = (
        _unit(facts, foe, _FOE_TAGS[0], (17, 12), distance=4.6),
        _unit(facts, foe, _FOE_TAGS[1], (18, 13), 0.4, distance=5.6),
    )
    view = View(
        time_s=95, teams=(TeamView(name=_team_name(team), minimap=(30.0, 22.0), units=tuple(own), enemies=foes),)
    )
    if len(own) == 1:
        can -= {"Select_Unit_Move_Screen"}
    reply = _fighting(kind, can, foe, armed=facts.is_armed(kind))
    if reply is None:
        return None
    said = _first_contact(task, agent, f"2 {plural(foe)} near [30, 22] of the minimap.")
    calls = reply.calls[: task.max_actions_of(agent)]
    return view, ("game", "teams"), reply._replace(team=_team_name(team), calls=calls, message=said)


def _team_name(team: TeamConfig) -> str:
    return f"{team.name}-1" if team.kind == "select" else team.name


def _fighting(kind: str, can: frozenset[str], foe: str, *, armed: bool) -> _Reply | None:
    back = "<Select_Unit_Move_Screen(0xe0002, [6, 12])>"
    if "Attack_Unit" in can and armed:
        calls = [f"<Attack_Unit({_FOE_TAGS[1]})>", *([back] if "Select_Unit_Move_Screen" in can else [])]
        saved = f" My {kind} {_OWN_TAGS[1]} has a quarter of its life left and steps back." if len(calls) > 1 else ""
        return _Reply(
            f"Two {plural(foe)} are near; {_FOE_TAGS[1]} has less life left, so all attack it first.{saved}", calls
        )
    if "Move_Screen" in can:
        analysis = f"Two {plural(foe)} come nearer, and a {kind} cannot fight them: away from here."
        return _Reply(analysis, ["<Move_Screen([4, 12])>"])
    return None


# --- those who lead the whole side ----------------------------------------------------------------------------


def _side_team(agent: AgentConfig) -> TeamConfig | None:
    return next((team for team in agent.teams if team.kind == "side"), None)


def _counts(race: str) -> Counts:
    names = _RACES[race]
    return Counts(
        units=(TypeCount(type=names.worker, ready=14, idle=0),),
        structures=(TypeCount(type=names.hall, ready=1, idle=1),),
    )


def _economy(task: TaskConfig, agent: AgentConfig) -> _Made | None:
    """Supply is nearly used up, the town hall is idle, and there are 210 minerals."""
    race = task.map_spec.race
    team = _side_team(agent)
    if race not in _RACES or team is None:
        return None
    names = _RACES[race]
    can = _action_names(team.actions)
    train = f"Train_{names.worker}"
    calls = [f"<{name}()>" for name in (names.supply, train) if name in can]
    if not calls:
        return None
    supply = f"One supply is left, so {names.supply} comes first. " if names.supply in can else ""
    cost = 100 * (names.supply in can) + 50 * (train in can)
    analysis = (
        f"{supply}The {names.hall} is idle: another {names.worker}. That costs {cost} of 210 minerals; the rest is "
        f"saved for a {names.production}."
    )
    view = View(
        time_s=40,
        resources=Resources(minerals=210, supply_used=14, supply_cap=15),
        economy=Economy(income=(830, 0), spending=(150, 0), gatherers=(14, 0, 0), room=(16, 0), full_in_s=16),
        counts=_counts(race),
    )
    said = _first_contact(task, agent, f"No army yet; a {names.production} comes next.")
    return view, ("game", "economy", "counts"), _Reply(analysis, calls, team.name, said)


def _army(task: TaskConfig, agent: AgentConfig) -> _Made | None:
    """The own army is larger than what was seen of the enemy's."""
    race = task.map_spec.race
    foe = _foe(task)
    if race not in _RACES:
        return None
    names, kind = _RACES[race], _FOES[race]
    places = (
        Place(name="Base 1", what="base", minimap=(20, 20), holder="own", about=names.hall, unseen_s=0.0),
        Place(name="Base 2", what="base", minimap=(44, 46), about="the enemy began here"),
    )
    types = facts_of(task.map_data).units
    worth = round(12 * types[kind].value)
    part = ArmyPart(place="Base 1", minimap=(24, 24), units={kind: 12}, doing="idle", value=worth)
    seen = ArmyPart(minimap=(36, 38), units={foe: 4}, value=round(4 * types[foe].value), unseen_s=20, away=31)
    resources = Resources(minerals=120, vespene=40, supply_used=47, supply_cap=54)
    view = View(time_s=300, resources=resources, places=places, army=Army(parts=(part,), enemies=(seen,), value=worth))
    analysis = (
        f"12 {plural(kind)} stand idle at Base 1, and only 4 {plural(foe)} were seen: strong enough to attack Base 2."
    )
    reply = _attack(task, agent, analysis)
    return (view, ("game", "map", "army"), reply) if reply else None


def _attack(task: TaskConfig, agent: AgentConfig, analysis: str) -> _Reply | None:
    team = _side_team(agent)
    if team is not None and "All_Units_Attack" in _action_names(team.actions):
        said = _first_contact(task, agent, "The army attacks Base 2 now; more units, please.")
        return _Reply(analysis, ["<All_Units_Attack()>"], team.name, said)
    group = next((other for other in task.correspondents(agent) if other.kind == "combat_group"), None)
    if group is None:
        return None
    return _Reply(
        analysis, (), message=(group.name, "Attack Base 2 at [44, 46] with all your units; report what you meet.")
    )


# --- builders -------------------------------------------------------------------------------------------------


def _site(task: TaskConfig, agent: AgentConfig) -> _Made | None:
    """A worker stands at home with 210 minerals; the place that it takes is on its screen."""
    race = task.map_spec.race
    team = next((team for team in agent.teams if team.unit_types), None)
    if race not in _RACES or team is None:
        return None
    names = _RACES[race]
    can = _action_names(agent.actions[team.unit_types[0]])
    build = f"Build_{names.production}_Screen"
    if build not in can:
        return None
    facts = facts_of(task.map_data)
    worker = _unit(facts, names.worker, _OWN_TAGS[0], (12, 12))
    hall = _unit(facts, names.hall, _HALL_TAG, (5, 10)).but(alliance="ally")
    powered = race == "protoss"
    pylon = _unit(facts, "Pylon", "0xe0022", (15, 9)).but(alliance="ally")
    field = Landmark(
        what="power field", tag="0xe0022", type="Pylon", minimap=(33, 19), screen=(15, 9), about="radius 6.5"
    )
    view = View(
        time_s=70,
        resources=Resources(minerals=210, supply_used=15, supply_cap=23),
        teams=(
            TeamView(
                name=_team_name(team),
                minimap=(30.0, 22.0),
                units=(worker,),
                allies=(hall, pylon) if powered else (hall,),
            ),
        ),
        landmarks=(field,) if powered else (),
    )
    where = "3 cells below the Pylon, within its field" if powered else "10 cells from the town hall, off the minerals"
    analysis = f"210 minerals pay for a {names.production}; [15, 12] is free, {where}."
    said = _first_contact(task, agent, f"I build a {names.production}.")
    return view, ("game", "teams", "places"), _Reply(analysis, [f"<{build}([15, 12])>"], _team_name(team), said)
