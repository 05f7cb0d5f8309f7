"""Pictures of what agents see, drawn from the same snapshots as their texts.

    palette, lettering     colours; letters and stamps             canvas      margins, axes, grid
    painting, moment       the ground; what there is to be drawn   bodies, effects, marks     what stands on it
    screen, minimap, layers, features, own                         pictures of one kind each
    album, titles, encoding                                        those that an agent is shown, in words and as bytes

A picture is a function of a snapshot, a sight and a specification (`khala_bridge.task.images`). Above it:
`khala_bridge.observe.observer`.
"""
