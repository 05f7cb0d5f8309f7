"""Arenas: one pool of players, matches between them, and one rating for each.

cli            the commands `khala arena …`
commands       their work
spec           the file: players, tasks in groups, anchors, budget
pairing        who meets whom: round robin and Swiss
matches        a pairing → the matches that `khala_sc2.experiment.runner` plays
results        the file of what was played, which people can send to each other
ratings        games → a rating for each player, for each group of tasks and overall
bradley_terry  the fit, and its intervals
misfit         whether games scatter as their ratings say
leaderboard    its table, and words for people
site           results → a directory of pages

Matches, budget, retries, engines and recordings are those of `khala_sc2.experiment`.
"""
