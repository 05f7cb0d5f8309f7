"""The ground: terrain, footprints, resources, base places, and the land at a moment, all as arrays.

`MapGround.of(info)` belongs to a map and never changes; `land_of(snapshot)` belongs to a moment. Above:
`khala_bridge.auto`, and the modules that show the ground to an agent.
"""

from khala_bridge.state.ground.footprints import Footprint, Site, footprint_of, footprints, sites
from khala_bridge.state.ground.land import Land, land_of
from khala_bridge.state.ground.resources import Base
from khala_bridge.state.ground.terrain import MapGround

__all__ = ["Base", "Footprint", "Land", "MapGround", "Site", "footprint_of", "footprints", "land_of", "sites"]
