"""The page of the text language, from the modules that read it."""

from __future__ import annotations

import inspect

from docs.pages.markdown import fence, head, join
from khala_protocol import speech
from khala_protocol.speech import arguments, echoes, headings


def page() -> str:
    """Return the form of a reply, and the rules of tolerance."""
    _, example, *paragraphs = (inspect.getdoc(speech) or "").split("\n\n")
    return join(
        head("The text language", "the docstrings of `protocol/khala_protocol/speech`"),
        "What an agent says. Names of actions and what they take are in [the catalogue](actions.md).",
        fence(inspect.cleandoc(example)),
        *(text for text in paragraphs if text.startswith("`parse`")),
        "Each rule below has a row in a table test, `tests/protocol/test_speech.py`.",
        "## Calls and messages",
        _table(speech),
        "## Headings",
        _table(headings),
        "## Arguments",
        _table(arguments),
        "## Quotes of the prompt",
        "What a reply repeats of its prompt is no order but a mention. If it holds nothing else, its agent "
        "hears so in its next observation.",
        _table(echoes),
    )


def _table(module: object) -> str:
    """Return the table in the docstring of a module."""
    lines = (inspect.getdoc(module) or "").splitlines()
    return "\n".join(line for line in lines if line.startswith("|"))
