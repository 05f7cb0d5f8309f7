"""Text actions generated from PySC2's functions, so that words reach every function.

Two rules. A function without a written action gets one of its own, with PySC2's name and an ending for its arguments:
`Effect_Stim()`, `Effect_Blink_Stalker_Screen([x, y])`, `Rally_Building_Minimap([x, y])`, `Effect_Charge_Unit(tag)`,
`Effect_Heal_Autocast()`. And every action for a whole team, and every action for which the host finds a producer, has
a form for one unit: `Select_Unit_<name>(tag, ...)`.

A file lists the functions without words, with their reasons: those of the interface and of what the game no longer
has; `khala_bridge.catalogue.coverage` shows them. Below this module: the table of functions and the facts about
abilities. Above it: `khala_bridge.catalogue.catalogue`, which checks its results.
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
"""Rule for structures under construction, which belong to no team."""
_AT_ONCE: Final = ("Cancel", "Halt", "Stop")
"""First parts of the names of functions that end orders, and so never wait for them."""
_LEVEL: Final = re.compile(r"(\w+)Level(\d)")
_PRODUCING: Final = frozenset({"train", "research"})
"""Rules that choose a producer; the agent can name one instead."""


class Form(NamedTuple):
    """One text form of a function: the ending of its name, and its arguments in parentheses."""

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
    """Return the functions of PySC2 that no text action ends in, with the reason."""
    reasons: dict[str, str] = data.document(WITHOUT_WORDS)
    return reasons


def generate(curated: Mapping[str, Action]) -> Iterator[Action]:
    """Yield the actions that are not written by hand: first for teams and the side, then for single units."""
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
    """Return the text forms of a function, by the possible targets of its ability."""
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
    """Return the action for one form of a function; `like` is the action of its general function."""
    facts = abilities()[function.ability_id]
    research = facts.does == "research"
    units = _users(facts)
    return Action(
        name=function.stem + form.ending,
        args=form.args,
        about=like.about if like and not facts.about else f"{_description(function, facts)} {form.remark}".strip(),
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
    """Return the function for the general case of a special one; itself if there is none."""
    cases = functions_of(function.general_id) if function.general_id else ()
    return next((case.name for case in cases if case.kind == function.kind), function.name)


def _for_one_unit(action: Action) -> Action | None:
    """Return the form of an action for one named unit; None if one unit alone cannot do it."""
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
    """Return what an action does, apart from its name."""
    return action.function, action.target_kind, action.aim


def _target(ability: int) -> frozenset[Literal["point", "unit"]]:
    """Return the possible targets of an ability, or of any special case of a general one."""
    facts = abilities()[ability]
    cases = [abilities()[case] for case in facts.special] or [facts]
    found = {kind for case in cases for kind in ("point", "unit") if kind in case.target.split("_")}
    raw = {"point": "pt", "unit": "unit"}
    return frozenset(kind for kind in found if raw[kind] in raw_forms(ability)) or frozenset(found)


def _whose(facts: AbilityFacts) -> Literal["enemy", "own"] | None:
    """Return the owner that a target must have, by its filters."""
    if "enemy" in facts.must_not:
        return "own"
    return "enemy" if {"self", "ally"} & set(facts.must_not) and "player" in facts.must_not else None


def _users(facts: AbilityFacts) -> tuple[str, ...]:
    """Return the types that have an ability, without critters and types that no player of the version can have."""
    users = [user for user in facts.users if knowledge()[user].race != "neutral"]
    return tuple(user for user in users if knowledge()[user].melee) or tuple(users)


def _race(users: tuple[str, ...]) -> Literal["protoss", "terran", "zerg"] | None:
    races = {knowledge()[user].race for user in users}
    found = races.pop() if len(races) == 1 else None
    return None if found == "neutral" else found


def _description(function: Function, facts: AbilityFacts) -> str:
    """Return the description of an ability, or one made from its name."""
    if facts.about:
        return facts.about
    kind, _, rest = function.stem.partition("_")
    if kind == "Cancel":
        return f"Call off what is under way: {_split_words(rest)}."
    if match := _LEVEL.fullmatch(rest):
        return f"Research level {match[2]} of {_split_words(match[1])}."
    return f"{_split_words(kind)}: {_split_words(rest)}." if rest else f"{_split_words(kind)}."


def _split_words(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])|_", " ", name)
