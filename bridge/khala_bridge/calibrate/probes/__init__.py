"""The probes, by what they measure; `khala_bridge.calibrate.catalogue` lists them all."""
