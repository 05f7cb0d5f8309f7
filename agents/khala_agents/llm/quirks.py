"""What an endpoint was found to refuse by name, so that it is asked without it from then on.

Models and gateways differ in the fields that they take: a reasoning model refuses a temperature, another the name of
the limit of tokens, a third has no system message. Such a refusal costs nothing and names the field. The client asks
once more without it, or by its other name, and remembers; all clients of one model at one endpoint in a process share
what was found. The limit of generated tokens is never left out: it bounds what an answer costs.
"""

from __future__ import annotations

import logging
import re
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias
from weakref import WeakValueDictionary

if TYPE_CHECKING:
    from collections.abc import Mapping

log = logging.getLogger(__name__)

SystemRole: TypeAlias = Literal["system", "developer", "user", "fold"]
"""Role under which the system message is sent; `fold` puts it in front of the first message of the user."""

LIMITS: Final = ("max_tokens", "max_completion_tokens")
"""The two names of the limit of generated tokens."""
CACHE_MARK: Final = "cache_control"
REFUSALS: Final = frozenset({400, 422})
"""Statuses with which an endpoint refuses a field."""

_NEXT_ROLE: Final[Mapping[SystemRole, SystemRole]] = {"developer": "system", "system": "fold", "user": "fold"}
_REFUSES = re.compile(
    r"unsupported|n['o\u2019]t (?:\w+ ){0,2}(?:support|permitted|allowed|accepted|recogni[sz]ed|enabled)|unknown"
    r"|unrecogni[sz]ed|unexpected (?:keyword|field|argument|param)|extra (?:inputs?|fields?)|extra_forbidden|deprecated"
    r"|no longer|cannot both",
    re.IGNORECASE,
)
_RANGE = re.compile(
    r"too (?:large|high|big|small)|at (?:most|least)|less than|greater than|exceed|between", re.IGNORECASE
)
_ROLE = re.compile(
    r"(?:system|developer)[ _-]?(?:role|message|prompt|instruction)|\brole.{0,160}\b(?:system|developer)\b"
    r"|\b(?:system|developer)\b.{0,160}\brole",
    re.IGNORECASE | re.DOTALL,
)
_ROLES = re.compile(r"roles must alternate|only user and assistant roles", re.IGNORECASE)
_WRONG_ROLE = re.compile(r"invalid (?:value|role)|input should be|must be one of", re.IGNORECASE)


class Quirks:
    """What one model at one endpoint was found to refuse.

    Attributes:
        left_out: names of fields that are no longer sent.
        limit: the name of the limit of generated tokens that it takes; None: as the profile says.
        system_role: the role of the system message that it takes; None: as the profile or the model file says.
    """

    def __init__(self) -> None:
        self.left_out: set[str] = set()
        self.limit: str | None = None
        self.system_role: SystemRole | None = None
        self._noted: set[str] = set()

    def fit(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of a request body as this endpoint takes them."""
        fitted = {name: value for name, value in fields.items() if name not in self.left_out}
        if self.limit is not None:
            for other in LIMITS:
                if other != self.limit and other in fitted:
                    value = fitted.pop(other)
                    fitted.setdefault(self.limit, value)
        return fitted

    def learn(self, refusal: bytes, body: Mapping[str, Any], role: SystemRole | None) -> str:
        """Learn from the words with which a request was refused; return what is done from now on, "" for nothing.

        Args:
            refusal: body of the answer.
            body: the request's.
            role: of its system message; None if it has none that could change.
        """
        said = refusal.decode("utf-8", "replace").replace("\\", "")
        next_role = _NEXT_ROLE.get(role) if role else None
        if next_role and _refuses_role(said):
            self.system_role = next_role
            place = "in front of the first message of the user" if next_role == "fold" else "as the role system"
            return f"sends the system message {place}: it refuses the role {role}"
        if not _REFUSES.search(said):
            return ""
        places = {name: _place(name, said) for name in _fields(body)}
        for name in sorted((name for name, place in places.items() if place >= 0), key=places.__getitem__):
            if name not in LIMITS:
                self.left_out.add(name)
                return f"leaves {name} out, which it refuses"
            if self.limit is None and not _RANGE.search(said):
                self.limit = next(other for other in LIMITS if other != name)
                return f"calls the limit of tokens {self.limit}, because it refuses {name}"
        return ""

    def note_once(self, kind: str, sentence: str) -> None:
        """Log a sentence at the level that is shown without -v; each kind once."""
        if kind not in self._noted:
            self._noted.add(kind)
            log.error("%s", sentence)


_found: WeakValueDictionary[tuple[str, str], Quirks] = WeakValueDictionary()


def quirks_of(endpoint: str, model: str) -> Quirks:
    """Return what was found of a model at an endpoint, shared by all clients that hold it."""
    return _found.setdefault((endpoint, model), Quirks())


def _refuses_role(said: str) -> bool:
    if _ROLES.search(said):
        return True
    return bool(_ROLE.search(said)) and bool(_REFUSES.search(said) or _WRONG_ROLE.search(said))


def _fields(body: Mapping[str, Any]) -> set[str]:
    marked = {CACHE_MARK} if CACHE_MARK in str(body.get("system", "")) + str(body.get("messages", "")) else set()
    return {name for name in body if name not in {"model", "messages", "system"}} | marked


def _place(name: str, said: str) -> int:
    """Return where a refusal names a field: in quotes, at a colon, or anywhere if it is no usual word; -1: nowhere."""
    word = re.escape(name)
    rare = rf"|(?<![\w.]){word}(?!\w)" if "_" in name or len(name) >= 8 else ""
    found = re.search(rf"[\"'`]{word}[\"'`]|\b{word}:|: {word}\b{rare}", said)
    return found.start() if found else -1
