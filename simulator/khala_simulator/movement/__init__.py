"""The rules of movement: ways over the ground, contact between bodies, room for new ones."""
