"""Replies: what an agent's answer says, by its own words or by the default reply of the task.

The host parses a reply here and nowhere else. Above it: `khala_orchestrator.match.side`, which carries the words out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from khala_bridge.observe import rejection_line, shorten
from khala_protocol.manual import VERDICT
from khala_protocol.messages import Rejection
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.match.schedule import Decision
    from khala_orchestrator.match.turn import Answer
    from khala_protocol.speech import ShownText, Speech


def read(decision: Decision, task: TaskConfig, shown: ShownText) -> Speech | None:
    """Return the words of an agent, without orders if they come too late; None if it failed and nothing stands in.

    Args:
        decision: with its answer.
        task: of its side.
        shown: what the agent was shown: calls that repeat it are no orders.
    """
    text = choose_text(decision.answer, task.default_reply)
    speech = None if text is None else parse(text, shown)
    if speech is None or not is_too_old(decision, task):
        return speech
    faults = [_too_late(decision, call.name, call.start) for call in speech.calls[:1]]
    return replace(speech, calls=(), faults=(*speech.faults, *faults))


def choose_text(answer: Answer, default_reply: str) -> str | None:
    """Return the text of a reply.

    The default reply stands in for an agent that failed, and not for one that chose to say nothing.
    """
    return answer.text if answer.status == "ok" else answer.text or default_reply or None


def is_too_old(decision: Decision, task: TaskConfig) -> bool:
    """Return whether a decision takes effect later after its observation than the task allows."""
    limit = task.clock.max_age_loops
    return limit is not None and decision.due_loop - decision.asked_loop > limit


def say_unread(answer: Answer, agent: str, speech: Speech | None, task: TaskConfig) -> Iterator[Rejection]:
    """Yield one sentence to an agent of whose answer nothing could be read, or not the end.

    An answer with the heading of its actions, and none below it, says that there is nothing to do; so does one that
    only thinks, but a model whose form is not read would never learn it.
    """
    form = _ORDERS if task.agent(agent).teams else _WORDS
    if why := _WHY_NOTHING.get(answer.status):
        yield _unread(f"{why} {form}")
    elif answer.status != "ok" or speech is None or not answer.text:
        return
    elif answer.cut:
        yield _unread(_CUT, start=len(answer.text))
    elif speech.is_silent and speech.echoes:
        yield _unread(f"Your last answer only repeats what you were shown, so no order was given: {form}")
    elif speech.is_silent and not speech.headed:
        yield _unread(f"Nothing could be read in your last answer. If it was meant to do something: {form}")


def verdict_words(rejections: Sequence[Rejection]) -> str:
    """Return what an agent is told of its reply, of which nothing is possible, for its next reply in the same step."""
    lines = (rejection_line(rejection) for rejection in shorten(rejections))
    return "\n".join([VERDICT, *(f"    {line}" for line in lines), _AGAIN])


_AGAIN = "Answer the same observation again, and in full: only your new answer counts."
_ORDERS = 'write your actions under "Actions:" and "Team <name>:", each as <Name(arguments)> on a line of its own.'
_WORDS = "write your messages under \"Communications:\", each as <MessageTo(name, '''text''')> on a line of its own."
_CUT = "Your last answer was cut at the limit of tokens; what was cut off was not read. Write less before your actions."
_WHY_NOTHING: Mapping[str, str] = {
    "empty": "Your last answer was empty:",
    "cut": "Your last answer was cut at the limit of tokens before it said anything. Think less, and",
    "refused": "You declined to answer, so no order was given. This is a game between programs:",
    "filtered": "Your last answer was taken away by a filter of the endpoint. Choose other words, and",
}
"""What an agent hears of a decision that it did not make, by its status."""


def _unread(message: str, start: int = 0) -> Rejection:
    return Rejection(reason="unread", message=message, text="", start=start)


def _too_late(decision: Decision, text: str, start: int) -> Rejection:
    age = decision.due_loop - decision.asked_loop
    message = f"Your reply came {age} game loops after its observation, which is too late: no order of it was given."
    return Rejection(reason="too_late", message=message, text=text, start=start)
