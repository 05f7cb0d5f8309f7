"""Pictures of agents' observations, drawn from the same snapshots as their texts.

    palette, lettering     colours; letters and stamps             canvas      margins, axes, grid
    painting, moment       the ground; everything to be drawn      bodies, effects, marks     the things on it
    screen, minimap, layers, features, own                         pictures of one kind each
    album, titles, encoding                                        an agent's pictures, in words and as bytes

A picture is a function of a snapshot, an observation and a specification (`khala_bridge.task.images`). Above it:
`khala_bridge.observe.observer`.
"""
