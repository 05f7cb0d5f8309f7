"""The page of the text of an observation: its sections by kind of agent, and the order in which they are shortened."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

from docs.pages.markdown import code, codes, head, join, table
from khala_bridge.observe.text import SECTIONS_OF, find_sections

if TYPE_CHECKING:
    from khala_bridge.observe.text import Section


def page() -> str:
    """Return the sections, who has which, and what a short page leaves out."""
    return join(
        head("Observations", "`bridge/khala_bridge/observe/text`"),
        "An observation is a text of sections. Which ones an agent has follows from its `kind`, unless its task names "
        "them (`sections`, see [task files](task-files.md)). A section with nothing to say is left out. To write one of"
        " your own: [sections](../how-to/sections.md). Why it is built so: [observations](../design/observation.md).",
        "## Sections",
        table(("name", "says", "shown to"), [(code(s.name), _about(s.write), _shown_to(s)) for s in _in_order()]),
        "## Order by kind of agent",
        table(("kind", "sections"), [(code(kind), codes(names)) for kind, names in SECTIONS_OF.items()]),
        "## What a short page leaves out",
        "With `text_tokens`, a page that is too long takes shorter forms of its sections in this order until it fits. "
        "Only whole forms are exchanged; no line is cut. The page says what is missing. What has no shorter form always"
        " stays: time and resources, own units, valid actions, errors, messages, the task.",
        table(("", "section", "what is missing then"), _forms()),
    )


def _in_order() -> list[Section]:
    """Return every shipped section, in the order in which pages have them."""
    names = dict.fromkeys(name for names in SECTIONS_OF.values() for name in names)
    return list(find_sections(names))


def _about(write: object) -> str:
    return (inspect.getdoc(write) or "").split("\n\n", maxsplit=1)[0]


def _shown_to(section: Section) -> str:
    kinds = [kind for kind, names in SECTIONS_OF.items() if section.name in names]
    return "all" if len(kinds) == len(SECTIONS_OF) else codes(kinds)


def _forms() -> list[tuple[int, str, str]]:
    forms = sorted((form.rank, section.name, form.says) for section in _in_order() for form in section.shorter)
    return [(place, code(name), says) for place, (_, name, says) in enumerate(forms, 1)]
