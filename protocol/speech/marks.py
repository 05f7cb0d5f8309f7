"""Characters: what counts as a quote, which foreign marks stand for which ASCII ones, and what a fault is.

The lowest module of the text language; every other one of this package stands on it.
"""

from __future__ import annotations

QUOTES = "'\"`´“”„‟‘’‚‛«»‹›「」『』"  # noqa: RUF001 - telling these apart is what the string is for
"""Every mark that a model puts around a word or a message."""

SHORT = 60
"""Characters of a name or of a faulty text that are repeated to the model; more would only fill its context."""

_ONE_FOR_ONE = (
    {wide: wide - 0xFEE0 for wide in range(0xFF01, 0xFF5F)}
    | dict.fromkeys(map(ord, "\u00a0\u2002\u2003\u2009\u200b\u202f\u2060\u3000\ufeff"), " ")
    | dict.fromkeys(map(ord, "\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"), "\n")
    | str.maketrans("【】〔〕、\u2212", "[][],-")  # noqa: RUF001 - as above
)


class Malformed(ValueError):
    """Something that looks like a call and is none; the text is the sentence that the model is told."""


def to_ascii(text: str) -> str:
    """The text with full-width marks as ASCII and line ends as LF, one character for one: offsets stay."""
    return text.translate(_ONE_FOR_ONE)
