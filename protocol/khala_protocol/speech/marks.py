"""Characters: what counts as a quote, which foreign marks stand for which ASCII ones, and what a fault is.

The lowest module of the text language; every other one of this package stands on it.
"""

from __future__ import annotations

import html
import re

QUOTES = "'\"`´“”„‟‘’‚‛«»‹›「」『』"  # noqa: RUF001 - telling these apart is what the string is for
"""Every mark that a model puts around a word or a message."""

SHORT = 60
"""Characters of a name or of a faulty text that are repeated to the model; more would only fill its context."""

_ONE_FOR_ONE = (
    {wide: wide - 0xFEE0 for wide in range(0xFF01, 0xFF5F)}
    | dict.fromkeys(map(ord, "\u00a0\u2002\u2003\u2009\u200b\u202f\u2060\u3000\ufeff"), " ")
    | dict.fromkeys(map(ord, "\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"), "\n")
    | dict.fromkeys(range(0x2010, 0x2014), "-")
    | str.maketrans("【】〔〕、\u2212〈〉《》⟨⟩", "[][],-<><><>")  # noqa: RUF001 - as above
)
_ESCAPED = re.compile(
    r"&(?:lt|gt|quot|apos|amp|nbsp|#39|#x27|#34);|\\[\"'nrt-]|<0[xX][0-9a-fA-F]++>",
    re.IGNORECASE,
)
_ENTITIES = {"lt": "<", "gt": ">", "quot": '"', "#34": '"', "apos": "'", "#39": "'", "#x27": "'", "amp": "&"}
_BACKSLASHED = re.compile(r"\\([\"'nt])")


class MalformedCall(ValueError):
    """Something that looks like a call and is none; the text is the sentence that the model is told."""


def to_ascii(text: str) -> str:
    """The text with full-width marks as ASCII and line ends as LF, offset for offset the same.

    What is written with more than one character (`&lt;`, an escaped quote or line end, a tag between angle brackets)
    becomes the one that it stands for, and blanks.
    """
    plain = text.translate(_ONE_FOR_ONE)
    return _ESCAPED.sub(_as_long, plain) if "&" in plain or "\\" in plain or "<0" in plain else plain


def _as_long(match: re.Match[str]) -> str:
    """What an escape stands for, filled up with blanks to its length."""
    escape = match.group()
    if escape[0] == "<":
        return f" {escape[1:-1]} "
    if escape[0] == "\\":
        return {"n": " \n", "r": " \n", "t": "  ", "-": "--"}.get(escape[1].lower(), " " + escape[1])
    mark = _ENTITIES.get(escape[1:-1].lower(), " ")
    return mark.ljust(len(escape)) if mark == "<" else mark.rjust(len(escape))


def unescaped(words: str) -> str:
    """What a message says: without blanks around it, and with the characters that escapes stand for."""
    if "&" in words:
        words = html.unescape(words).strip(QUOTES + " \t\n") if "&#" in words or ";" in words else words
    if "\\" in words:
        words = _BACKSLASHED.sub(lambda match: {"n": "\n", "t": "\t"}.get(match[1], match[1]), words).rstrip("\\")
    return words.strip()
