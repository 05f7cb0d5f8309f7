"""`khala calibrate`: play the probes of `khala_bridge.calibrate` on a game, and compare what two games answered."""
