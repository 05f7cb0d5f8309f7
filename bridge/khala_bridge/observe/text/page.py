"""A page: an agent's text at one step, and how its sections are found, written and made shorter.

A section is a function from a page to lines; it has a name, and `@section` registers it. An empty section yields
nothing and is left out. Names in the agent's configuration, or else its kind, select the sections of its page. A
section may have shorter forms, registered by `@shorter` with a rank; a page that is over its budget uses them in
ascending order of ranks until it fits. No line is ever cut.

Sections are pure functions of the page: no clock, no game, no state.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeAlias

from khala_bridge.observe.text.tokens import tokens
from khala_bridge.observe.text.words import INDENT
from khala_protocol.errors import ConfigError
from khala_protocol.trust import import_trusted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from khala_bridge.observe.observation import AgentObservation
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import TeamView, View

    Write: TypeAlias = Callable[["Page"], Iterable[str]]

Part: TypeAlias = Literal[
    "counts", "events", "alerts", "others", "resources", "places", "power", "structures", "map", "army", "economy"
]
"""A part of the view that is made only for agents with a section that shows it."""


@dataclass(frozen=True)
class Page:
    """The data for the sections."""

    observation: AgentObservation
    task: TaskConfig
    conditions: dict[str, str] = field(default_factory=dict)
    """By tag, the written condition of a unit, and its changes: pages of one moment that tell of the same changes share
    it, see `units`."""

    @property
    def view(self) -> View:
        """The agent's view."""
        return self.observation.view

    @property
    def teams(self) -> Sequence[TeamView]:
        """The agent's teams that have units, or need none."""
        return self.observation.view.teams

    @cached_property
    def correspondents(self) -> list[str]:
        """Names of all that this agent may write to."""
        return [agent.name for agent in self.task.correspondents(self.observation.agent)]

    @property
    def channels(self) -> Sequence[str]:
        """Channels that it may write and listen to."""
        return self.task.channels if self.task.communication else ()


# --- sections -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Shorter:
    """A shorter form of a section."""

    rank: int
    says: str
    """What the shorter form leaves out, as a page says it."""
    write: Write


@dataclass(frozen=True, slots=True)
class Section:
    """A registered section."""

    name: str
    write: Write
    parts: frozenset[Part] = frozenset()
    """The parts of the view that it shows."""
    shorter: list[Shorter] = field(default_factory=list)


SECTIONS: dict[str, Section] = {}
"""Every registered section by name."""


def section(name: str, *, parts: Iterable[Part] = (), replace: bool = False) -> Callable[[Write], Write]:
    """Register a function as the section of this name.

    Args:
        name: as configurations use it.
        parts: of the view, those that it shows in addition to teams, time and resources.
        replace: whether it replaces the section that has the name already, with its shorter forms.

    Raises:
        ValueError: the name is taken, and `replace` was not given.
    """
    if name in SECTIONS and not replace:
        raise ValueError(f"there is a section '{name}' already; give replace=True to replace it")

    def register(write: Write) -> Write:
        SECTIONS[name] = Section(name, write, frozenset(parts))
        return write

    return register


def shorter(name: str, *, rank: int, says: str) -> Callable[[Write], Write]:
    """Register a function as a shorter form of a section.

    Args:
        name: of the section.
        rank: its place in the order of use; the lowest first, over all sections of a page.
        says: what it leaves out, for the reader: `unit knowledge`.
    """

    def register(write: Write) -> Write:
        SECTIONS[name].shorter.append(Shorter(rank, says, write))
        return write

    return register


def find_sections(names: Iterable[str]) -> tuple[Section, ...]:
    """Return the sections of these names: `game`, or `my_module:game` for one that a module registers on import.

    Raises:
        ConfigError: a name has no section; the text lists the existing ones.
    """
    return tuple(map(_find, names))


def _find(reference: str) -> Section:
    module, colon, name = reference.rpartition(":")
    if colon:
        import_trusted(module, source=f"section '{reference}'")
    if name not in SECTIONS:
        close = difflib.get_close_matches(name, SECTIONS, n=1)
        hint = f"did you mean '{close[0]}'?" if close else f"there are {', '.join(sorted(SECTIONS))}"
        raise ConfigError(f"there is no section '{name}' of an observation: {hint}")
    return SECTIONS[name]


# --- writing --------------------------------------------------------------------------------------------------


_BETWEEN = "\n\n"


def render(page: Page, sections: Sequence[Section], budget: int | None = None) -> str:
    """Return the text of a page.

    Args:
        page: the data of the sections.
        sections: its sections, in order.
        budget: its limit of tokens, approximate; None for no limit. A page whose shortest form has more gets that form.
    """
    blocks = [_block(section.write, page) for section in sections]
    if budget is not None:
        blocks = _shorten(page, sections, blocks, budget)
    return _BETWEEN.join(block for block in blocks if block) + "\n"


def _block(write: Write, page: Page) -> str:
    return "\n".join(write(page))


def _shorten(page: Page, sections: Sequence[Section], blocks: list[str], budget: int) -> list[str]:
    """Return the blocks with as many shorter forms as needed, in the order of ranks, and a notice of the rest."""
    costs = [tokens(block + _BETWEEN) for block in blocks]
    missing: dict[str, str] = {}
    notice = ""
    steps = ((form, place) for place, section in enumerate(sections) for form in section.shorter)
    for form, place in sorted(steps, key=lambda step: (step[0].rank, step[1])):
        if sum(costs) + tokens(notice + _BETWEEN) <= budget:
            break
        block = _block(form.write, page)
        cost = tokens(block + _BETWEEN)
        if cost >= costs[place]:
            continue
        blocks[place], costs[place] = block, cost
        missing[sections[place].name] = form.says
        notice = "\n".join(_notice(missing.values()))
    return [*blocks[:-1], notice, *blocks[-1:]]


def _notice(missing: Iterable[str]) -> Iterator[str]:
    """Yield a notice of what was left out; it stands before the last section, which says what to do now."""
    yield "Left out to keep this short"
    yield from (f"{INDENT}{words}" for words in missing)
