"""The game behind an interface: reset, play a plan, close. `pysc2_game` implements it; only this package blocks."""
