"""Foreign text for a terminal: no character of it does anything but stand there.

Models, agents, endpoints and recordings may hold escape sequences, which set a terminal's title or its clipboard, and
marks that turn the direction of text around. Everything that is printed or logged passes here; JSON needs nothing,
since it escapes them itself.
"""

from __future__ import annotations

import logging
import unicodedata


def visible(text: str) -> str:
    r"""Return a text in which every character but a line break or tab can be seen: `\x1b` for an escape.

    Replaced are control characters (C0, C1), marks of direction and of no width, surrogates, and what has no glyph.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def visible_line(text: str) -> str:
    """Return the same on one line."""
    return visible(" ".join(text.split()))


class VisibleFormatter(logging.Formatter):
    """A formatter of logs whose lines are visible text."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the text of a record."""
        return visible(super().format(record))


def _shown(character: str) -> str:
    if character.isprintable() or character in "\n\t" or unicodedata.category(character) == "Zs":
        return character
    return character.encode("unicode_escape").decode()
