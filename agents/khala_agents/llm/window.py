"""How many tokens a model reads and writes at most, and how many there are in a prompt.

A model file may say how large the context is. Otherwise some servers tell, and all others say it when they refuse a
prompt that is too long. Prompts are estimated at four bytes a token; an endpoint's own counts tell how far off that is
for its vocabulary, in which digits, of which our prompts have many, may be a token each.

All agents of a process that ask the same model share what is learned. Above it: `khala_agents.llm.limits` and
`khala_agents.llm_policy`.
"""

from __future__ import annotations

import logging
import re
from collections import deque
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable, Mapping

    from khala_agents.llm.client import Origin
    from khala_protocol.messages import ModelCall, Usage

    Read = Callable[[str], Awaitable[Any]]
    """Returns the JSON of an address below the base URL, or of `//path` below the root of its host; None if none."""

log = logging.getLogger(__name__)

UNCOUNTED: Final = 1.4
"""So many times as many tokens as estimated are expected where it matters, until an endpoint has counted: the most that
was seen in a whole prompt."""
MOST_UNCOUNTED: Final = 2.0
"""The same where money stands on it."""
MARGIN: Final = 1.15
"""From the first count on, it is the highest count of money, and so much more."""
SPARE: Final = 1.03
"""So much more than the highest of the last counts is expected of a prompt."""
RECENT: Final = 8
"""Counts that this is the highest of."""
ANSWER_TOKENS: Final = 1_000
"""Room for an answer where the model file has no `max_tokens`, but at most a quarter of the context."""


class TokenScale:
    """Tokens of a model for each token that was estimated."""

    def __init__(self) -> None:
        self._estimated = 0
        self._counted = 0
        self._highest = 0.0
        self._newest: deque[float] = deque(maxlen=RECENT)

    @property
    def known(self) -> bool:
        """Whether the endpoint has counted a prompt."""
        return self._counted > 0

    @property
    def factor(self) -> float:
        """The mean over what was counted; 1 before that."""
        return self._counted / self._estimated if self.known else 1.0

    @property
    def high_factor(self) -> float:
        """The highest of the last counts: a prompt of tags and points has more tokens than one of words."""
        return max(self._newest, default=UNCOUNTED)

    def most(self, estimated: float) -> float:
        """Return the most tokens that a prompt of so many estimated tokens may be billed with."""
        return estimated * (MARGIN * self._highest if self.known else MOST_UNCOUNTED)

    def learn(self, counted: int, estimated: int) -> None:
        """Take in the endpoint's own count of a prompt."""
        if estimated > 0 and counted > 0:
            self._estimated += estimated
            self._counted += counted
            self._highest = max(self._highest, counted / estimated)
            self._newest.append(counted / estimated)

    def learn_from(self, usage: Usage, estimated: int) -> None:
        """Take in the usage of a request that was answered."""
        if not usage.unknown_requests:
            self.learn(usage.prompt_tokens, estimated)


class ContextWindow:
    """The context of one model.

    Args:
        tokens: its size; None if nobody has said it yet.
        scale: of the model's tokens.
        told: asks the endpoint for the size.

    Attributes:
        tokens: its size; None if unknown.
    """

    def __init__(
        self,
        tokens: int | None = None,
        scale: TokenScale | None = None,
        told: Callable[[], Awaitable[int | None]] | None = None,
    ) -> None:
        self.tokens = tokens
        self.scale = scale or TokenScale()
        self._told = told

    async def ask(self) -> None:
        """Ask the endpoint for the size, if nobody has said it; an endpoint that does not tell is no error."""
        if self.tokens is None and self._told is not None:
            self.tokens = await self._told()

    def room(self, answer_tokens: int | None, origin: Origin | None = None, attempt: int = 1) -> int | None:  # noqa: ARG002
        """Return the estimated tokens that a prompt may have beside its answer; None if the size is unknown.

        Args:
            answer_tokens: the limit of generated tokens; None for no limit.
            origin: the decision that it is for.
            attempt: number of the try.
        """
        if self.tokens is None:
            return None
        answer = _answer(self.tokens, answer_tokens)
        return max(int((self.tokens - answer) / (self.scale.high_factor * SPARE)), 0)

    def learn(self, refusal: str, estimated: int, answer_tokens: int | None) -> bool:
        """Learn from the words with which a prompt of so many estimated tokens was refused.

        Returns:
            Whether it was too long for the context, so that a shorter prompt is worth a try.
        """
        found = context_in(refusal)
        if found is None:
            return False
        limit, sent = found
        if limit is None:  # it does not say: so much that three quarters of this prompt would fit
            limit = int(0.75 * estimated * self.scale.factor) + (answer_tokens or 0)
        elif sent is None:  # prompt and answer are too long together: more than this, or the next is refused as well
            sent = int(1.25 * max(limit - _answer(limit, answer_tokens), 0))
        if sent is not None:
            self.scale.learn(sent, estimated)
        if self.tokens != limit:
            log.error("the model's context holds %d tokens: prompts are shortened to fit it from now on", limit)
        self.tokens = limit
        return True


class RecordedWindow(ContextWindow):
    """What prompts of a recording were fitted to, so that its replay makes the same ones."""

    def __init__(self, calls: Iterable[ModelCall]) -> None:
        super().__init__()
        self._rooms = {(call.episode, call.step, call.purpose, call.attempt): call.room_tokens for call in calls}

    def room(self, answer_tokens: int | None, origin: Origin | None = None, attempt: int = 1) -> int | None:  # noqa: ARG002
        """Return what the prompt of this try was fitted to."""
        if origin is None:
            return None
        return self._rooms.get((origin.episode, origin.step, origin.purpose, attempt))

    def learn(self, refusal: str, estimated: int, answer_tokens: int | None) -> bool:  # noqa: ARG002
        """Return whether it was a refusal of a prompt that was too long."""
        return context_in(refusal) is not None


def _answer(context: int, answer_tokens: int | None) -> int:
    return min(ANSWER_TOKENS, context // 4) if answer_tokens is None else answer_tokens


_TOO_LONG = re.compile(
    r"context.?(?:length|size|window|limit)|exceed_context|maximum number of tokens|(?:prompt|input)s? (?:is |are )?too"
    r" (?:long|large)|too many (?:input |prompt )?tokens|(?:prompt|input)[^.]{0,40} exceeds?|inputs` tokens",
    re.IGNORECASE,
)
_NUMBER = r"([\d][\d,_]*)"
_LIMITS: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"context (?:length|size|window|limit)(?: of(?: only)?| is| \(|:)? ?{_NUMBER}",
        rf"{_NUMBER} (?:tokens? )?max(?:imum)?\b",
        rf"(?:allowed|limit(?:ed)?|maximum)(?: of| to| is| \(|:)? ?{_NUMBER}",
        rf"(?:>|<=|at most|exceeds?(?: the)?) ?{_NUMBER}",
        rf"n_ctx\D{{0,4}}{_NUMBER}",
    )
)
_SENT: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"{_NUMBER} (?:tokens )?(?:in|from|of) the (?:messages|input|prompt)",
        rf"{_NUMBER} (?:`inputs`|input|prompt) tokens",
        rf"requested tokens \({_NUMBER}\)",
        rf"(?:resulted in |request \(|too long: |count \(|count of |contains |has |got ){_NUMBER}(?: tokens|\))",
    )
)


def context_in(refusal: str) -> tuple[int | None, int | None] | None:
    """Return the size of the context and the tokens of the prompt that a refusal names; None for another refusal."""
    if not _TOO_LONG.search(refusal):
        return None
    return _first(_LIMITS, refusal), _first(_SENT, refusal)


def _first(patterns: Iterable[re.Pattern[str]], text: str) -> int | None:
    for pattern in patterns:
        if found := pattern.search(text):
            return int(found[1].replace(",", "").replace("_", ""))
    return None


# --- what endpoints tell ------------------------------------------------------------------------------

_MODELS: Final = "/models"
_PROPS: Final = "//props"
_LOADED_BY_OLLAMA: Final = "//api/ps"
_LOADED_BY_LM_STUDIO: Final = "//api/v0/models"
TELLERS: Final[Mapping[str, tuple[str, ...]]] = {
    "llamacpp": (_PROPS,),
    "vllm": (_MODELS,),
    "ollama": (_LOADED_BY_OLLAMA,),
    "openrouter": (_MODELS,),
    "litellm": (_MODELS,),
    "compatible": (_MODELS, _PROPS, _LOADED_BY_LM_STUDIO),
}
"""Addresses at which an endpoint of each profile may tell the size, in the order in which they are asked. What Ollama
says of a model that is not loaded is what the model could hold, not what it will."""
_SIZES: Final = ("max_model_len", "loaded_context_length", "context_length", "context_window")
"""Names of the size in an entry of a list of models."""


async def told_context(profile: str, model: str, read: Read) -> int | None:
    """Return the size of a model's context as its endpoint tells it; None if it does not."""
    for address in TELLERS.get(profile, ()):
        size = _size_in(await read(address), model)
        if size is not None:
            return size
    return None


def _size_in(said: Any, model: str) -> int | None:
    if not isinstance(said, dict):
        return None
    settings = said.get("default_generation_settings")
    if isinstance(settings, dict):  # llama.cpp: of one of its slots
        return _tokens(settings.get("n_ctx"))
    entries = said.get("data", said.get("models"))
    entries = [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
    named = [entry for entry in entries if model in (entry.get("id"), entry.get("name"), entry.get("model"))]
    for entry in named or (entries if len(entries) == 1 else ()):
        for name in _SIZES:
            if (size := _tokens(entry.get(name))) is not None:
                return size
    return None


def _tokens(value: Any) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) and value > 0 else None
