"""The abilities of the Terrans, a module for each unit or theme."""
