"""Between PySC2 and text: what an agent sees, and what its words do.

    task      what is played and by whom          catalog, knowledge, maps    tables, from data
    game      the game, behind an interface       pysc2_game, compat          … on PySC2, the only part that blocks
    state     what one player knows at a moment   frames, names               geometry; numbers and their names
    observe   snapshot → views and text           act                         words → commands → the game

A turn goes through it like this (`khala_orchestrator.match` has the loop):

    sight = observer.observe(snapshot, feedback)
    joint = actor.joint(sight, {agent: parse(reply) for agent, reply in replies.items()})
    turn = await game.act(joint.commands)

Synchronous and pure, except `game` and `pysc2_game`. Above it: `orchestrator`. Below it: `protocol`. It knows nothing
of buses, of who answers when, or of which program the game is.
"""
