"""Computer players: they lead the sides that no client plays.

How the game's own ones play is not known; these are estimates.
"""
