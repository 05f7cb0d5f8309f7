"""What an endpoint was found to refuse by name, so that it is asked without it from then on.

Models and gateways differ in the fields that they take: a reasoning model refuses a temperature, another the name of
the limit of tokens, a third has no system message. Such a refusal costs nothing and names the field. The client asks
once more without it, or by its other name, and remembers; all clients of one model at one endpoint in a process share
what was found. The limit of generated tokens is never left out: it bounds what an answer costs.

Names of fields with dots are paths: `text.format` is the field `format` of the object `text`.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias
from weakref import WeakValueDictionary

from khala_agents.llm.schemas import keywords_in

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

log = logging.getLogger(__name__)

SystemRole: TypeAlias = Literal["system", "developer", "user", "fold"]
"""Role under which the system message is sent; `fold` puts it in front of the first message of the user."""

LIMITS: Final = ("max_tokens", "max_completion_tokens")
"""The two names of the limit of generated tokens in chat completions."""
ALL_LIMITS: Final = frozenset({*LIMITS, "max_output_tokens", "generationConfig.maxOutputTokens"})
"""Its names in all APIs."""
CACHE_MARK: Final = "cache_control"
REFUSALS: Final = frozenset({400, 422})
"""Statuses with which an endpoint refuses a field."""

_NEXT_ROLE: Final[Mapping[SystemRole, SystemRole]] = {"developer": "system", "system": "fold", "user": "fold"}
_REFUSES = re.compile(
    r"unsupported|n['o\u2019]t (?:\w+ ){0,2}(?:support|permitted|allowed|accepted|recogni[sz]ed|enabled)|unknown"
    r"|unrecogni[sz]ed|unexpected (?:keyword|field|argument|param)|extra (?:inputs?|fields?)|extra_forbidden|deprecated"
    r"|no longer|cannot both|unavailable|only works in thinking mode",
    re.IGNORECASE,
)
_TOO_COMPLEX = re.compile(
    r"too many states|(?:schema|grammar|enum|constraint)\b.{0,120}\btoo (?:large|long|many|complex|deep)"
    r"|too (?:large|long|many|complex)\b.{0,60}\b(?:schema|grammar|enum)",
    re.IGNORECASE | re.DOTALL,
)
"""An endpoint cannot hold an answer to this form, though it takes others."""
_ALSO_CALLED: Final[Sequence[tuple[str, re.Pattern[str]]]] = tuple(
    (name, re.compile(pattern, re.IGNORECASE))
    for name, pattern in (
        (r"responseSchema|response_format|format", r"JSON mode|response_?schema|structured[ _]outputs?"),
        (r"toolConfig", r"function[ _]?calling[ _]?config"),
        (
            r"tools",
            r"(?:function|tool)[ _]call(?:ing|s)|support (?:tools|tool use|functions)|function calling|\btool use",
        ),
        (
            r"thinkingConfig|effort|reasoning_effort|enable_thinking|thinking|type",
            r"thinking[ _]?(?:level|budget|config|mode)|effort parameter|support (?:thinking|reasoning)",
        ),
    )
)
"""Fields, by the last part of their names, that refusals call otherwise."""
_GO_WITH: Final[Mapping[str, str]] = {
    "tools": "toolConfig",
    "generationConfig.responseSchema": "generationConfig.responseMimeType",
    "generationConfig.responseMimeType": "generationConfig.responseSchema",
}
"""Fields that mean nothing without another."""
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


@dataclass(frozen=True, slots=True)
class SentFields:
    """The fields of a request beside its model and its messages, by name or path.

    Attributes:
        form: those that hold its answer to a form.
    """

    form: Mapping[str, Any]
    others: Mapping[str, Any]


class Quirks:
    """What one model at one endpoint was found to refuse.

    Attributes:
        left_out: names of fields that are no longer sent.
        limit: the name of the limit of generated tokens that it takes; None: as the profile says.
        system_role: the role of the system message that it takes; None: as the profile or the model file says.
        keywords: of JSON schemas that are no longer sent.
    """

    def __init__(self) -> None:
        self.left_out: set[str] = set()
        self.limit: str | None = None
        self.system_role: SystemRole | None = None
        self.keywords: set[str] = set()
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

    def learn(self, refusal: bytes, sent: SentFields, role: SystemRole | None) -> str:
        """Learn from the words with which a request was refused; return what is done from now on, "" for nothing.

        Args:
            refusal: body of the answer.
            sent: of the request; another client may have learned meanwhile.
            role: of its system message; None if it has none that could change.
        """
        said = refusal.decode("utf-8", "replace").replace("\\", "")
        next_role = _NEXT_ROLE.get(role) if role else None
        if next_role and _refuses_role(said):
            self.system_role = next_role
            place = "in front of the first message of the user" if next_role == "fold" else "as the role system"
            return f"sends the system message {place}: it refuses the role {role}"
        used = keywords_in(list(sent.form.values()))
        if _TOO_COMPLEX.search(said):
            return self._simplify(list(sent.form), used)
        if not _REFUSES.search(said):
            return ""
        named = {word for word in used if _names_keyword(said, word)}
        if named:
            self.keywords |= named
            return f"leaves {' and '.join(sorted(named))} out of schemas, which it refuses"
        return self._leave_out([*sent.form, *sent.others], said)

    def _simplify(self, form: Sequence[str], limiting: set[str]) -> str:
        """Leave the limits out of a form that is too much for the endpoint, or else the form."""
        if limiting:
            self.keywords |= limiting
            return "leaves the limits of texts, numbers and lists out of schemas: they are too much for it"
        self.left_out |= set(form)
        return f"leaves {' and '.join(form)} out: the form is too much for it" if form else ""

    def _leave_out(self, fields: Iterable[str], said: str) -> str:
        """Leave the field out that a refusal names first, or call the limit by its other name."""
        places = {name: _place(name, said) for name in fields}
        for name in sorted((name for name, place in places.items() if place >= 0), key=places.__getitem__):
            if name not in ALL_LIMITS:
                self.left_out |= {name, _GO_WITH.get(name, name)}
                return f"leaves {name} out, which it refuses"
            if name in LIMITS and name != self.limit and not _RANGE.search(said):
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


def _names_keyword(said: str, word: str) -> bool:
    """Return whether a refusal names a keyword of schemas, some of which are usual words."""
    if re.search(rf"[\"'`]{word}[\"'`]", said):
        return True
    return bool(re.search(r"propert(?:y|ies)|keyword", said)) and bool(re.search(rf"\b{word}\b", said))


def _place(name: str, said: str) -> int:
    """Return where a refusal names a field: in quotes, at a colon, or anywhere if it is no usual word; -1: nowhere."""
    whole, _, last = name.rpartition(".")
    snake = re.sub(r"(?<=[a-z])([A-Z])", r"_\1", last).lower()
    words = {name, last, snake} | ({whole} if whole and whole != "generationConfig" else set())
    found = [place for word in words if (place := _place_of(word, said)) >= 0]
    for names, pattern in _ALSO_CALLED:
        if re.fullmatch(names, last) and (called := pattern.search(said)):
            found.append(called.start())
    return min(found, default=-1)


def _place_of(name: str, said: str) -> int:
    word = re.escape(name)
    rare = rf"|(?<![\w.]){word}(?!\w)" if "_" in name or len(name) >= 8 else ""
    found = re.search(rf"[\"'`]{word}[\"'`]|\b{word}:|: {word}\b{rare}", said)
    return found.start() if found else -1
