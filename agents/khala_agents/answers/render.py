"""A rule of answers, a briefing and an observation → the form that an endpoint must hold an answer to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.answers.choices import choices_in, choices_of
from khala_agents.answers.form import AnswerShape
from khala_agents.answers.grammar import answer_grammar
from khala_agents.answers.schema import answer_schema
from khala_agents.answers.tools import tools_for

if TYPE_CHECKING:
    from khala_agents.answers.form import AnswerRule
    from khala_protocol.messages import Briefing, View


def shape_for(rule: AnswerRule, briefing: Briefing, view: View) -> AnswerShape | None:
    """Return the form of an answer; None if nothing holds the model to one."""
    if rule.form == "text":
        return None
    choices = choices_in(briefing, view) if rule.exact else choices_of(briefing)
    match rule.form:
        case "json":
            return AnswerShape(schema=answer_schema(choices))
        case "tools":
            return AnswerShape(tools=tools_for(choices))
        case "grammar":
            return AnswerShape(grammar=answer_grammar(choices))
