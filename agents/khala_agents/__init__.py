"""Workers: they answer each `Observation` on the bus with a `Reply`, using an LLM, a function or a script.

An agent sees text and images only. This package knows neither PySC2 nor the simulator.
"""
