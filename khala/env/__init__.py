"""Environments for reinforcement learning: PettingZoo and Gymnasium; `pip install 'khala[env]'`.

`khala.env.numeric` plays SMAC's maps in numbers, as fast as the simulator goes.
"""
