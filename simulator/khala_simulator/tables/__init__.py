"""The numbers of the game: unit types, weapons, abilities, upgrades, and the statistics that follow from them."""
