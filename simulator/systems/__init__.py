"""The laws of the world, one file each; ``tick`` says in which order they apply."""
