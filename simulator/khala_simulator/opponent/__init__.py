"""Computer players: they lead the sides that no client plays, by the orders that every client has.

One thought of one player is ``player.think``, a table of contents of the others:

=============  ========================================================================
``levels``     what distinguishes the ten difficulties, from ``data/opponents/levels.yaml``
``build_file`` what is built when, from ``data/opponents/<race>.yaml``
``side``       what a player knows of its own units, and the money of this thought
``enemy``      what it knows of the others, by its sight or by cheating
``hands``      the only way to give orders; counts them against the attention of the level
``products``   making anything by its name: units, structures, upgrades, changes of kind
``bases``      where town halls can stand; ``sites`` where all other structures can
``economy``    mining, supply, workers; ``boosts`` MULEs, larvae, Chrono Boost
``spending``   opening, expansions, structures, upgrades, army: what the money is spent on
``army``       ``defence`` of the bases, ``attack`` and retreat, ``stance`` between them
``casts``      abilities of the army in a fight
``scouting``   who looks where; ``drops`` landings in enemy bases
=============  ========================================================================

How the game's own ones play is not known; all of it is an estimate.
"""
