"""Tasks: the map, the agents, their units and their actions.

config   the model of a task file            standard   the task of a map without a file
maps     the maps that can be played         images     the pictures that a task can ask for
"""
