from khala_simulator.world.fields cimport WorldFields


cpdef spread(WorldFields world)
