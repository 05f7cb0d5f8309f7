"""What became of a model's answer: whether it has words to play, and if not, why.

An answer that arrived need not have any: the reasoning may have eaten all tokens, a filter may have taken the words,
the model may decline. Clients of all kinds of endpoints say here what they found, in common terms.
"""

from __future__ import annotations

import contextlib
import json
import re
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from khala_agents.secret import excerpt, scrub
from khala_protocol.reasoning import BEGIN, BLOCK_END, END, FINAL

Verdict: TypeAlias = Literal["ok", "empty", "cut", "refused", "filtered"]
"""Whether a completion has words to play. If not: the model said nothing, it reached its limit of tokens before it said
anything, it declined, or a filter of the endpoint took the answer away."""

CUT: Final = frozenset({"length", "max_tokens", "model_length", "max_output_tokens", "model_context_window_exceeded"})
"""Why an answer ended, in the words of endpoints in lower case: at a limit of tokens."""
FILTERED: Final = frozenset(
    {"content_filter", "content-filter", "sensitive"}
    | {"safety", "recitation", "blocklist", "prohibited_content", "spii", "language", "image_safety"}
)
"""The same: a filter took it away. Those of the second line are Gemini's."""

_TOOLS = "the model called tools, of which none are offered; they are read as its orders"
_CALL = re.compile(r"<\s*+[A-Za-z]\w*+\s*+\(")
_BLOCK = re.compile(rf"(?:{BEGIN}).*?(?:{BLOCK_END}|\Z)", re.IGNORECASE | re.DOTALL)
_BEGAN_BEFORE = re.compile(rf"\A.*(?:{END}|{FINAL})", re.IGNORECASE | re.DOTALL)
"""Reasoning whose beginning stands in the prompt, as templates of some models have it."""
_LONGEST_REFUSAL = 500
_DECLINES = re.compile(
    r"\bI(?:'m| am)? (?:can't|cannot|can not|won't|will not|unable to|not able to)"
    r" (?:assist|help|comply|fulfill?|participate)"
    r"(?: you)?(?: (?:with|in) (?:that|this|your|the request|such|any|harmful|violen\w+)\b[^.!\n]*)?\s*(?:[.!,;]|\Z)",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class AnswerParts:
    """An answer in common terms.

    Attributes:
        text: the words for us.
        finish: why it ended, in the endpoint's words.
        refusal: the words with which the model declined, in a place of their own.
        thoughts: its reasoning, in a place of its own, if that could be the answer.
        reasoned: whether it reasoned in any other place.
        tools: the tools that it called, in words (`tool_words`).
        limit: of generated tokens, None for none.
        blocked: why a filter took the prompt, "" if none did.
    """

    text: str
    finish: str
    refusal: str = ""
    thoughts: str = ""
    reasoned: bool = False
    tools: tuple[str, ...] = ()
    limit: int | None = None
    blocked: str = ""


@dataclass(frozen=True, slots=True)
class AnswerJudgement:
    """What is played of an answer, and why there is nothing; `reason` may also remark on words that there are."""

    text: str
    verdict: Verdict = "ok"
    reason: str = ""


def tool_words(name: object, arguments: object) -> str:
    """Return the call of a tool in words that are read as a call: an object of JSON."""
    if isinstance(arguments, str):
        with contextlib.suppress(ValueError):
            arguments = json.loads(arguments)
    return json.dumps({"name": str(name), "arguments": arguments or {}}, ensure_ascii=False)


def judge(said: AnswerParts, *, tools_offered: bool = False) -> AnswerJudgement:
    """Return what became of an answer to a request that offered tools or not."""
    text = scrub("\n".join(filter(None, (said.text, *said.tools))))
    finish = said.finish.lower()
    if said.blocked:
        return AnswerJudgement(text, "filtered", f"a filter took the prompt: {excerpt(said.blocked)}")
    if finish in FILTERED:
        return AnswerJudgement(
            text, "filtered", f"a filter of the endpoint took the answer away ({excerpt(said.finish, 40)})"
        )
    words = _without_thoughts(text)
    if finish == "refusal" or (said.refusal and not words):
        told = excerpt(said.refusal or text)
        return AnswerJudgement(
            scrub(said.refusal) or text, "refused", f"the model declined: {told or 'it gave no reason'}"
        )
    if words:
        if _declines(words):
            return AnswerJudgement(text, "refused", f"the model declined: {excerpt(words)}")
        return AnswerJudgement(text, reason=_TOOLS if said.tools and not tools_offered else "")
    return _wordless(said, text, finish)


def _declines(words: str) -> bool:
    """Return whether a short text without any order says that the model will not play."""
    if len(words) > _LONGEST_REFUSAL or _CALL.search(words):
        return False
    return bool(_DECLINES.search(words.replace("\u2019", "'")))


def _wordless(said: AnswerParts, text: str, finish: str) -> AnswerJudgement:
    thought = said.reasoned or bool(said.thoughts.strip() or text.strip())
    if finish in CUT:
        return AnswerJudgement(text, "cut", _why_cut(said.limit, finish, thought=thought))
    if said.thoughts.strip() and not text.strip():
        return AnswerJudgement(
            scrub(said.thoughts), "ok", "the whole answer was among the model's reasoning, and is read there"
        )
    why = "the model thought, and then said nothing" if thought else "the model said nothing"
    return AnswerJudgement(text, "empty", f"{why} (it ended with {excerpt(said.finish, 40)!r})")


def _why_cut(limit: int | None, finish: str, *, thought: bool) -> str:
    if finish == "model_context_window_exceeded":
        return "the prompt left no room for an answer: the model's context is full"
    spent = "on its reasoning" if thought else "before it said anything"
    if limit is None:
        return f"the model used all tokens that its endpoint allows {spent}: set max_tokens in the model file"
    return f"the model used all {limit} tokens {spent}: raise max_tokens in the model file, or have it think less"


def _without_thoughts(text: str) -> str:
    """Return a text without its reasoning blocks; a block that is not closed lasts until the end."""
    return _BEGAN_BEFORE.sub("", _BLOCK.sub("", text)).strip()
