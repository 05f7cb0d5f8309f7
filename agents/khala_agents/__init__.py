"""Workers: from an `Observation` on the bus to a `Reply`, with an LLM, a function or a script in between.

An agent sees text and images only. This package knows neither PySC2 nor the simulator.
"""
