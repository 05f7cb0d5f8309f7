"""The knowledge of the game, made from the simulator's tables: the facts in `bridge/data/knowledge/<version>/`.

    units, abilities, upgrades, buffs   a catalogue → records               files   the files made of the records
    naming, measures, melee             names, seconds, melee types       cli     `khala knowledge`

It is here because the bridge, which reads the files, knows no simulator, and the simulator no bridge. Words about
the game are written by hand, next to the facts; this package never touches them.
"""
