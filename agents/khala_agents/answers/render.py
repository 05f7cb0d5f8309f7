"""A rule of answers, a briefing and an observation → the form that an endpoint must hold an answer to."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from khala_agents.answers.choices import choices_in, choices_of
from khala_agents.answers.form import AnswerShape
from khala_agents.answers.grammar import answer_grammar
from khala_agents.answers.schema import answer_schema
from khala_agents.answers.tools import tools_for

if TYPE_CHECKING:
    from khala_agents.answers.choices import Choices
    from khala_agents.answers.form import AnswerForm, AnswerRule
    from khala_protocol.messages import Briefing, View


def shape_for(rule: AnswerRule, briefing: Briefing, view: View) -> AnswerShape | None:
    """Return the form of an answer; None if nothing holds the model to one."""
    if rule.form == "text":
        return None
    return _shape(rule.form, choices_in(briefing, view)) if rule.exact else _lasting_shape(rule.form, briefing)


@lru_cache(maxsize=64)
def _lasting_shape(form: AnswerForm, briefing: Briefing) -> AnswerShape:
    """Return the form that is the same in all steps; made once for each agent."""
    return _shape(form, choices_of(briefing))


def _shape(form: AnswerForm, choices: Choices) -> AnswerShape:
    match form:
        case "json":
            return AnswerShape(schema=answer_schema(choices))
        case "tools":
            return AnswerShape(tools=tools_for(choices))
        case _:
            return AnswerShape(grammar=answer_grammar(choices))
