"""Between PySC2 and text: agents' observations, and the commands that their replies become.

    task      the map, the agents, their units    catalogue, knowledge   text actions; facts about types; both from data
    game      the game, behind an interface       compat                 PySC2 on today's Python
    state     a player's state at one moment      frames, names          geometry; numbers and their names
    observe   snapshot → views and text           act                    words → commands → the game
    rules     why something is not possible now   auto                   arguments that an agent leaves open

A turn goes through it like this (`khala_orchestrator.match.match` has the loop):

    observation = observer.observe(snapshot, feedback)
    joint = actor.joint(observation, {agent: parse(reply) for agent, reply in replies.items()})
    (turn,) = await game.act([joint.commands], loops)

Synchronous and pure, except `game`, which blocks. Above it: `orchestrator`. Below it: `protocol`. It knows no bus, no
deadline, and not which program the game is.
"""
