"""Pictures of what agents see, drawn from the same snapshots as their texts.

    palette, lettering     colours; letters and stamps             canvas      margins, axes, grid
    painting, moment       the ground; what there is to be drawn   bodies, effects, marks     what stands on it
    screen, minimap, layers                                        pictures of one kind each

A picture is a function of a snapshot, a sight and a specification. Above it: `bridge.observe.observer`.
"""
