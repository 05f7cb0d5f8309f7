"""Text actions that follow from PySC2's functions, so that every function can be reached in words.

Two rules. A function that no written action stands for gets one of its own, named as PySC2 names it and ended by what
it takes: `Effect_Stim()`, `Effect_Blink_Stalker_Screen([x, y])`, `Rally_Building_Minimap([x, y])`,
`Effect_Charge_Unit(tag)`, `Effect_Heal_Autocast()`. And whatever a whole team can be told, and whatever the host finds
a producer for, can be told to one unit: `Select_Unit_<name>(tag, ...)`.

Functions without words, those of the interface and of what the game no longer has, are listed with their reasons in a
file that `khala_bridge.catalogue.coverage` shows. Below this module: the table of functions and what is known of
abilities. Above it:
`khala_bridge.catalogue.catalogue`, which checks what it makes.
"""

from __future__ import annotations

import functools
import re
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from khala_bridge import data
from khala_bridge.catalogue.action import Action
from khala_bridge.catalogue.functions import functions, functions_of, raw_forms
from khala_bridge.knowledge import abilities, knowledge

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from khala_bridge.catalogue.action import ArgKind
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.knowledge import AbilityFacts

GROUP: Final = "generated"
WITHOUT_WORDS: Final = "functions_without_words.yaml"
UNFINISHED: Final = "cancel_building"
"""Rule for what is still in the making, which belongs to no team that could be told."""
_AT_ONCE: Final = ("Cancel", "Halt", "Stop")
"""Beginnings of functions that end orders, and so never wait for them."""
_LEVEL: Final = re.compile(r"(\w+)Level(\d)")
_PRODUCING: Final = frozenset({"train", "research"})
"""Rules that choose a producer, which the agent can name instead."""


class Form(NamedTuple):
    """One way to tell a function to units: what is added to its name, and what stands in the parentheses."""

    ending: str
    args: tuple[ArgKind, ...]
    remark: str


_FORMS: Final = {
    "quick": Form("", (), ""),
    "autocast": Form("_Autocast", (), "Switches on, or off, that it is done without being told."),
    "screen": Form("_Screen", ("screen",), "At a point of the screen."),
    "minimap": Form("_Minimap", ("minimap",), "At a point of the map."),
    "unit": Form("_Unit", ("tag",), "To the unit with this tag."),
}


@functools.cache
def without_words() -> dict[str, str]:
    """Functions of PySC2 that no text action ends in, with the reason."""
    reasons: dict[str, str] = data.document(WITHOUT_WORDS)
    return reasons


def generated(curated: Mapping[str, Action]) -> Iterator[Action]:
    """The actions that the written ones leave out: of whole teams and of the side first, of single units after them."""
    taken = {name.casefold() for action in curated.values() for name in (action.name, *action.aliases)}
    made = [action for action in _of_functions(curated) if action.name.casefold() not in taken]
    yield from made
    taken |= {action.name.casefold() for action in made}
    spoken = {_sense(action) for action in curated.values() if action.subject == "unit"}
    for action in (*curated.values(), *made):
        single = _for_one_unit(action)
        if single and single.name.casefold() not in taken and _sense(single) not in spoken:
            yield single


def forms(function: Function) -> tuple[Form, ...]:
    """The ways in which a function can be told, by what its ability may be aimed at."""
    if function.kind == "interface":
        return ()
    if function.kind != "screen":
        return (_FORMS[function.kind],)
    target = _target(function.ability_id)
    return tuple(_FORMS[kind] for kind in ("screen", "unit") if ("unit" if kind == "unit" else "point") in target)


def _of_functions(curated: Mapping[str, Action]) -> Iterator[Action]:
    spoken = {_sense(action): action for action in curated.values() if action.subject == "team"}
    of_no_team = {action.function for action in curated.values() if action.rule == UNFINISHED}
    for function in functions().values():
        for form in forms(function) if function.name not in without_words().keys() | of_no_team else ():
            if (function.name, _kind(form), "unit") in spoken or (function.name, _kind(form), "place") in spoken:
                continue
            yield _of_function(function, form, spoken.get((_general(function), _kind(form), "unit")))


def _of_function(function: Function, form: Form, like: Action | None) -> Action:
    """The action of one form of a function; `like` is that of the general function which this is a case of."""
    facts = abilities()[function.ability_id]
    research = facts.does == "research"
    units = _users(facts)
    return Action(
        name=function.stem + form.ending,
        args=form.args,
        about=like.about if like and not facts.about else f"{_words(function, facts)} {form.remark}".strip(),
        group=GROUP,
        race=_race(units),
        subject="side" if research else "team",
        units=units,
        function=function.name,
        target=_whose(facts) if form.args == ("tag",) else None,
        queue="queued" in function.args and not research and not function.name.startswith(_AT_ONCE),
        rule="research" if research else None,
        produces=facts.produces or facts.researches,
    )


def _kind(form: Form) -> ArgKind | None:
    return form.args[0] if form.args else None


def _general(function: Function) -> str:
    """The function for the general case of a special one; itself if there is none."""
    cases = functions_of(function.general_id) if function.general_id else ()
    return next((case.name for case in cases if case.kind == function.kind), function.name)


def _for_one_unit(action: Action) -> Action | None:
    """The same told to one unit that is named; None where there is nothing that one unit could do by itself."""
    producing = action.subject == "side" and action.rule in _PRODUCING
    if action.function is None or not (action.subject == "team" or producing):
        return None
    which = "the first tag" if "tag" in action.args else "this tag"
    known = abilities()[action.pysc2.ability_id].about if producing and action.pysc2 else ""
    own = {
        "name": f"Select_Unit_{action.name}",
        "args": ("tag", *action.args),
        "about": f"Only the own unit with {which}: {known or action.about}",
        "group": GROUP,
        "aliases": (),
        "subject": "unit",
        "rule": None if producing else action.rule,
    }
    return Action(**({field: getattr(action, field) for field in Action.model_fields} | own))


def _sense(action: Action) -> tuple[str | None, ArgKind | None, str]:
    """What an action comes to, whatever it is called."""
    return action.function, action.target_kind, action.aim


def _target(ability: int) -> frozenset[Literal["point", "unit"]]:
    """What an ability, or any of the special cases of a general one, may be aimed at."""
    facts = abilities()[ability]
    cases = [abilities()[case] for case in facts.special] or [facts]
    found = {kind for case in cases for kind in ("point", "unit") if kind in case.target.split("_")}
    raw = {"point": "pt", "unit": "unit"}
    return frozenset(kind for kind in found if raw[kind] in raw_forms(ability)) or frozenset(found)


def _whose(facts: AbilityFacts) -> Literal["enemy", "own"] | None:
    """Whose unit a target may be, by what it may not be."""
    if "enemy" in facts.must_not:
        return "own"
    return "enemy" if {"self", "ally"} & set(facts.must_not) and "player" in facts.must_not else None


def _users(facts: AbilityFacts) -> tuple[str, ...]:
    """The types that have an ability, without critters and without what no player of the version can have."""
    users = [user for user in facts.users if knowledge()[user].race != "neutral"]
    return tuple(user for user in users if knowledge()[user].melee) or tuple(users)


def _race(users: tuple[str, ...]) -> Literal["protoss", "terran", "zerg"] | None:
    races = {knowledge()[user].race for user in users}
    found = races.pop() if len(races) == 1 else None
    return None if found == "neutral" else found


def _words(function: Function, facts: AbilityFacts) -> str:
    """What is known of the ability in words, or what its name says."""
    if facts.about:
        return facts.about
    kind, _, rest = function.stem.partition("_")
    if kind == "Cancel":
        return f"Call off what is under way: {_spaced(rest)}."
    if match := _LEVEL.fullmatch(rest):
        return f"Research level {match[2]} of {_spaced(match[1])}."
    return f"{_spaced(kind)}: {_spaced(rest)}." if rest else f"{_spaced(kind)}."


def _spaced(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])|_", " ", name)
