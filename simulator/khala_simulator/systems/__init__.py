"""The systems of the world, one file each; ``tick`` says in which order they run."""
