"""Make the facts about the game in `bridge/khala_bridge/data/knowledge/<version>/` from the simulator's tables.

    units, abilities, upgrades, buffs   records out of a catalogue          files   the files that they become
    naming, measures, melee             names, seconds, what is in use    cli     `khala knowledge`

It stands here because the bridge, which reads the files, knows no simulator, and the simulator no bridge. Words about
the game are written by hand, beside the facts; this package never touches them.
"""
