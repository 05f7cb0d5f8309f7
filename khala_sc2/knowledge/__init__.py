"""Make the facts about the game in `bridge/khala_bridge/data/knowledge/<version>/` from the simulator's tables.

    units, abilities, upgrades, buffs   a catalogue → records               files   the files made of the records
    naming, measures, melee             names, seconds, melee types       cli     `khala knowledge`

It is here because the bridge, which reads the files, knows no simulator, and the simulator no bridge. Words about
the game are written by hand, next to the facts; this package never touches them.
"""
