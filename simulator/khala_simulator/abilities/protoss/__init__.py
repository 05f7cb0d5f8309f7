"""The abilities of the Protoss, a module for each unit or theme."""
