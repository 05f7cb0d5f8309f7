"""One recording → a row of numbers for each episode and side.

    rows = measure(Recording.open("runs/a/recording.mcap"))

reading          the walk over a recording
evidence         what the measures are found from
row              the row, put together from its groups
identity … economy   a group each: what its numbers mean, and how they are found

Above it: the store, the statistics and the reports of experiments. Nothing here compares runs.
"""

from khala_sc2.experiment.measures.calls import CallCount
from khala_sc2.experiment.measures.reading import measure, measure_with_calls
from khala_sc2.experiment.measures.row import GROUPS, Measures

__all__ = ["GROUPS", "CallCount", "Measures", "measure", "measure_with_calls"]
