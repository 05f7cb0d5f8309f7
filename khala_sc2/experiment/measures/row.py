"""The row of numbers of one episode and side, put together from its groups."""

from __future__ import annotations

from dataclasses import dataclass

from khala_sc2.experiment.measures.actions import Actions
from khala_sc2.experiment.measures.communication import Communication
from khala_sc2.experiment.measures.economy import EconomyMeasures
from khala_sc2.experiment.measures.faults import Faults
from khala_sc2.experiment.measures.hallucinations import Hallucinations
from khala_sc2.experiment.measures.identity import Identity
from khala_sc2.experiment.measures.spending import Spending
from khala_sc2.experiment.measures.timing import Timing

GROUPS = (Identity, Faults, Actions, Hallucinations, Communication, Timing, Spending, EconomyMeasures)
"""The groups in the order of the columns."""


@dataclass(frozen=True, kw_only=True)
class Measures(EconomyMeasures, Spending, Timing, Communication, Hallucinations, Actions, Faults, Identity):
    """The numbers of one episode and side: only texts, numbers, booleans and None, so that it is a row of a table.

    A dataclass takes the fields of its last base first, so the columns are in the order of `GROUPS`.
    """
