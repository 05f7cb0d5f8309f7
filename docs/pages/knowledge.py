"""The pages of the knowledge of the game: unit types, abilities and upgrades, from `khala_bridge.knowledge`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from docs.pages.markdown import code, codes, head, join, table
from khala_bridge.knowledge import RACES, VERSION, VERSIONS, abilities, knowledge, upgrades
from khala_bridge.knowledge.load import words_of
from khala_bridge.knowledge.words import number as n
from khala_bridge.knowledge.words import price

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.knowledge import AbilityFacts, UnitFacts, UpgradeFacts, WeaponFacts

SOURCE = "`bridge/khala_bridge/data/knowledge`"
MAKING = {"train", "warp_in", "build", "build_addon", "grow", "structure_morph"}
"""Kinds of abilities that make units and structures."""
MANY = 12
"""Number of users that are listed one by one."""
FACTS = (
    *("type", "id", "health", "shield", "energy", "armor", "speed", "sight", "detects", "supply", "worth"),
    *("made by", "time", "needs", "attributes", "weapons"),
)
NUMBERS = (
    f"Numbers are those of version {VERSION} of the game, which PySC2's ids belong to, without upgrades; there are "
    f"facts of {' and '.join(VERSIONS)}. Time is in seconds of the speed *faster*, distances are world units."
)
LOOK_UP = "One entry in full, with all that it is related to:\n\n```bash\nkhala knowledge show {}\n```"


def units() -> str:
    """Return the page of what agents read about unit types."""
    known = knowledge().values()
    races = [_race(race, [kind for kind in known if kind.race == race and kind.melee]) for race in RACES]
    neutral: dict[str, list[str]] = {}
    for kind in known:
        if kind.race == "neutral" and kind.melee:
            neutral.setdefault(kind.about, []).append(kind.name)
    left = [(kind.name, kind.id, kind.about) for kind in known if not kind.melee]
    return join(
        head("Units", SOURCE),
        "What an observation tells of unit types in sight; structures are unit types too. "
        + NUMBERS
        + " Weapon ranges are from edge to edge, *worth* is minerals, vespene as the API counts: with what a type was "
        "morphed from. What beats what is our judgement.",
        LOOK_UP.format("Stalker"),
        *races,
        "## Neutral",
        table(("about", "types"), [(about, ", ".join(names)) for about, names in neutral.items()]),
        "## Not in melee games",
        "Left in the game's data, or only on some maps.",
        table(("type", "id", "about"), left),
    )


def abilities_page() -> str:
    """Return the page of abilities."""
    known = [ability for ability in abilities().values() if ability.melee]
    special = [ability for ability in known if ability.does != "general"]
    titled = [ability for ability in special if (words := words_of(ability)) and words.title]
    makes = [ability for ability in special if ability.does in MAKING and ability not in titled]
    research = [ability for ability in special if ability.does == "research"]
    rest = [ability for ability in special if ability not in (*titled, *makes, *research)]
    return join(
        head("Abilities", SOURCE),
        f"All {len(known)} abilities that a unit in a melee game has. " + NUMBERS + " Which text actions stand for "
        "them is on the page of [actions](actions.md); which unit is refused one, and why, follows from these facts.",
        LOOK_UP.format("Effect_PsiStorm"),
        "## Skills",
        _abilities(titled),
        "## Making units and structures",
        _abilities(makes),
        "## Research",
        "What each does is with the [upgrades](upgrades.md).",
        _abilities(research),
        "## Other orders",
        _abilities(rest),
        "## General abilities",
        "Each stands for the special ones that are named; what a unit pays for it is what its special one says.",
        table(
            ("ability", "id", "about", "stands for"),
            [(code(a.name), a.id, a.about, ", ".join(map(str, a.special))) for a in known if a.does == "general"],
        ),
    )


def upgrades_page() -> str:
    """Return the page of upgrades."""
    known = upgrades().values()
    races = [
        join(f"## {race.capitalize()}", _upgrades(u for u in known if u.race == race and u.melee)) for race in RACES
    ]
    return join(
        head("Upgrades", SOURCE),
        f"All {sum(u.melee for u in known)} upgrades that can be researched. " + NUMBERS,
        LOOK_UP.format("Blink"),
        *races,
    )


def _race(race: str, known: list[UnitFacts]) -> str:
    words = [
        (kind.name, kind.about, kind.uses, ", ".join(kind.counters), ", ".join(kind.countered_by), _own(kind))
        for kind in known
    ]
    return join(
        f"## {race.capitalize()}",
        table(FACTS, [_facts(kind) for kind in known]),
        table(("type", "about", "use", "good against", "beaten by", "abilities"), words),
    )


def _own(kind: UnitFacts) -> str:
    return "; ".join(f"*{title}*: {said}" for title, said in kind.abilities.items())


def _facts(kind: UnitFacts) -> tuple[object, ...]:
    needs = (*kind.requires, *((f"{kind.addon} at the producer",) if kind.addon else ()))
    flags = (("flying", kind.flying), ("cloaked", kind.cloaked), ("burrowed", kind.burrowed))
    numbers = (kind.health, kind.shield, kind.energy, kind.armor, kind.speed, kind.sight, kind.detects, kind.supply)
    return (
        kind.name,
        kind.id,
        *(n(value) if value else "" for value in numbers),
        f"{n(kind.minerals)}, {n(kind.vespene)}" if kind.value else "",
        ", ".join(kind.producers),
        f"{n(kind.build_s)} s" if kind.build_s and kind.producers else "",
        ", ".join(needs),
        ", ".join((*kind.attributes, *(word for word, is_so in flags if is_so))),
        "; ".join(_weapon(weapon) for weapon in kind.weapons),
    )


def _weapon(weapon: WeaponFacts) -> str:
    attacks = f" x {weapon.attacks}" if weapon.attacks > 1 else ""
    nearest = f"{n(weapon.min_range)} to " if weapon.min_range else ""
    bonus = "".join(f", +{n(amount)} against {attribute}" for attribute, amount in weapon.bonus.items())
    splash = f", splash {n(weapon.splash)}" if weapon.splash else ""
    return (
        f"{weapon.targets}, range {nearest}{n(weapon.range)}: {n(weapon.damage)}{attacks} every {n(weapon.period_s)} s"
        f"{bonus}{splash}"
    )


def _abilities(known: Iterable[AbilityFacts]) -> str:
    header = ("ability", "id", "about", "users", "target", "range", "energy", "cost", "ready after", "needs")
    return table(header, [_ability(ability) for ability in known])


def _ability(ability: AbilityFacts) -> tuple[object, ...]:
    users = ability.users if len(ability.users) <= MANY else (f"{len(ability.users)} types",)
    cost = price(ability.minerals, ability.vespene, ability.supply)
    needs = (*ability.requires, *((f"{ability.addon} of its own",) if ability.addon else ()))
    reach = "anywhere" if ability.range is None else n(ability.range) if ability.range else ""
    return (
        code(ability.name),
        ability.id,
        ability.about,
        ", ".join(users),
        ability.target.replace("_", " ") if ability.target != "none" else "",
        reach if ability.target != "none" else "",
        n(ability.energy) if ability.energy else "",
        cost if cost != "nothing" else "",
        f"{n(ability.cooldown_s)} s" if ability.cooldown_s else "",
        ", ".join(needs),
    )


def _upgrades(known: Iterable[UpgradeFacts]) -> str:
    rows = [
        (
            code(upgrade.name),
            upgrade.id,
            upgrade.about,
            price(upgrade.minerals, upgrade.vespene),
            f"{n(upgrade.time_s)} s",
            ", ".join(upgrade.at),
            ", ".join(upgrade.requires),
            codes(abilities()[number].name for number in upgrade.enables if number in abilities()),
        )
        for upgrade in known
    ]
    return table(("upgrade", "id", "about", "cost", "time", "at", "needs", "allows"), rows)
