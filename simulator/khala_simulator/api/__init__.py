"""The SC2 API of a world: what its clients observe, and what their requests do."""
