"""The rules of fights: damage, targets, weapons, buffs, and how a unit enters the world, changes and leaves it."""
