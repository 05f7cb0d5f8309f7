"""Replies: what an agent's answer says, by its own words or by the default reply of the task.

The host parses a reply here and nowhere else. Above it: `khala_orchestrator.match.side`, which carries the words out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from khala_protocol.messages import Rejection
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.match.schedule import Decision
    from khala_orchestrator.match.turn import Answer
    from khala_protocol.speech import Speech


def read(decision: Decision, task: TaskConfig) -> Speech | None:
    """Return the words of an agent, without orders if they come too late; None if it failed and nothing stands in."""
    text = choose_text(decision.answer, task.default_reply)
    speech = None if text is None else parse(text)
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


def _too_late(decision: Decision, text: str, start: int) -> Rejection:
    age = decision.due_loop - decision.asked_loop
    message = f"Your reply came {age} game loops after its observation, which is too late: no order of it was given."
    return Rejection(reason="too_late", message=message, text=text, start=start)
