"""The ground: terrain, footprints, resources and base places, and what stands where at a moment, all as arrays.

`Ground.of(info)` is of a map and never changes; `land_of(snapshot)` is of a moment. Above: `bridge.macro`, and whoever
shows the ground to an agent.
"""

from bridge.ground.footprints import Footprint, Site, footprint_of, footprints, sites
from bridge.ground.land import Land, land_of
from bridge.ground.resources import Base
from bridge.ground.terrain import Ground

__all__ = ["Base", "Footprint", "Ground", "Land", "Site", "footprint_of", "footprints", "land_of", "sites"]
