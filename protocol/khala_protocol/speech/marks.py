"""Characters: which are quotes, which foreign marks stand for which ASCII ones, and what a fault is.

The lowest module of the text language; all other modules of this package use it.
"""

from __future__ import annotations

import html
import re

QUOTES = "'\"`´“”„‟‘’‚‛«»‹›「」『』"  # noqa: RUF001 - telling these apart is what the string is for
"""Every mark that a model puts around a word or a message."""

SHORT = 60
"""Characters of a name or of a faulty text that are quoted to the model; more would only fill its context."""

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
_CHARACTER = re.compile(
    r"&(?:#[0-9]{1,7}+(?![0-9])|#[xX][0-9a-fA-F]{1,6}+(?![0-9a-fA-F])|[A-Za-z][A-Za-z0-9]{1,30}+);?+"
)
_BACKSLASHED = re.compile(r"\\([\"'nt])")


class MalformedCall(ValueError):
    """Something that looks like a call, but is not one; the text is the sentence for the model."""


def to_ascii(text: str) -> str:
    """Return the text with full-width marks as ASCII and line ends as LF, each at the same offset.

    An escape of several characters (`&lt;`, an escaped quote or line end, a tag between angle brackets)
    becomes the character that it stands for, and blanks.
    """
    plain = text.translate(_ONE_FOR_ONE)
    return _ESCAPED.sub(_as_long, plain) if "&" in plain or "\\" in plain or "<0" in plain else plain


def _as_long(match: re.Match[str]) -> str:
    """Return the character of an escape, padded with blanks to its length."""
    escape = match.group()
    if escape[0] == "<":
        return f" {escape[1:-1]} "
    if escape[0] == "\\":
        return {"n": " \n", "r": " \n", "t": "  ", "-": "--"}.get(escape[1].lower(), " " + escape[1])
    mark = _ENTITIES.get(escape[1:-1].lower(), " ")
    return mark.ljust(len(escape)) if mark == "<" else mark.rjust(len(escape))


def unescape(words: str) -> str:
    """Return the text of a message: without blanks around it, and with the characters that escapes stand for."""
    if "&" in words:
        words = _CHARACTER.sub(lambda match: html.unescape(match[0]), words).strip(QUOTES + " \t\n")
    if "\\" in words:
        words = _BACKSLASHED.sub(lambda match: {"n": "\n", "t": "\t"}.get(match[1], match[1]), words).rstrip("\\")
    return words.strip()
