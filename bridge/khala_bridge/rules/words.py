"""`Unavailable` in words: briefly for a list of what is not possible, as a sentence for a call that is refused.

All forms come from the same value. A team's text is about its units and ends a sentence; a side's is about any of its
units, and says what to do, since the host would have chosen the unit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

from khala_bridge.knowledge import race_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from khala_bridge.rules.cost import Shortfall
    from khala_bridge.rules.unavailable import Kind, Unavailable

SUPPLY_FROM: Final = {"protoss": "a Pylon", "terran": "a SupplyDepot", "zerg": "an Overlord"}
HOW_TO_GET: Final = {"Larva": "wait for the next one", "WarpGate": "research WarpGate and turn a Gateway into one"}


def brief(why: Unavailable) -> str:
    """Return the reason in the shortest form, without repeating the action: `needs 50 energy, there is 8`."""
    return _BRIEF[why.kind](why)


def of_team(why: Unavailable) -> str:
    """Return the reason of a unit of a team as the end of a sentence: `HighTemplar has 44 energy and it takes 75`."""
    return _OF_TEAM[why.kind](why)


def of_side(why: Unavailable) -> str:
    """Return the reason of a whole side as a sentence after a colon, with what can be done about it."""
    if why.who == "WarpGate" and why.kind in {"taken", "cooldown"}:
        return "every WarpGate recharges; wait until one is ready."
    return _OF_SIDE[why.kind](why)


def _lack(why: Unavailable, name: str) -> str:
    if race_of(name) is None:
        return f"{name} is not researched"
    return f"{name} is not finished" if name in why.begun else f"no {name}"


def _needed_first(why: Unavailable) -> str:
    """Return the missing structures, or else the upgrades: these cannot be researched without the structures."""
    if structures := [name for name in why.names if race_of(name)]:
        return f"a finished {' and a '.join(structures)} is needed first"
    return f"{' and '.join(why.names)} {'is' if len(why.names) == 1 else 'are'} not researched"


def _requirement(name: str) -> str:
    return f"a finished {name}" if race_of(name) else f"the upgrade {name}"


def _price_of_side(why: Unavailable) -> str:
    first = why.missing[0]
    if first.account != "supply":
        return f"it costs {_too_dear(first)}."
    more = SUPPLY_FROM.get(race_of(why.who) or "", "more supply")
    return f"it needs {first.needs:g} supply and {first.has:g} is free; get {more} first."


def _too_dear(short: Shortfall) -> str:
    waits = f", {short.aside:g} more are for what workers are on their way to build" if short.aside else ""
    verb = "are" if short.account == "minerals" else "is"
    return f"{short.needs:g} {short.account} and {short.has:g} {verb} left{waits}"


def _too_few(why: Unavailable) -> str:
    return ", ".join(f"{needs - has:g} more {account} needed" for account, needs, has, _ in why.missing)


def _every(why: Unavailable, of_all: str, of_one: str) -> str:
    """Return the text for all judged types, or for the only unit."""
    return of_all.format(" or ".join(why.among)) if why.among else of_one.format(why.who)


def _while_at_work(why: Unavailable) -> str:
    return f" while it has {why.has:g} orders" if why.has > 1 else ""


Form: TypeAlias = "Mapping[Kind, Callable[[Unavailable], str]]"

_BRIEF: Final[Form] = {
    "nobody": lambda why: f"no {why.who}" if why.who else "nobody can now",
    "ability": lambda why: f"{why.who} cannot",
    "weapon": lambda why: f"{why.who} has no weapon",
    "disarmed": lambda why: f"the weapon of {why.who} is off",
    "unfinished": lambda why: f"{why.who} is not finished",
    "researched": lambda _: "researched already",
    "researching": lambda _: "being researched",
    "requirement": lambda why: ", ".join(_lack(why, name) for name in why.names),
    "addon": lambda why: f"needs a {why.names[0]}",
    "energy": lambda why: f"needs {why.needs:g} energy, there is {int(why.has)}",
    "price": _too_few,
    "taken": lambda why: _every(why, "every {} has an order already", "{} has an order already"),
    "occupied": lambda why: _every(why, "no {} is free to build", "no {} is free to build"),
    "queue": lambda why: _every(why, "the queue of every {} is full", "the queue of {} is full"),
    "attached": lambda why: _every(why, "every {} has an add-on already", "{} has an add-on already"),
    "at_work": lambda why: _every(why, "every {} is at work", "{} is at work"),
    "power": lambda why: _every(why, "no {} has power", "{} has no power"),
    "cooldown": lambda _: "cooling down",
    "game": lambda why: _every(why, "the game lets no {} do it now", "not in its present state"),
}
_OF_TEAM: Final[Form] = {
    "nobody": lambda why: f"there is no {why.who}",
    "ability": lambda why: f"{why.who} has no such ability",
    "weapon": lambda why: f"{why.who} has no weapon",
    "disarmed": lambda why: f"the weapon of {why.who} is off while it holds up a unit or a spell disarms it",
    "unfinished": lambda why: f"{why.who} is still under construction ({why.has:.0%})",
    "researched": lambda why: f"{why.names[0]} is researched already",
    "researching": lambda why: f"{why.names[0]} is being researched already",
    "requirement": _needed_first,
    "addon": lambda why: f"{why.who} needs a {why.names[0]} for it",
    "energy": lambda why: f"{why.who} has {int(why.has)} energy and it takes {why.needs:g}",
    "price": lambda why: f"it takes {_too_dear(why.missing[0])}",
    "taken": lambda why: f"{why.who} has an order already in this turn",
    "occupied": lambda why: f"{why.who} is not free to build",
    "queue": lambda why: f"the queue of {why.who} is full",
    "attached": lambda why: f"{why.who} has an add-on already",
    "at_work": lambda why: f"{why.who} is at work",
    "power": lambda why: f"{why.who} has no power",
    "cooldown": lambda why: f"{why.who} cannot again so soon, it takes {why.needs:g} s after each use",
    "game": lambda why: f"the game does not let {why.who} do it now{_while_at_work(why)}",
}
_OF_SIDE: Final[Form] = {
    "nobody": lambda why: f"you have no {why.who}; {HOW_TO_GET.get(why.who, 'build one first')}.",
    "ability": lambda why: f"{why.who} has no such ability.",
    "weapon": lambda why: f"{why.who} has no weapon.",
    "disarmed": lambda why: f"the weapon of your {why.who} is off while it holds up a unit or a spell disarms it.",
    "unfinished": lambda why: f"your {why.who} is not finished yet, it is at {why.has:.0%}.",
    "researched": lambda _: "it is researched already.",
    "researching": lambda _: "it is being researched already.",
    "requirement": lambda why: f"it needs {' and '.join(map(_requirement, why.names))} first.",
    "addon": lambda why: f"no {why.who} has a {why.names[0]}; Build_{why.names[0]}_{why.who} makes one.",
    "energy": lambda why: f"it needs {why.needs:g} energy, and your {why.who} {hex(why.tag)} has {int(why.has)}.",
    "price": _price_of_side,
    "taken": lambda why: f"every {why.who} has an order already in this turn.",
    "occupied": lambda why: f"you have no {why.who} that is free to build.",
    "queue": lambda why: f"the queue of every {why.who} is full; wait until one is done or build another.",
    "attached": lambda why: f"every idle {why.who} has an add-on already; build another {why.who}.",
    "at_work": lambda why: f"every {why.who} is at work; it can be done when one has nothing in its queue.",
    "power": lambda why: f"your {why.who} has no power; build a Pylon near it.",
    "cooldown": lambda why: f"your {why.who} cannot again so soon, it takes {why.needs:g} s after each use.",
    "game": lambda why: f"the game does not take it from your {why.who} at this moment; try again later.",
}
