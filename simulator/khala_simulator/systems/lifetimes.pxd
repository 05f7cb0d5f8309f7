from khala_simulator.world.fields cimport WorldFields


cpdef run_out(WorldFields world)
