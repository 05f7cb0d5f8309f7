"""What is played, by which agents, with which units and actions.

config   the model of a task file            standard   the task of a map without a file
maps     the maps that can be played         images     the pictures that a task can ask for
"""
