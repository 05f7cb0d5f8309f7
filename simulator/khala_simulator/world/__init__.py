"""The state of one game: arrays over unit slots and stores beside them, without rules."""
