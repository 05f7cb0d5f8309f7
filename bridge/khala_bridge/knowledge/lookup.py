"""Everything known about a unit type, an upgrade or an ability, as text for people.

`khala knowledge show` prints it. `khala_bridge.knowledge.prompt` makes the few lines for prompts.
"""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, TypeAlias

from khala_bridge.knowledge import prompt
from khala_bridge.knowledge.facts import VERSION
from khala_bridge.knowledge.load import abilities, knowledge, upgrades
from khala_bridge.knowledge.model import AbilityFacts, UnitFacts, UpgradeFacts
from khala_bridge.knowledge.words import join_names, price
from khala_bridge.knowledge.words import number as n
from khala_protocol.errors import KhalaError

if TYPE_CHECKING:
    from collections.abc import Iterator

INDENT = "    "


Known: TypeAlias = UnitFacts | UpgradeFacts | AbilityFacts


class NotKnown(KhalaError):
    """Nothing known has this name."""


def find(name: str, version: str = VERSION) -> list[Known]:
    """Return every unit type, upgrade and ability with this name, or the ability with this number.

    Upper case, blanks and underscores do not matter: `siege tank` is a SiegeTank.

    Raises:
        NotKnown: there is no such thing; the text names the nearest.
    """
    wanted = _plain(name)
    everything: list[Known] = [
        *knowledge(version).values(), *upgrades(version).values(), *abilities(version).values()
    ]  # fmt: skip
    found = [facts for facts in everything if _plain(facts.name) == wanted]
    found += [ability for ability in abilities(version).values() if str(ability.id) == name.strip()]
    if found:
        return found
    plain = {_plain(facts.name): facts.name for facts in everything if facts.melee}
    near = [plain[name] for name in difflib.get_close_matches(wanted, plain, n=3)]
    hint = f"; did you mean {' or '.join(near)}?" if near else ""
    raise NotKnown(f"nothing in version {version} of the game is called '{name}'{hint}")


def long(known: Known, version: str = VERSION) -> str:
    """Return everything known about one thing."""
    if isinstance(known, UnitFacts):
        lines = _unit(known, version)
    elif isinstance(known, UpgradeFacts):
        lines = _upgrade(known, version)
    else:
        lines = _ability(known)
    return "\n".join(lines) + "\n"


def _plain(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter.isalnum())


def _unit(kind: UnitFacts, version: str) -> list[str]:
    out = [f"{kind.name} ({'structure' if kind.structure else 'unit'}, {kind.race}, id {kind.id})"]
    out += _indent(kind.about, kind.uses and f"Use: {kind.uses}", "" if kind.melee else "Not in melee games.")
    out += [INDENT + prompt.body(kind) + f", sight {n(kind.sight)}"]
    out += [INDENT + prompt.weapon(weapon) for weapon in kind.weapons]
    out += [INDENT + said for said in _making(kind)]
    out += [f"{INDENT}{what}: {', '.join(names)}" for what, names in _relations(kind) if names]
    out += [f"{INDENT}{title}: {said}" for title, said in kind.abilities.items()]
    better = list(_upgrades(kind, version))
    out += [f"{INDENT}Upgrades:"] * bool(better) + [INDENT * 2 + said for said in better]
    orders = [abilities(version)[number] for number in kind.ability_ids if number in abilities(version)]
    return [*out, f"{INDENT}Orders: {', '.join(f'{order.name} ({order.id})' for order in orders)}"] if orders else out


def _upgrades(kind: UnitFacts, version: str) -> Iterator[str]:
    """Yield the upgrades that make a type better; levels with the same text share a line."""
    said: dict[str, list[str]] = {}
    for upgrade in upgrades(version).values():
        if upgrade.melee and kind.name in upgrade.affects:
            said.setdefault(upgrade.about, []).append(upgrade.name)
    for about, names in said.items():
        yield f"{', '.join(names)}: {about}"


def _making(kind: UnitFacts) -> Iterator[str]:
    if kind.producers:
        needs = (*kind.requires, *((f"a {kind.addon} at the producer",) if kind.addon else ()))
        needed = f"; needs {join_names(needs)}" if needs else ""
        yield f"Made by {join_names(kind.producers)} in {n(kind.build_s)} s{needed}"
    if kind.value or kind.supply:
        yield f"Worth {price(kind.minerals, kind.vespene, kind.supply)}"
    if kind.footprint:
        yield f"Stands on {kind.footprint[0]} x {kind.footprint[1]} cells"
    for words, value in (
        ("Gives supply", kind.provides), ("Gives power within", kind.power_radius),
        ("Places in a transport", kind.cargo_size), ("Carries places", kind.cargo_space),
    ):  # fmt: skip
        if value:
            yield f"{words}: {n(value)}"
    ground = (("power", kind.needs_power), ("creep", kind.needs_creep))
    yield from (f"Needs {what}" for what, is_so in ground if is_so)


def _relations(kind: UnitFacts) -> tuple[tuple[str, tuple[str, ...]], ...]:
    return (
        ("Counts also as", kind.counts_as),
        ("Allows", kind.allows),
        ("Good against", kind.counters),
        ("Beaten by", kind.countered_by),
    )


def _upgrade(upgrade: UpgradeFacts, version: str) -> list[str]:
    out = [f"{upgrade.name} (upgrade, {upgrade.race or 'no race'}, id {upgrade.id})"]
    out += _indent(upgrade.about, "" if upgrade.melee else "Not in melee games.")
    if upgrade.at:
        needs = f"; needs {join_names(upgrade.requires)}" if upgrade.requires else ""
        cost = price(upgrade.minerals, upgrade.vespene)
        out.append(f"{INDENT}Researched at {join_names(upgrade.at)} for {cost} in {n(upgrade.time_s)} s{needs}")
    for name, changes in upgrade.changes.items():
        out.append(f"{INDENT}{name}: " + ", ".join(f"{what} {more:+g}" for what, more in changes.items()))
    allowed = [
        f"{abilities(version)[enable].name} ({enable})" for enable in upgrade.enables if enable in abilities(version)
    ]
    return [*out, f"{INDENT}Allows {join_names(tuple(allowed))}"] if allowed else out


def _ability(ability: AbilityFacts) -> list[str]:
    out = [f"{ability.name} ({'general ' if ability.special else ''}ability {ability.id})"]
    out += _indent(ability.about, "" if ability.melee else "Not in melee games.")
    out += [f"{INDENT}{what}: {said}" for what, said in _terms(ability) if said]
    if ability.figures:
        out.append(f"{INDENT}Numbers: " + ", ".join(f"{what} {value:g}" for what, value in ability.figures.items()))
    return out


def _terms(ability: AbilityFacts) -> Iterator[tuple[str, str]]:
    """Yield its costs, requirements and products, as a heading and a text each; an empty text is left out."""
    reach = "anywhere" if ability.range is None else n(ability.range)
    cost = price(ability.minerals, ability.vespene, ability.supply)
    yield "Users", ", ".join(ability.users)
    yield "Target", ability.target.replace("_", " ") + (f", range {reach}" if ability.range != 0 else "")
    yield "Target must be", ", ".join(ability.must)
    yield "Target must not be", ", ".join(ability.must_not)
    yield "Cost", cost if cost != "nothing" else ""
    yield "Energy", n(ability.energy) if ability.energy else ""
    yield "Health", n(ability.life) if ability.life else ""
    yield "Ready again after", f"{n(ability.cooldown_s)} s" if ability.cooldown_s else ""
    yield "Needs", join_names((*ability.requires, *((f"a {ability.addon} of its own",) if ability.addon else ())))
    yield "Makes", f"{ability.count} {ability.produces}" if ability.produces else ""
    yield "Researches", ability.researches or ""
    yield "Takes", f"{n(ability.time_s)} s" if ability.time_s else ""
    yield "By itself", {"on": "yes, unless switched off", "off": "only if switched on", None: ""}[ability.autocast]
    yield "Stands for", ", ".join(map(str, ability.special))
    yield "A case of", str(ability.general or "")


def _indent(*sentences: str) -> list[str]:
    return [INDENT + sentence for sentence in sentences if sentence]
