"""The map for those who watch: its ground once an episode, and everything on it at each step. Never for agents.

    terrain   the ground, and what stands on it from the beginning      marks   units as numbers in the minimap frame
    scene     the units of all sides, put together                      grids   creep, fog and ground, packed

Pure functions of the snapshots of all sides and, if the game shows it, of one of the whole map. Nothing that makes
observations may import this. Above: `khala_orchestrator.match.scenery`.
"""

from khala_bridge.overview.scene import Watched, scene_of
from khala_bridge.overview.terrain import terrain_of

__all__ = ["Watched", "scene_of", "terrain_of"]
