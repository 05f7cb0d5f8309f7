"""`khala fork`: what if others had decided from a step of a recorded match on?

cli       the options of the command
commands  what it does
players   who decides after the step
futures   forks: each named, begun from the recording, paid from one budget, and played by an engine
figures   what became of them: numbers with intervals, and tables
scan      at which steps it matters most who decides
recorded  the recorded future, played once more

`khala_orchestrator.past.fork` is below, which makes the beginning of a fork, and `khala_sc2.experiment.engine`, which plays
it.
"""
