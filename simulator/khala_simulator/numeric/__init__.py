"""Arrays and geometry of the plane, which know nothing of the game."""
