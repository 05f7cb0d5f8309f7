"""Which keys a key expression matches: the part of Zenoh's language that this project uses.

A key is parts joined by `/`. In an expression `*` stands for exactly one part and `**` for any number of
them, including none. `khala_protocol.keys` gives keys their meaning; here they are only strings.
"""

from __future__ import annotations

import re
from functools import lru_cache

from khala_protocol.errors import WrongKey

_WILD = frozenset({"*", "**"})
_PART = re.compile(r"[^/*#?$@][^/*#?$]*")


def check_key(key: str) -> str:
    """Return `key` if something can be published under it.

    Raises:
        WrongKey: it has an empty part, a wildcard, or one of the characters `# ? $` or a leading `@`, which Zenoh
            reserves.
    """
    return _check(key, wild=False)


def check_key_expr(key_expr: str) -> str:
    """Return `key_expr` if it can be subscribed to.

    Raises:
        WrongKey: it has an empty part, `*` next to other characters, or a character that Zenoh reserves.
    """
    return _check(key_expr, wild=True)


@lru_cache(maxsize=4096)
def matches(key_expr: str, key: str) -> bool:
    """Return whether `key_expr` matches `key`."""
    return _match(key_expr.split("/"), key.split("/"))


def _match(pattern: list[str], parts: list[str]) -> bool:
    if not pattern:
        return not parts
    head, rest = pattern[0], pattern[1:]
    if head == "**":
        return any(_match(rest, parts[skipped:]) for skipped in range(len(parts) + 1))
    return bool(parts) and head in {"*", parts[0]} and _match(rest, parts[1:])


def _check(text: str, *, wild: bool) -> str:
    for part in text.split("/"):
        if not (_PART.fullmatch(part) or (wild and part in _WILD)):
            what, hint = ("key expression", " or the wildcards '*' and '**'") if wild else ("key", "")
            raise WrongKey(
                f"{text!r} is no {what}: join parts with '/', each of them one or more characters "
                f"without '* # ? $' and not beginning with '@'{hint}"
            )
    return text
