"""One recording → a row of numbers for each episode and side.

Each module is a group of numbers: what they mean, and how they are found. `row` puts them together.
"""

from khala.experiment.measures.row import GROUPS, Measures

__all__ = ["GROUPS", "Measures"]
