"""The row of numbers of one episode and side, put together from its groups."""

from __future__ import annotations

from dataclasses import dataclass

from khala.experiment.measures.actions import Actions
from khala.experiment.measures.communication import Communication
from khala.experiment.measures.economy import EconomyMeasures
from khala.experiment.measures.faults import Faults
from khala.experiment.measures.hallucinations import Hallucinations
from khala.experiment.measures.identity import Identity
from khala.experiment.measures.spending import Spending
from khala.experiment.measures.timing import Timing

GROUPS = (Identity, Faults, Actions, Hallucinations, Communication, Timing, Spending, EconomyMeasures)
"""The groups in the order of the columns."""


@dataclass(frozen=True, kw_only=True)
class Measures(EconomyMeasures, Spending, Timing, Communication, Hallucinations, Actions, Faults, Identity):
    """The numbers of one episode and side: only texts, numbers, booleans and None, so that it is a row of a table.

    A dataclass takes the fields of its last base first, so the columns are in the order of `GROUPS`.
    """
