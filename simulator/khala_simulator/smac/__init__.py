"""SMAC's battles in numbers: what its agents may do, what they see, and what a step is worth.

Compiled as the rules are, and below the environments that khala has on top; `khala_simulator.battle` plays the game.
"""
