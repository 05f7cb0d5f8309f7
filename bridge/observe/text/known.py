"""Section about what is known of the types of units in sight."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from bridge.knowledge import knowledge
from bridge.observe.text.page import section, shorter
from bridge.observe.text.words import INDENT, INDENT2, n

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bridge.knowledge import UnitType, Weapon
    from bridge.observe.text.page import Page


@section("unit_knowledge")
def unit_knowledge(page: Page) -> Iterator[str]:
    """What is known of every type in sight; abilities only of those under control."""
    mine, others = _types(page)
    known = [name for name in mine | others if name in knowledge()]
    if known:
        yield "Unit knowledge"
    for name in known:
        yield from _known(name)
        if name in mine:
            yield from _abilities(name)


@shorter("unit_knowledge", rank=20, says="abilities and weapons of the types in sight")
def unit_knowledge_in_short(page: Page) -> Iterator[str]:
    """One line a type."""
    mine, others = _types(page)
    known = [name for name in mine | others if name in knowledge()]
    if known:
        yield "Unit knowledge"
    yield from (_known(name)[0] for name in known)


@shorter("unit_knowledge", rank=30, says="what is known of the types in sight")
def no_unit_knowledge(page: Page) -> Iterator[str]:  # noqa: ARG001  # a section takes the page
    """Nothing."""
    yield from ()


def _types(page: Page) -> tuple[dict[str, None], dict[str, None]]:
    """Types under control, and the others that are in sight or heard of, in the order of the page."""
    mine = dict.fromkeys(unit.type for team in page.teams for unit in team.units)
    others = dict.fromkeys(unit.type for team in page.teams for unit in (*team.allies, *team.enemies))
    others |= dict.fromkeys(name for team in page.view.others for name in team.units)
    if page.view.others and page.view.counts:
        others |= dict.fromkeys(enemy.type for enemy in page.view.counts.enemies)
    return mine, others


@functools.cache
def _known(name: str) -> tuple[str, ...]:
    """What is known of a type, the same on every page."""
    kind = knowledge()[name]
    weapons = (f"{INDENT2}{_weapon(weapon)}" for weapon in kind.weapons)
    about = f": {kind.about}" if kind.about else ""
    return (f"{INDENT}{name}{about}", f"{INDENT2}{_body(kind)}", *weapons)


@functools.cache
def _abilities(name: str) -> tuple[str, ...]:
    return tuple(f"{INDENT2}{ability}: {what}" for ability, what in knowledge()[name].abilities.items())


def _body(kind: UnitType) -> str:
    plane = "flying" if kind.flying else "on the ground"
    parts = [f"{', '.join((*kind.attributes, plane))}; health {n(kind.health)}"]
    if kind.shield:
        parts.append(f"shield {n(kind.shield)}")
    if kind.armor:
        parts.append(f"armor {n(kind.armor)}")
    parts.append(f"speed {n(kind.speed)}" if kind.speed else "does not move")
    return ", ".join(parts)


def _weapon(weapon: Weapon) -> str:
    hits = {"any": "ground and air", "ground": "ground", "air": "air"}[weapon.targets]
    times = f" x {weapon.attacks}" if weapon.attacks > 1 else ""
    bonus = "".join(f" (+{n(more)} against {what})" for what, more in weapon.bonus.items())
    return (
        f"hits {hits}, range {n(weapon.range)}, damage {n(weapon.damage)}{bonus}{times} "
        f"every {n(weapon.period_s)} s, {n(round(weapon.per_second, 1))} damage per second"
    )
