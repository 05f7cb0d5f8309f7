"""Experiments: from a file that names a grid of matches to tables with intervals.

cli         the commands `khala experiment …`
spec        the file: factors, fixed settings, seeds, budget
published   tables of papers, to print beside ours
plan        the matches of a grid, each under the hash of what it plays
runner      plays what is missing: pilot, budget, retries
engine      where a match is played: this machine, or (`ray_engine`) a Ray cluster
store       the directory of an experiment: recordings, and an index of them
measures    one recording → numbers, by episode and side
statistics  intervals and tests on numbers
power       how many games a question needs
selection   some matches of an experiment, by their factors
likeness    whether runs may be compared, and in what they differ
compare     two selections of matches, if they are alike
report      tables and figures, and how it was played
export      a row for each episode and side, for other programs
results     the commands that read what was played
"""
