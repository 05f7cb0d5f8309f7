"""The abilities of the Zerg, a module for each unit or theme."""
