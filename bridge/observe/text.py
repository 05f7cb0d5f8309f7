"""An observation in words, as a model reads it: one function per section.

A page is a heading at the left margin and indented lines below it; a section with nothing to say is left out. Unit
lines are fields between bars, so that programs can read them as well (the scripted players do):

    Team Stalker-1
        Minimap position: [18, 32]
        Enemy units:
            Zealot | tag 0x100140001 | screen [17.5, 12] | distance 5.4 | health 100/100 | shield 12/50 | total 75%

It says what a view says, adds what is known of the types in it, and repeats what became of the last reply. It
decides nothing and reads no game: a page is a pure function of a sight, its task and what the agent said and heard.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

from bridge.frames import CAMERA_WIDTH
from bridge.knowledge import knowledge

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from bridge.knowledge import UnitType, Weapon
    from bridge.observe.sight import AgentSight
    from bridge.task import TaskConfig
    from protocol.messages import Event, Received, Rejection, TeamView, UnitView

INDENT = "    "


@dataclass(frozen=True, slots=True)
class Feedback:
    """What an agent is told of its last reply, and what others said to it."""

    accepted: tuple[str, ...] = ()
    """Its calls that were carried out, `Stalker-1 <Attack_Unit(0x1)>`."""
    rejections: tuple[Rejection, ...] = ()
    messages: tuple[Received, ...] = ()


@dataclass(frozen=True, slots=True)
class Page:
    """All that a section may speak of."""

    sight: AgentSight
    task: TaskConfig
    feedback: Feedback

    @property
    def teams(self) -> Sequence[TeamView]:
        """The agent's teams that have units."""
        return self.sight.view.teams

    @property
    def correspondents(self) -> list[tuple[str, str]]:
        """Name and role of everybody this agent may write to."""
        if not self.task.communication:
            return []
        return [(agent.name, agent.role) for agent in self.task.agents if agent.name != self.sight.agent.name]


def render(sight: AgentSight, task: TaskConfig, feedback: Feedback) -> str:
    """The text of one agent's observation."""
    page = Page(sight, task, feedback)
    blocks = ("\n".join(lines) for section in SECTIONS if (lines := list(section(page))))
    return "\n\n".join(blocks) + "\n"


# --- sections -------------------------------------------------------------------------------------------------


def game(page: Page) -> Iterator[str]:
    """Time, and resources for those who spend them."""
    view, used = page.sight.view, page.sight.view.resources
    yield "Game"
    minutes, seconds = divmod(int(view.time_s), 60)
    yield f"{INDENT}Time: {minutes}:{seconds:02}"
    if used.minerals or used.vespene:
        yield f"{INDENT}Minerals: {used.minerals}, vespene: {used.vespene}"
        yield f"{INDENT}Supply: {_n(used.supply_used)} of {_n(used.supply_cap)} used"
    if view.upgrades:
        yield f"{INDENT}Upgrades: {', '.join(view.upgrades)}"
    if page.sight.idle_teams:
        yield f"{INDENT}Teams without units: {', '.join(page.sight.idle_teams)}"


def teams(page: Page) -> Iterator[str]:
    """One block per team: where it is, who is there, what happened."""
    for index, team in enumerate(page.teams):
        if index:
            yield ""
        yield f"Team {team.name}"
        yield f"{INDENT}Minimap position: {_point(team.minimap)}"
        size = page.task.frames.screen
        if team.bounds != (0.0, 0.0, size, size):
            x0, y0, x1, y1 = map(_n, team.bounds)
            yield f"{INDENT}Screen on the map: x {x0} to {x1}, y {y0} to {y1}"
        yield from _listed("Your units:", (_unit_line(unit, size) for unit in team.units))
        yield from _listed("Allied units:", (_unit_line(unit, size) for unit in team.allies))
        yield from _listed("Enemy units:", (_unit_line(unit, size) for unit in team.enemies))
        yield from _listed("Since the last observation:", _event_lines(team.events))


def unit_knowledge(page: Page) -> Iterator[str]:
    """What is known of every type in sight; abilities only of those under control."""
    mine = dict.fromkeys(unit.type for team in page.teams for unit in team.units)
    others = dict.fromkeys(unit.type for team in page.teams for unit in (*team.allies, *team.enemies))
    known = [(name, knowledge()[name]) for name in mine | others if name in knowledge()]
    if known:
        yield "Unit knowledge"
    for name, kind in known:
        yield from _known(name)
        if name in mine:
            yield from (f"{INDENT * 2}{ability}: {what}" for ability, what in kind.abilities.items())


def valid_actions(page: Page) -> Iterator[str]:
    """What each team may be told now."""
    if page.teams:
        yield "Valid actions"
    for team in page.teams:
        calls = ", ".join(f"<{action.name}({', '.join(action.args)})>" for action in team.actions)
        yield f"{INDENT}Team {team.name}: {calls or 'none'}"
    described = {action.name: action.description for team in page.teams for action in team.actions}
    if described:
        yield f"{INDENT}What they do:"
        yield from (f"{INDENT * 2}{name}: {about}" for name, about in described.items())


def arguments(page: Page) -> Iterator[str]:
    """How the arguments of the valid actions are written."""
    kinds = {kind for team in page.teams for action in team.actions for kind in action.args}
    if not kinds:
        return
    screen, minimap = _n(page.task.frames.screen), _n(page.task.frames.minimap)
    yield "Arguments"
    if "tag" in kinds:
        units = [unit for team in page.teams for unit in (*team.enemies, *team.units)]
        yield f"{INDENT}tag: the tag of a unit that stands above, for example {units[0].tag}"
    if "screen" in kinds:
        step = _n(CAMERA_WIDTH / page.task.frames.screen)
        yield (
            f"{INDENT}screen: [x, y] on the team's own screen, from 0 to {screen}; x grows to the right, y grows "
            f"downwards, the team's first unit is in the middle, one step is {step} of distance"
        )
    if "minimap" in kinds:
        yield (
            f"{INDENT}minimap: [x, y] on the map of all, from 0 to {minimap}; x grows to the right, y grows downwards"
        )


def last_actions(page: Page) -> Iterator[str]:
    """What became of the last reply."""
    feedback = page.feedback
    if not feedback.accepted and not feedback.rejections:
        return
    yield "Your last actions"
    yield from (f"{INDENT}accepted: {call}" for call in feedback.accepted)
    for fault in feedback.rejections:
        words = f"{fault.team} {fault.text}" if fault.team else fault.text
        yield f"{INDENT}rejected: {_one_line(words)}: {_one_line(fault.message)}"
    if feedback.accepted:
        yield f"{INDENT}Check whether the accepted ones are done, go on by themselves, or need another order."


def tasks(page: Page) -> Iterator[str]:
    """What is to be done, by all, by this agent, and by its teams."""
    yield "Task"
    yield f"{INDENT}{_one_line(page.task.task)}"
    if page.sight.agent.task:
        yield f"{INDENT}{_one_line(page.sight.agent.task)}"
    present = {team.team.config.name: team.team.config.task for team in page.sight.teams}
    yield from (f"{INDENT}Team {name}: {_one_line(task)}" for name, task in present.items() if task)


def communication(page: Page) -> Iterator[str]:
    """What others said, and whom one may write to."""
    people, channels = page.correspondents, page.task.channels if page.task.communication else ()
    if not people and not channels:
        return
    yield "Communication"
    yield from (f"{INDENT}{_message(message, page.sight.agent.name)}" for message in page.feedback.messages)
    if people:
        yield f"{INDENT}You can write to:"
        yield from (f"{INDENT * 2}{name}: {_one_line(role)}" for name, role in people)
        yield f"{INDENT}To write: <MessageTo(name, '''text''')>"
    if channels:
        yield f"{INDENT}Channels, heard by all who listen: {', '.join(channels)}"
        yield f"{INDENT}To write to all of them: <MessageTo(channel, '''text''')>; to listen: <ListenTo(channel)>"


def answer(page: Page) -> Iterator[str]:
    """The limit, one piece of advice, and the signal to begin."""
    limit = page.task.max_actions
    talks = bool(page.correspondents or (page.task.communication and page.task.channels))
    parts = '"Analysis:", "Actions:" and "Communications:"' if talks else '"Analysis:" and "Actions:"'
    yield "Answer"
    actions = f"{limit} action{'s' if limit > 1 else ''}"
    yield f"{INDENT}At most {actions} per team; use abilities before moving or attacking."
    yield f'{INDENT}Write a heading "Team <name>:" above the actions of each team.'
    yield f"{INDENT}Now answer in the parts {parts}."


SECTIONS: tuple[Callable[[Page], Iterator[str]], ...] = (
    game,
    teams,
    unit_knowledge,
    valid_actions,
    arguments,
    last_actions,
    tasks,
    communication,
    answer,
)


# --- lines ----------------------------------------------------------------------------------------------------


def _listed(heading: str, lines: Iterable[str]) -> Iterator[str]:
    found = list(lines)
    if found:
        yield f"{INDENT}{heading}"
        yield from (f"{INDENT * 2}{line}" for line in found)


def _unit_line(unit: UnitView, size: float) -> str:
    off = "" if all(0 <= value < size for value in unit.screen) else " (off screen)"
    where = f"{unit.type} | tag {unit.tag} | screen {_point(unit.screen)}{off}"
    if unit.distance is not None:
        where += f" | distance {_n(unit.distance)}"
    return where + _condition(
        unit.health, unit.health_max, unit.shield, unit.shield_max, unit.energy, unit.energy_max, unit.build_progress,
        unit.weapon_cooldown_s, unit.order, unit.cloaked, unit.hallucination, unit.buffs,
    )  # fmt: skip


@functools.lru_cache(4096)
def _condition(
    health: float, health_max: float, shield: float, shield_max: float, energy: float, energy_max: float, built: float,
    cooldown_s: float | None, order: str | None, cloaked: bool, hallucination: bool, buffs: tuple[str, ...],
) -> str:  # fmt: skip
    """How a unit is: the same for every team that sees it, and for most units from one step to the next."""
    fields = [f"health {_whole(health)}/{_whole(health_max)}"]
    if shield_max:
        fields.append(f"shield {_whole(shield)}/{_whole(shield_max)}")
    if full := health_max + shield_max:
        fields.append(f"total {_whole(100 * (health + shield) / full)}%")
    if energy_max:
        fields.append(f"energy {_whole(energy)}/{_whole(energy_max)}")
    if built < 1:
        fields.append(f"built {round(100 * built)}%")
    if cooldown_s is not None:
        fields.append(f"weapon in {_n(cooldown_s)} s" if cooldown_s else "weapon ready")
    if order:
        fields.append(f"order {order}")
    fields += [word for word, is_so in (("cloaked", cloaked), ("hallucination", hallucination)) if is_so]
    if buffs:
        fields.append(f"effects {', '.join(buffs)}")
    return "".join(f" | {field}" for field in fields)


_VERBS = {
    "hurt": "was hit",
    "healed": "recovered",
    "died": "died",
    "joined": "joined the team",
    "appeared": "came into sight",
    "disappeared": "went out of sight",
}


def _event_lines(events: Sequence[Event]) -> Iterator[str]:
    """One line for all units of a type to which the same happened; deaths and hits of the enemy stand last."""
    order = {what: place for place, what in enumerate(_VERBS)}

    def kind(event: Event) -> tuple[int, str, str]:
        return order[event.what], event.alliance, event.type

    for (_, alliance, unit_type), group in groupby(sorted(events, key=kind), key=kind):
        members = list(group)
        verb = _VERBS[members[0].what]
        sign = {"hurt": " -", "healed": " +"}.get(members[0].what, "")
        names = ", ".join(event.tag + (f"{sign}{_whole(event.amount)}" if event.amount else "") for event in members)
        yield f"{alliance} {unit_type} {verb}: {names}"


@functools.cache
def _known(name: str) -> tuple[str, ...]:
    """What is known of a type, the same on every page."""
    kind = knowledge()[name]
    weapons = (f"{INDENT * 2}{_weapon(weapon)}" for weapon in kind.weapons)
    return (f"{INDENT}{name}: {kind.about}", f"{INDENT * 2}{_body(kind)}", *weapons)


def _body(kind: UnitType) -> str:
    plane = "flying" if kind.flying else "on the ground"
    parts = [f"{', '.join((*kind.attributes, plane))}; health {_n(kind.health)}"]
    if kind.shield:
        parts.append(f"shield {_n(kind.shield)}")
    if kind.armor:
        parts.append(f"armor {_n(kind.armor)}")
    parts.append(f"speed {_n(kind.speed)}" if kind.speed else "does not move")
    return ", ".join(parts)


def _weapon(weapon: Weapon) -> str:
    hits = {"any": "ground and air", "ground": "ground", "air": "air"}[weapon.targets]
    times = f" x {weapon.attacks}" if weapon.attacks > 1 else ""
    bonus = "".join(f" (+{_n(more)} against {what})" for what, more in weapon.bonus.items())
    return (
        f"hits {hits}, range {_n(weapon.range)}, damage {_n(weapon.damage)}{bonus}{times} "
        f"every {_n(weapon.period_s)} s, {_n(round(weapon.per_second, 1))} damage per second"
    )


def _message(message: Received, name: str) -> str:
    where = "" if message.recipient == name else f" in {message.recipient}"
    lines = [line.strip() for line in message.text.splitlines()]
    text = " / ".join(line for line in lines if line)  # on one line, so that none can pass for a heading
    return f"Message from {message.sender}{where}: '''{text}'''"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _point(point: tuple[float, float]) -> str:
    return f"[{_n(point[0])}, {_n(point[1])}]"


def _n(value: float) -> str:
    """A number without needless digits: 12, 12.5."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _whole(value: float) -> str:
    """A whole number that is 0 only for nothing: what lives has at least 1."""
    return str(max(1, round(value)) if value > 0 else 0)
