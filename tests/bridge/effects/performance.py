"""The performance of a text action: from a model's words to their effect in the game."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.act import Actor
from khala_bridge.observe import Observer
from khala_protocol.speech import parse

from .cases import AGENT, its_own, replies, task_of
from .effect import changes

if TYPE_CHECKING:
    from khala_bridge.act import Executor
    from khala_bridge.act.plan import Plan

    from .cases import Case
    from .stage import Stage

LOOPS, LONGER = 8, 40
"""Loops after the order when an effect is looked for, and after which it is looked for again if there is none."""
SAID, PLAYED = 60, 4
"""Number of replies to try until one is accepted, and of accepted ones until one has an effect."""


class Performance(NamedTuple):
    """The result of the words."""

    text: str
    """The last reply that was tried."""
    words: frozenset[str]
    """Its changes; empty if it had no effect of its own."""
    refusals: tuple[str, ...]
    """Why others were refused."""
    accepted: bool
    """Whether the last reply was a possible action of the catalogue."""


def perform(case: Case, stage: Stage, executor: Executor, said: str | None = None) -> Performance:
    """Try the replies that the stage offers until one has an effect; or only the one that was `said` before."""
    task, seen = task_of(case), stage.again()
    observation = Observer(task).observe(seen.snapshot)
    refusals: list[str] = []
    text, accepted, played = "", False, 0
    for text in islice(replies(case, stage, observation), SAID) if said is None else (said,):
        joint = Actor(task).joint(observation, {AGENT: parse(text)})
        refusals += [rejection.message for rejection in joint.rejections[AGENT]]
        accepted = bool(joint.accepted[AGENT])
        if not joint.commands:
            continue
        executor.begin()
        words, refused = _play(case, stage, executor.plan(joint.commands, seen.snapshot, 1))
        if words:
            return Performance(text, words, tuple(refusals), accepted)
        refusals += refused
        played += 1
        if played == PLAYED:
            break
        stage.again()
    return Performance(text, frozenset(), tuple(dict.fromkeys(refusals)), accepted)


def _play(case: Case, stage: Stage, plan: Plan) -> tuple[frozenset[str], list[str]]:
    """Return the changes of a plan, if some are the action's own, and the refusals."""
    played, loops = stage.play(plan)
    for more in (LOOPS, LONGER):
        seen, loops = stage.look(stage.client.step(more)), loops + more
        words = changes(stage.idle(loops), seen)
        if its_own(words, case.action):
            return words, []
    return frozenset(), [refusal.rejection.message for refusal in played.refusals]
