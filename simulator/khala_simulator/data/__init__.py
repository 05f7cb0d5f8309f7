"""Data files of the simulator: tables of the game's versions, maps, terrain and mechanics. See SOURCES.md."""
