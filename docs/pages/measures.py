"""The page of the measures, from their dataclasses and from the table of hallucinations."""

from __future__ import annotations

import inspect
import sys
import typing
from typing import TYPE_CHECKING

from docs.pages.markdown import code, head, join, prose, table
from docs.pages.schema import Describer, about, attributes
from khala_sc2.experiment.measures import GROUPS
from khala_sc2.experiment.measures.hallucinations import KINDS, Hallucinations

if TYPE_CHECKING:
    from types import ModuleType

DESCRIBER = Describer()


def page() -> str:
    """Return a table for each group of measures, and the mapping of rejections to kinds of hallucinations."""
    return join(
        head("Measures", "`khala_sc2/experiment/measures`"),
        "The numbers of an experiment: a row for each episode and side, found from its recording alone with "
        "`khala_sc2.experiment.measures.measure`. Every column is a text, a number, true or false, or null, so that a row "
        "fits into SQLite and Parquet.",
        *(block for group in GROUPS for block in _section(group)),
    )


def _section(group: type) -> list[str]:
    hints = typing.get_type_hints(group)
    rows = [(code(name), DESCRIBER.shape(hints[name]), text) for name, text in attributes(group)]
    return [
        f"## {group.__name__}",
        about(group),
        table(("column", "holds", "meaning"), rows),
        _rest(sys.modules[group.__module__]),
        _kinds() if group is Hallucinations else "",
    ]


def _kinds() -> str:
    """Return which rejection is which kind of hallucination."""
    rows = [(code(reason), code(judgement.kind), judgement.because) for reason, judgement in KINDS.items()]
    return table(("reason of the rejection", "kind", "because"), rows)


def _rest(module: ModuleType) -> str:
    """Return the docstring of a module without its first paragraph: how the numbers of a group are found."""
    return prose((inspect.getdoc(module) or "").partition("\n\n")[2])
