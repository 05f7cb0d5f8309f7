"""The report of an experiment: tables, figures, and how it was played.

    document = report(store)
    write(document, directory, ["html"])

summary      the numbers of a cell, with intervals
conditions   how it was played, and what should be the same and is not
tables       summaries as tables
beside       published tables with ours, and cells that measure nothing
calls        what became of calls, by agent and action
figures      summaries as pictures
document     what a report consists of, in no format
writer       the walk through a document, for every format
markdown, html, latex   writers of one format each
build        puts a document together, and writes it
"""

from khala_sc2.experiment.report.build import FORMATS, report, write

__all__ = ["FORMATS", "report", "write"]
