"""`khala fork`: what if others had decided from a step of a recorded match on?

    players   who decides after the step
    play      one fork, in one process
    crew      processes that play forks, several at once
    futures   all forks of a step: numbered, paid from one budget, played
    figures   what became of them, as numbers with intervals and as tables
    scan      at which steps it matters most who decides
    cli       the command

`khala_orchestrator.fork` is below, which makes the beginning of a fork from a recording.
"""
