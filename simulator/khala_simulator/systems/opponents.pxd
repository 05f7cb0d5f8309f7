from khala_simulator.world.fields cimport WorldFields


cpdef run(WorldFields world)
