"""Computer players: what leads a side that nobody sits at.

How the game's own ones play is not known; these are estimates.
"""
