"""`khala openenv`: sessions of OpenEnv play agents of a match, one or a whole side, and get rewards by rubrics.

    models        what travels between client and server: action, observation, state, options of a reset
    rubrics       what a step is worth
    places        how many sessions play at a time, and which makes room for another
    environment   one session: a match, some of whose agents the client plays
    server        sessions over websocket and HTTP
    client        the client class
    cli           the command

It needs the extra `openenv`. Below it: `khala_sc2.playing.seats`.
"""
