"""Measure a game through the raw API: a fixed set of probes, the same for StarCraft II and for the simulator.

`probe` says what a probe is, `probes` holds them, `lab` is the game in which they play, and `run` plays a selection and
writes a file. Two files are compared in `khala_sc2.calibrate`. Nothing here knows how the simulator works or what its
tables say.
"""
