"""What a client of the SC2 API is told of a world, and what its requests do to it."""
