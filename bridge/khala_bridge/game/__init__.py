"""The game behind an interface: reset, play a plan, close; `pysc2_game` is the implementation, the only part that blocks."""
