"""The map's script, compiled: in most loops nothing of it is due; `systems.triggers` has the rules."""

from khala_simulator.systems import triggers as rules


def run(world):
    """Run the triggers that are due at this loop, in the scenario's order, until one ends the game."""
    cdef long loop = world.loop
    cdef long period
    scenario = world.map.scenario
    if len(world.deaths) == world.deaths_seen and not scenario.watches and world.loop not in scenario.moments:
        for period in scenario.periods:
            if loop % period == 0:
                break
        else:
            return
    rules.run(world)
